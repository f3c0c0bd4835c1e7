"""Cylinders, planes and spheres of shapes whose faces are known."""

import math

import numpy as np
import pytest

from rille.cad.suggestion.features import cylinders, planes, spheres

# OCCT's modelling tolerance is 1e-7 m; values of analytic surfaces come back with 15 digits.
EXACT = 1e-12


def test_a_split_hole_is_one_cylinder():
    """A hole that is cut by a plane through its axis into two half cylinders, as many exporters write it."""
    import cadquery as cq

    half = cq.Workplane(origin=(0, 10, 0)).box(60, 20, 15).cut(cq.Workplane(origin=(5, 0, -20)).circle(4).extrude(40))
    both = cq.Compound.makeCompound([half.val(), half.mirror("XZ").val()])
    (hole,) = cylinders(both.wrapped)
    assert hole.concave
    assert hole.radius == pytest.approx(0.004, abs=EXACT)
    assert hole.sweep == pytest.approx(2 * math.pi, rel=1e-9)
    assert hole.high - hole.low == pytest.approx(0.015, abs=1e-9)
    assert np.abs(hole.axis) == pytest.approx([0, 0, 1], abs=EXACT)
    assert hole.point[:2] == pytest.approx([0.005, 0], abs=EXACT)
    assert hole.area == pytest.approx(2 * math.pi * 0.004 * 0.015, rel=1e-9)


def test_holes_and_shafts_differ():
    """Inside and outside of a tube, also where the solid is mirrored."""
    import cadquery as cq

    tube = cq.Workplane().circle(10).circle(7).extrude(30)
    for shape in (tube, tube.mirror("XY"), tube.rotate((0, 0, 0), (1, 1, 0), 50)):
        found = cylinders(shape.val().wrapped)
        assert sorted((round(c.radius * 1e3, 9), c.concave) for c in found) == [(7.0, True), (10.0, False)]


def test_two_ears_of_a_fork_are_two_holes():
    import cadquery as cq

    ears = cq.Workplane().pushPoints([(0, -20), (0, 20)]).box(30, 8, 30).cut(cq.Workplane("XZ", origin=(0, 50, 0)).circle(5).extrude(100))
    found = cylinders(ears.combine().val().wrapped) if len(ears.vals()) > 1 else cylinders(ears.val().wrapped)
    assert len(found) == 2
    assert sorted(round((c.low + c.high) / 2 * float(c.axis[1]), 6) for c in found) == [-0.020, 0.020]


def test_a_spline_that_is_a_cylinder_counts():
    """Some programs write every surface as a spline."""
    import cadquery as cq
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert

    bar = cq.Workplane(origin=(3, 4, 0)).circle(6).extrude(20).val().wrapped
    (found,) = cylinders(BRepBuilderAPI_NurbsConvert(bar, True).Shape())
    assert not found.concave
    assert found.radius == pytest.approx(0.006, abs=1e-8)
    assert np.abs(found.axis) == pytest.approx([0, 0, 1], abs=1e-7)
    assert found.high - found.low == pytest.approx(0.020, abs=1e-6)
    assert len(planes(BRepBuilderAPI_NurbsConvert(bar, True).Shape())) == 2


def test_planes_have_outward_normals_holes_and_areas():
    import cadquery as cq

    plate = cq.Workplane().box(60, 40, 10).faces(">Z").workplane().hole(8)
    found = planes(plate.val().wrapped)
    assert len(found) == 6
    for plane in found:
        assert plane.normal @ plane.point == pytest.approx(np.abs(plane.point).max(), abs=1e-9)  # out of a box about the origin
    top = next(p for p in found if p.normal[2] > 0.9)
    assert top.area == pytest.approx(60e-3 * 40e-3 - math.pi * 4e-3**2, rel=1e-9)
    assert len(top.holes) == 1
    assert np.linalg.norm(top.holes[0][:, :2], axis=1) == pytest.approx(0.004, abs=1e-9)
    assert np.ptp(top.outline, axis=0) == pytest.approx([0.060, 0.040, 0], abs=1e-9)


def test_spheres():
    import cadquery as cq

    block = cq.Workplane().box(40, 40, 40).cut(cq.Workplane().sphere(12).translate((0, 0, 20)))
    (socket,) = spheres(block.val().wrapped)
    (ball,) = spheres(cq.Workplane().sphere(11.9).val().wrapped)
    assert socket.concave
    assert not ball.concave
    assert socket.center == pytest.approx([0, 0, 0.020], abs=EXACT)
    assert ball.radius == pytest.approx(0.0119, abs=EXACT)
