"""Two wheels at both ends of an axle are two wheels, however the assembly is turned: sizes that only rounding tells apart are alike."""

import cadquery as cq
import pytest

from rille.cad.files.step_reader import read_step
from rille.cad.suggestion.suggest import suggest


@pytest.mark.parametrize("degrees", [0, 10, 30, 90])
def test_both_wheels_of_an_axle_are_found(tmp_path, degrees):
    wheel = cq.Workplane("XZ").circle(150).circle(15).extrude(50).translate((0, 25, 0))
    hull = cq.Workplane("XY").box(900, 300, 100).translate((0, 0, 150))
    for x in (-350, 350):
        hull = hull.union(cq.Workplane("XZ").center(x, 150).circle(15).extrude(500).translate((0, 250, 0)))
    cart = cq.Assembly(name="cart", loc=cq.Location(cq.Vector(0, 0, 0), cq.Vector(0, 0, 1), degrees))
    cart.add(hull, name="hull")
    for i, x in enumerate((-350, 350)):
        for j, y in enumerate((200, -200)):
            cart.add(wheel, name=f"wheel_{i}{j}", loc=cq.Location(cq.Vector(x, y, 150)))
    cart.export(str(tmp_path / "cart.step"))
    assert len(suggest(read_step(tmp_path / "cart.step")).wheels) == 4


def test_wheels_that_are_fixed_to_one_axle_are_told(tmp_path):
    """A live axle turns in the hull: a joint has one wheel, and the sheet says what becomes of the other."""
    wheel = cq.Workplane("XZ").circle(150).circle(15).extrude(50).translate((0, 25, 0))
    hull = cq.Workplane("XY").box(900, 300, 100).translate((0, 0, 150))
    cart = cq.Assembly(name="cart")
    for x in (-350, 350):
        hull = hull.cut(cq.Workplane("XZ").center(x, 150).circle(15.2).extrude(300).translate((0, 150, 0)))
    cart.add(hull, name="hull")
    for i, x in enumerate((-350, 350)):
        axle = cq.Workplane("XZ").center(x, 150).circle(15).extrude(500).translate((0, 250, 0))
        cart.add(axle, name=f"axle_{i}")
        for j, y in enumerate((200, -200)):
            cart.add(wheel, name=f"wheel_{i}{j}", loc=cq.Location(cq.Vector(x, y, 150)))
    cart.export(str(tmp_path / "cart.step"))
    found = suggest(read_step(tmp_path / "cart.step"))
    assert len(found.wheels) == 2
    told = [note for note in found.notes if "turns on one axle with" in note]
    assert len(told) == 2
    assert all("wheel_" in note and "[[gear]] with ratio = 1" in note for note in told)
