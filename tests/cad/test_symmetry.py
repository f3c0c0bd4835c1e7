"""Is rotational symmetry found, with axis, order and grousers, wherever the part stands - and not found where there is none?

Tolerances: radii and heights come from corners of the tessellation, which lie on the exact surface: float32 leaves 1e-7 of 0.3 m.
The thickness of grousers is counted in rays, 40 320 round the rim: 2 pi 160 mm / 40 320 = 0.025 mm. Axes come from exact faces.
"""

import math

import numpy as np
import pytest

import cad_wheels
from rille.cad.collision.symmetry import rotational_symmetry, rotational_symmetry_of_mesh, without_triangles
from rille.cad.geometry import tessellate

MM = 1e-3

WHEELS = {
    "solid": ({"wall": None}, 24, 24),
    "disc": ({"disc": 5, "bolts": 6}, 6, 24),
    "six spokes": ({"spokes": 6, "bolts": 6}, 6, 24),
    "five spokes": ({"spokes": 5}, 1, 24),
    "keyway": ({"disc": 5, "keyway": True}, 24, 24),
    "odd": ({"wall": None, "grousers": 11}, 11, 11),
}


@pytest.fixture(scope="module")
def wheels():
    """The wheels as TopoDS_Shapes."""
    return {name: cad_wheels.grousered(**options).val().wrapped for name, (options, _, _) in WHEELS.items()}


@pytest.mark.parametrize("name", WHEELS)
def test_grousers(wheels, name):
    found = rotational_symmetry(wheels[name])
    _, order, count = WHEELS[name]
    assert found is not None
    assert (found.order, found.grouser_count, found.round) == (order, count, True)
    np.testing.assert_allclose(found.axis, [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(found.point, 0, atol=1e-6)
    assert found.rim_radius == pytest.approx(0.150, abs=1e-6)
    # The outermost points are the corners of the blades: the tip at r + h, half a thickness to the side.
    assert found.radius == pytest.approx(math.hypot(0.160, 0.003), abs=1e-6)
    assert found.width == pytest.approx(0.160, abs=1e-6)
    assert found.grouser_height == pytest.approx(0.010, abs=2e-5)
    assert found.grouser_thickness == pytest.approx(0.006, abs=5e-5)
    # A keyway of 9 x 4.5 mm through a hub of 271 cm^3 is less than two per cent; five spokes are not.
    assert (found.asymmetry > 0.02) == (order == 1)
    assert (found.asymmetry > 0) == (name in ("keyway", "five spokes"))


def test_position_and_attitude_do_not_matter():
    shape = cad_wheels.grousered(disc=5, bolts=6)
    here = rotational_symmetry(shape.val().wrapped)
    there = rotational_symmetry(cad_wheels.turned(shape).val().wrapped)
    assert here is not None
    assert there is not None
    axis = cad_wheels.TURN @ [0, 0, 1]
    np.testing.assert_allclose(there.axis, axis * np.sign(axis[2]), atol=1e-9)
    np.testing.assert_allclose(there.point, np.array([310, -220, 145]) * MM, atol=1e-6)
    assert (there.order, there.grouser_count) == (here.order, here.grouser_count) == (6, 24)
    for quantity in ("radius", "rim_radius", "width", "grouser_height"):
        assert getattr(there, quantity) == pytest.approx(getattr(here, quantity), abs=2e-5)


def test_wheel_of_many_solids():
    import cadquery as cq

    rim = cq.Workplane().circle(150).circle(146).extrude(80, both=True).val()
    blades = [cq.Solid.makeBox(10, 6, 160, cq.Vector(150, -3, -80)).rotate((0, 0, 0), (0, 0, 1), 15 * k) for k in range(24)]
    found = rotational_symmetry(cq.Compound.makeCompound([rim, *blades]).wrapped)
    assert found is not None
    assert (found.order, found.grouser_count) == (24, 24)
    assert found.rim_radius == pytest.approx(0.150, abs=1e-6)


@pytest.mark.parametrize("options", [{"skew": 20}, {"chevron": 20}])
def test_oblique_grousers(options):
    found = rotational_symmetry(cad_wheels.grousered(disc=5, grousers=18, **options).val().wrapped)
    assert found is not None
    assert (found.order, found.grouser_count) == (18, 18)
    assert found.rim_radius == pytest.approx(0.150, abs=1e-6)
    # Along the rim an oblique blade is thicker: t / cos(20 deg), less where the rim falls away below the flat blade.
    assert 0.006 < found.grouser_thickness < 0.0066


def test_spokes_are_no_grousers():
    import cadquery as cq

    wheel = rotational_symmetry(cad_wheels.grousered(spokes=5, grousers=0).val().wrapped)
    fan = cad_wheels.grousered(spokes=6, grousers=0).cut(cq.Workplane().circle(200).circle(140).extrude(200, both=True))
    blades = rotational_symmetry(fan.val().wrapped)
    nut = rotational_symmetry(cq.Workplane().polygon(6, 40).circle(8).extrude(10).val().wrapped)
    assert wheel is not None
    assert blades is not None
    assert nut is not None
    assert [(s.order, s.grouser_count) for s in (wheel, blades, nut)] == [(5, 0), (6, 0), (6, 0)]
    assert [s.round for s in (wheel, blades, nut)] == [True, False, False]
    assert wheel.rim_radius == wheel.radius == pytest.approx(0.150, abs=1e-6)


def test_a_hole_in_the_rim_is_forgiven():
    import cadquery as cq

    hole = cq.Workplane("YZ").circle(3).extrude(200)  # for a set screw: through hub and rim, once
    found = rotational_symmetry(cad_wheels.grousered(disc=5).cut(hole).val().wrapped)
    assert found is not None
    assert (found.order, found.grouser_count, found.round) == (24, 24, True)
    assert 0 < found.asymmetry < 0.02


def test_body_of_revolution():
    import cadquery as cq

    found = rotational_symmetry(cq.Workplane().circle(50).extrude(50 * math.sqrt(3)).val().wrapped)  # its three moments are equal
    assert found is not None
    assert found.order == 0
    np.testing.assert_allclose(found.axis, [0, 0, 1], atol=1e-6)
    assert found.width == pytest.approx(0.05 * math.sqrt(3), rel=1e-6)


def test_no_symmetry():
    import cadquery as cq

    brick = cq.Workplane().box(40, 30, 10)
    lever = cq.Workplane().box(80, 40, 40).union(cq.Workplane().circle(15).extrude(70).translate((25, 0, 0)))
    plane = cq.Workplane(obj=cq.Face.makePlane(10, 10))
    for shape in (brick, lever, plane):
        assert rotational_symmetry(shape.val().wrapped) is None


@pytest.mark.parametrize("name", ["disc", "odd", "five spokes"])
def test_mesh_says_what_the_shape_says(wheels, name):
    """A mesh of 0.5 mm: corners on the rim are exact, so radii are; the axis is the mean of the surface, off by the tessellation."""
    mesh = tessellate(without_triangles(wheels[name]), 0.5 * MM)
    assert mesh is not None
    found = rotational_symmetry_of_mesh(mesh.vertices, mesh.triangles)
    _, order, count = WHEELS[name]
    assert found is not None
    assert (found.order, found.grouser_count) == (order, count)
    np.testing.assert_allclose(found.axis, [0, 0, 1], atol=1e-4)
    assert found.rim_radius == pytest.approx(0.150, abs=2e-5)
    assert found.grouser_height == pytest.approx(0.010, abs=1e-4)


def test_the_shape_gets_no_triangles(wheels):
    from OCP.BRepTools import BRepTools

    rotational_symmetry(wheels["solid"])
    assert not BRepTools.Triangulation_s(wheels["solid"], 1.0)
