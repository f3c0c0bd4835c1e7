"""What ``rille cad inspect`` says about an assembly."""

import json

import numpy as np
import pytest

from rille.cad import read_step
from rille.cad.suggestion.inspect import as_dict, as_text, inspect, plausible_density


@pytest.fixture(scope="module")
def report(nested_step):
    return inspect(read_step(nested_step))


def test_counts_sizes_and_volumes(report):
    """Two arms of a bar 100 x 10 x 10 mm and a peg of radius 4 and length 30 mm, and a box of 20 mm."""
    assert report.instances == 5
    assert report.solids == 5
    peg = np.pi * 4**2 * 30e-9
    assert report.volume == pytest.approx(2 * (100 * 10 * 10e-9 + peg) + 20**3 * 1e-9, rel=1e-9)
    by_name = {p.name: p for p in report.parts}
    assert by_name["Träger"].count == 2
    assert by_name["Träger"].size == pytest.approx((0.1, 0.01, 0.01), abs=1e-6)
    assert by_name["peg_part"].color == "#ff0000"


def test_the_tree_is_readable(report):
    text = as_text(report)
    assert "rig/  (5 instances)" in text
    assert "|-- arm_left/  (2 instances)" in text
    assert "Träger" in text


def test_alike_siblings_are_one_line(tmp_path):
    import cadquery as cq

    screw = cq.Workplane().circle(2).extrude(10)
    machine = cq.Assembly(name="m").add(cq.Workplane().box(50, 50, 5), name="plate")
    for k in range(24):
        machine.add(screw, name=f"screw_{k}", loc=cq.Location((k * 5, 0, 10)))
    path = tmp_path / "m.step"
    machine.export(str(path))
    found = inspect(read_step(path))
    assert [(n.name, n.count) for n in found.tree[0].children] == [("plate", 1), ("screw_0", 24)]
    assert "x24" in as_text(found)
    assert found.tree[0].instances == 25


def test_free_shells_and_several_solids_are_pointed_out(write_step):
    import cadquery as cq

    box = cq.Workplane().box(10, 10, 10)
    sheet = cq.Shell.makeShell([cq.Workplane(origin=(0, 0, 30)).rect(5, 5).extrude(1).faces(">Z").val()])
    two = cq.Compound.makeCompound([box.val(), box.translate((20, 0, 0)).val(), sheet])
    found = inspect(read_step(write_step("two.step", [(two, "two")])))
    (part,) = found.parts
    assert part.solids == 2
    assert part.free_shells == 1
    assert any("free shells" in w for w in found.warnings)
    assert any("cannot move against each other" in w for w in found.warnings)


def test_surfaces_alone_are_shown_and_said_to_have_no_mass(write_step):
    import cadquery as cq

    rig = cq.Assembly(name="rig").add(cq.Face.makePlane(10, 20), name="skin")
    found = inspect(read_step(write_step("skin.step", rig.add(cq.Wire.makeCircle(5, cq.Vector(), cq.Vector(0, 0, 1)), name="path"))))
    assert [n.name for n in found.tree[0].children] == ["skin", "path"]
    assert (found.solids, found.volume) == (0, 0)
    assert sorted(found.size) == pytest.approx([0, 0.010, 0.020], abs=1e-6)
    assert sum("no mass" in w for w in found.warnings) == 2
    assert "rig/  (2 instances)" in as_text(found)


def test_json_holds_everything(report):
    value = json.loads(json.dumps(as_dict(report)))
    assert value["instances"] == 5
    assert value["tree"][0]["children"][0]["name"] == "arm_left"
    assert {p["name"] for p in value["parts"]} == {"Träger", "peg_part", "base"}


def test_a_warning_is_said_once_for_many_parts(rille_data):
    path = rille_data / "data" / "cad" / "low_cost_robot_arm.step"
    if not path.is_file():
        pytest.skip("the robot arm's STEP file is absent")
    found = inspect(read_step(path))
    density = [w for w in found.warnings if "density" in w]
    assert len(density) == 1
    assert "parts (" in density[0]
    assert not plausible_density(7.85)
    assert plausible_density(7850)
