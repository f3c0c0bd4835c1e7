"""Are masses, centres and inertias those of the closed forms, wherever the shape stands and whatever unit its file has?

Tolerance 1e-9 relative throughout: OCCT's adaptive Gauss rule, summed face by face, reaches 1e-14 on quadrics and tori (its
fixed rule is off by up to 2e-2 on real parts); 1e-9 leaves room for other builds. STEP carries 15 digits.
"""

import math

import numpy as np
import pytest

from rille.cad import brep_hash, read_step, tessellate, volume_properties

TOL = 1e-9


def closed_form(kind):
    """Shape (mm), volume [m^3], principal moments at unit density [m^5] in x, y, z."""
    import cadquery as cq

    if kind == "sphere":  # I = 2/5 V r^2
        r, volume = 0.03, 4 / 3 * math.pi * 0.03**3
        return cq.Solid.makeSphere(30, angleDegrees1=-90), volume, np.full(3, 0.4 * volume * r**2)
    if kind == "box":  # I_x = V (b^2 + c^2) / 12
        a, b, c = 0.01, 0.02, 0.03
        volume = a * b * c
        moments = volume / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
        return cq.Solid.makeBox(10, 20, 30, cq.Vector(-5, -10, -15)), volume, moments
    if kind == "cylinder":  # I_z = V r^2 / 2, I_x = V (3 r^2 + h^2) / 12
        r, h = 0.02, 0.05
        volume = math.pi * r * r * h
        across = volume * (3 * r * r + h * h) / 12
        return (
            cq.Solid.makeCylinder(20, 50, cq.Vector(0, 0, -25)),
            volume,
            np.array([across, across, volume * r * r / 2]),
        )
    if kind == "cone":  # about the centre, a quarter up: I_z = 3/10 V r^2, I_x = V (3/20 r^2 + 3/80 h^2)
        r, h = 0.02, 0.06
        volume = math.pi * r * r * h / 3
        across = volume * (3 / 20 * r * r + 3 / 80 * h * h)
        shape = cq.Solid.makeCone(20, 0, 60, cq.Vector(0, 0, -15))
        return shape, volume, np.array([across, across, 0.3 * volume * r * r])
    if kind == "torus":  # I_z = V (4 R^2 + 3 r^2) / 4, I_x = V (4 R^2 + 5 r^2) / 8
        R, r = 0.03, 0.008
        volume = 2 * math.pi**2 * R * r * r
        across = volume * (4 * R * R + 5 * r * r) / 8
        return cq.Solid.makeTorus(30, 8), volume, np.array([across, across, volume * (4 * R * R + 3 * r * r) / 4])
    # A hollow cube: the outer cube less the inner one, I = V a^2 / 6 each.
    shape = cq.Workplane().box(40, 40, 40).cut(cq.Workplane().box(30, 30, 30)).val()
    return shape, 0.04**3 - 0.03**3, np.full(3, (0.04**5 - 0.03**5) / 6)


KINDS = ["sphere", "box", "cylinder", "cone", "torus", "shelled"]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_closed_form(kind, mirrored):
    shape, volume, moments = closed_form(kind)
    found = volume_properties(shape.mirror("YZ").wrapped if mirrored else shape.wrapped)
    assert found.volume == pytest.approx(volume, rel=TOL)
    np.testing.assert_allclose(found.inertia, np.diag(moments), rtol=TOL, atol=TOL * moments.max())
    np.testing.assert_allclose(found.com, 0, atol=1e-12)


def test_compound_obeys_the_parallel_axis_theorem():
    import cadquery as cq

    ball, volume, moments = closed_form("sphere")
    pair = cq.Compound.makeCompound([ball.translate(cq.Vector(x, 0, 0)) for x in (-100, 100)])
    found = volume_properties(pair.wrapped)
    # Two balls at +-d on x: I_x = 2 I, I_y = I_z = 2 (I + V d^2).
    expected = 2 * moments + np.array([0, 1, 1]) * 2 * volume * 0.1**2
    assert found.n_solids == 2
    assert found.volume == pytest.approx(2 * volume, rel=TOL)
    np.testing.assert_allclose(found.inertia, np.diag(expected), rtol=TOL, atol=TOL * expected.max())


@pytest.mark.parametrize("kind", KINDS)
def test_independent_of_the_origin(kind):
    import cadquery as cq

    shape, volume, moments = closed_form(kind)
    far = volume_properties(shape.translate(cq.Vector(10000, -20000, 30000)).wrapped)
    np.testing.assert_allclose(far.com, [10, -20, 30], rtol=TOL)
    # Integrated about the origin, V d^2 ~ 1e6 times the result would cost six digits; about its own centre nothing is lost
    # but the digits of the coordinates themselves (1e-16 x 30 m / 0.01 m = 3e-13).
    np.testing.assert_allclose(far.inertia, np.diag(moments), rtol=TOL, atol=TOL * moments.max())
    assert far.volume == pytest.approx(volume, rel=TOL)


@pytest.mark.parametrize("placed", [False, True])
def test_mirrored_body_is_the_mirror_image(placed):
    """An asymmetric body: the products of inertia of the normal of the mirror change their sign, nothing else does."""
    import cadquery as cq

    body = cq.Workplane().box(40, 20, 10, centered=False).union(cq.Workplane().circle(4).extrude(30)).val()
    if placed:
        body = body.moved(cq.Location((100, 50, -20), (1, 2, 3), 70))
    found, twin = volume_properties(body.wrapped), volume_properties(body.mirror("XZ").wrapped)
    flip = np.diag([1.0, -1.0, 1.0])
    assert twin.volume == pytest.approx(found.volume, rel=TOL)
    np.testing.assert_allclose(twin.com, flip @ found.com, rtol=TOL, atol=1e-12)
    np.testing.assert_allclose(twin.inertia, flip @ found.inertia @ flip, rtol=TOL, atol=TOL * found.inertia.max())


def test_faces_trimmed_by_curves_that_no_formula_gives():
    """Two crossing cylinders share 16/3 r^3 (Archimedes); measured 8e-11."""
    import cadquery as cq

    rod = cq.Workplane("XY").circle(10).extrude(30, both=True).intersect(cq.Workplane("XZ").circle(10).extrude(30, both=True))
    assert volume_properties(rod.val().wrapped).volume == pytest.approx(16 / 3 * 0.01**3, rel=TOL)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "torus"])
def test_quadrics_written_as_splines(kind):
    """Many exporters write rational B-splines. The fixed rule is off by 9e-3 in volume, 3e-2 in inertia; measured: 1e-9."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert

    shape, volume, moments = closed_form(kind)
    found = volume_properties(BRepBuilderAPI_NurbsConvert(shape.wrapped, True).Shape())
    assert found.volume == pytest.approx(volume, rel=1e-6)
    np.testing.assert_allclose(found.inertia, np.diag(moments), rtol=1e-6, atol=1e-6 * moments.max())


def solid_of(shells):
    """A TopoDS_Solid of lists of faces, a shell each, as a careless exporter would write it."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

    builder, solid = BRep_Builder(), TopoDS_Solid()
    builder.MakeSolid(solid)
    for faces in shells:
        shell = TopoDS_Shell()
        builder.MakeShell(shell)
        for face in faces:
            builder.Add(shell, face)
        builder.Add(solid, shell)
    return solid


def test_faces_that_point_the_wrong_way():
    import cadquery as cq

    outer = [face.wrapped for face in cq.Solid.makeBox(40, 40, 40).Faces()]
    inner = [face.wrapped for face in cq.Solid.makeBox(30, 30, 30, cq.Vector(5, 5, 5)).Faces()]
    inside_out = [face.Reversed() for face in outer]
    for shells in ([outer], [inside_out]):
        assert volume_properties(solid_of(shells)).volume == pytest.approx(0.04**3, rel=TOL)
    # A void is a void, whichever way its faces point.
    for void in (inner, [face.Reversed() for face in inner]):
        found = volume_properties(solid_of([outer, void]))
        assert found.volume == pytest.approx(0.04**3 - 0.03**3, rel=TOL)
        np.testing.assert_allclose(found.inertia, np.eye(3) * (0.04**5 - 0.03**5) / 6, rtol=TOL, atol=1e-18)
    # One face against the others: nobody knows what is inside.
    found = volume_properties(solid_of([[outer[0].Reversed(), *outer[1:]]]))
    assert (found.volume, found.n_solids, found.n_open) == (0.0, 0, 1)


def test_solid_with_a_hole_in_its_surface_has_no_volume_but_unshared_edges_do_no_harm():
    import cadquery as cq

    box = cq.Solid.makeBox(40, 40, 40)
    found = volume_properties(solid_of([[face.wrapped for face in box.Faces()[:5]]]))
    assert (found.volume, found.n_solids, found.n_open) == (0.0, 0, 1)
    loose = volume_properties(solid_of([[face.copy().wrapped for face in box.Faces()]]))
    assert loose.volume == pytest.approx(0.04**3, rel=TOL)
    assert (loose.n_solids, loose.n_open) == (1, 0)


@pytest.mark.parametrize("unit", ["MM", "M", "INCH", "CM"])
def test_independent_of_the_unit_of_the_file(write_step, unit):
    shape, volume, moments = closed_form("box")
    path = write_step(f"box_{unit}.step", [(shape, "box")], unit)
    assert {"MM": "MILLI", "CM": "CENTI", "M": "$,.METRE", "INCH": "INCH"}[unit] in path.read_text()
    found = volume_properties(read_step(path).prototypes[0].shape)
    assert found.volume == pytest.approx(volume, rel=TOL)
    np.testing.assert_allclose(found.inertia, np.diag(moments), rtol=TOL, atol=TOL * moments.max())


def test_open_shell_does_not_count():
    import cadquery as cq

    box = cq.Solid.makeBox(10, 10, 10)
    with_sheet = cq.Compound.makeCompound([box, cq.Face.makePlane(500, 500)])
    assert volume_properties(with_sheet.wrapped).volume == pytest.approx(1e-6, rel=TOL)


def test_tessellation_keeps_its_tolerance_and_the_hash_ignores_it():
    shape, _, _ = closed_form("sphere")
    before = brep_hash(shape.wrapped)
    mesh = tessellate(shape.wrapped, 0.0005)
    assert mesh is not None
    radii = np.linalg.norm(mesh.vertices, axis=1)
    np.testing.assert_allclose(radii, 0.03, rtol=1e-6)  # float32: vertices lie on the sphere
    corners = mesh.vertices[mesh.triangles].astype(float)
    assert np.linalg.norm(corners.mean(axis=1), axis=1).min() > 0.03 - 0.0005
    # Counter-clockwise from outside: the signed volume is positive, and at most the sphere's.
    signed = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert 0.9 * 4 / 3 * math.pi * 0.03**3 < signed < 4 / 3 * math.pi * 0.03**3
    other, _, _ = closed_form("sphere")
    assert brep_hash(other.wrapped) == before
