"""Are masses, centres and inertias those of the closed forms, wherever the shape stands and whatever unit its file has?

Tolerance 1e-9 relative throughout: OCCT integrates quadrics by Gauss rules that are exact for them up to rounding
(measured 1e-16 to 1e-13); 1e-9 leaves room for other builds and is far below any density's accuracy. Text in STEP files
carries 15 digits.
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
    # A hollow cube: the outer cube less the inner one, I = V a^2 / 6 each.
    shape = cq.Workplane().box(40, 40, 40).cut(cq.Workplane().box(30, 30, 30)).val()
    return shape, 0.04**3 - 0.03**3, np.full(3, (0.04**5 - 0.03**5) / 6)


@pytest.mark.parametrize("kind", ["sphere", "box", "cylinder", "shelled"])
def test_closed_form(kind):
    shape, volume, moments = closed_form(kind)
    found = volume_properties(shape.wrapped)
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


def test_independent_of_the_origin():
    import cadquery as cq

    shape, volume, moments = closed_form("cylinder")
    far = volume_properties(shape.translate(cq.Vector(1000, -2000, 3000)).wrapped)
    np.testing.assert_allclose(far.com, [1, -2, 3], rtol=TOL)
    # The integral about the far origin is V d^2 ~ 1e4 times the result; its rounding (1e-16) grows by that much: 1e-12.
    np.testing.assert_allclose(far.inertia, np.diag(moments), rtol=TOL, atol=TOL * moments.max())
    assert far.volume == pytest.approx(volume, rel=TOL)


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
