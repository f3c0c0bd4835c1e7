"""Relief landforms against their formulas: slopes, volumes in closed form, points computed by hand, conservation of volume."""

import numpy as np
import pytest
import shapely

from rille.model import InputRefused, LandformInstance
from rille.terrain import landforms
from rille.terrain.grid import Grid
from rille.terrain.placed import Placed
from rille.terrain.relief import bank, bank_run, meander, meander_angle

RELIEF = (
    "cone", "ditch", "dune", "mound", "pad", "ridge", "rille", "ripple_field", "sine_track", "slope", "step", "washboard",
)  # fmt: skip


def form_of(name, **given):
    """A landform and its driver values: those of its example, changed."""
    form = landforms()[name]
    return form, form.values({**form.example, **given}, "it")


def height(name, x, y, **given):
    """Its height at points, with these drivers only."""
    form = landforms()[name]
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    return form.profile(x, y, form.values(given, "it"))


def slope(name, x, y, towards=(1.0, 0.0), **given):
    """Central difference over 2e-6 m along a direction; on a plane exact to about 1e-9 (rounding 1e-16 of 1 m over 1e-6 m)."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    there, here = (height(name, x + k * 1e-6 * towards[0], y + k * 1e-6 * towards[1], **given) for k in (1, -1))
    return (there - here) / 2e-6


def volume(name, posting, **given):
    """Sum over a grid that holds the footprint, times the area of a cell; points are off symmetric places by a third of a cell."""
    form = landforms()[name]
    drivers = form.values(given, "it")
    half_x, half_y = form.footprint(drivers)
    x = np.arange(-half_x - posting / 3, half_x + posting, posting)
    y = np.arange(-half_y - posting / 3, half_y + posting, posting)
    return float(form.profile(*np.meshgrid(x, y), drivers).sum()) * posting**2


# Shared blocks


def test_a_bank_is_straight_between_its_roundings():
    """Slope 1 between crest and toe; halfway down half of the height; 1/2 c of height lost over the crest; integral half of the run."""
    u = np.array([-1.0, 0.0, 0.3, 0.65, 1.0, 1.3, 2.0])
    assert bank(u, 0.3, 0.3) == pytest.approx([1.0, 1.0, 0.85, 0.5, 0.15, 0.0, 0.0], abs=1e-15)
    assert bank_run(0.3, 0.3) == 1.3
    assert bank(np.array([0.0, 0.5, 1.0]), 0.0, 0.0) == pytest.approx([1.0, 0.5, 0.0])
    fine = np.linspace(0, 1.3, 130001)
    assert np.trapezoid(bank(fine, 0.3, 0.3), fine) == pytest.approx(0.65, abs=1e-9)


def test_a_meander_has_the_length_and_the_angle_of_its_source():
    """Sine-generated curve: sinuosity 1/J0(omega). omega = 0.816 is 1.19 by series: J0 = 1 - 0.16647 + 0.00693 - 0.00013 = 0.84033."""
    assert meander_angle(100.0, 14.34) == pytest.approx(0.816, abs=2e-4)
    line = meander(300.0, 100.0, 14.34)
    assert 2 * line.s[-1] / 300.0 == pytest.approx(1 / 0.84033, rel=1e-4)
    assert np.abs(line.y).max() == pytest.approx(14.34, rel=1e-4)
    assert line.x[-1] == pytest.approx(150.0, abs=1e-9)


def test_the_distance_to_a_meander_is_that_to_the_densest_polyline():
    """Against a brute search over 2e5 points of the same curve; a polyline of that density is off by less than 1e-7 m."""
    line = meander(60.0, 20.0, 6.0)
    fine = np.linspace(line.s[0], line.s[-1], 200001)
    x, y = np.interp(fine, line.s, line.x), np.interp(fine, line.s, line.y)
    points = np.random.default_rng(4).uniform((-25, -9), (25, 9), (200, 2))
    along, away = line.coordinates(points[:, 0], points[:, 1], 4.0)
    true = np.array([np.hypot(x - p, y - q).min() for p, q in points])
    near = true < 4.0
    assert near.sum() > 50
    # np.interp draws chords between samples of 0.08 m at a radius of 1.6 m or more: sagitta up to 0.08^2 / (8 * 1.6) = 5e-4 m.
    assert away[near] == pytest.approx(true[near], abs=6e-4)
    assert np.isinf(away[true > 4.1]).all()
    assert np.isfinite(along[near]).all()


# Slopes equal the named angles


@pytest.mark.parametrize("angle", [-0.3, 0.4, 0.7])
def test_the_flank_of_a_cone_has_its_angle(angle):
    """Along a ray, between the roundings (shares 0.15 / 1.15 of the radius at both ends)."""
    r = np.linspace(0.2, 0.8, 7) * 2.0
    found = slope("cone", 0.6 * r, 0.8 * r, (0.6, 0.8), diameter=4.0, angle=angle)
    assert found == pytest.approx(np.full(7, -np.tan(angle)), abs=1e-8)


def test_walls_and_spoil_of_a_ditch_have_their_angles():
    """depth 1, floor 1: the wall from y 0.5 to 0.5 + 1.2 / tan(50 deg) = 1.507; berm 0.3; spoil beyond."""
    given = {"length": 20.0, "depth": 1.0, "floor": 1.0, "bank": np.deg2rad(50), "repose": np.deg2rad(30)}
    assert slope("ditch", 0.0, [0.8, 1.2], (0, 1), **given) == pytest.approx(np.tan(np.deg2rad([50, 50])), abs=1e-8)
    # Area 1 * (1 + 1.0069) = 2.0069; spoil height sqrt(2.0069 tan 30 / 2.4) = 0.6948, half width 1.2 * 0.6948 / tan 30 = 1.444.
    assert height("ditch", 0.0, 1.507 + 0.3 + 1.444, **given) == pytest.approx(0.6948, abs=2e-4)
    assert slope("ditch", 0.0, [2.4, 2.7], (0, 1), **given) == pytest.approx(np.full(2, np.tan(np.deg2rad(30))), abs=1e-8)
    assert slope("ditch", 0.0, [-2.4, 3.8], (0, 1), **given) == pytest.approx(np.full(2, -np.tan(np.deg2rad(30))), abs=1e-8)


def test_the_banks_of_a_rille_have_their_slope_in_bends_too():
    """Steepest slope anywhere away from the ends is that of the banks; a grid of 1 cm sees it to 1 % (its bank is 0.9 m long)."""
    form, drivers = form_of("rille", bank=np.deg2rad(30.0))
    x, y = np.meshgrid(np.arange(-8, 8, 0.01), np.arange(-4.5, 4.5, 0.01))
    gradient = np.hypot(*np.gradient(form.profile(x, y, drivers), 0.01))
    assert gradient.max() == pytest.approx(np.tan(np.deg2rad(30.0)), rel=0.01)
    # A third of the area of the banks is straight at a rounding of 0.3, so much of what slopes has that slope.
    assert np.mean(gradient[gradient > 0.1] > 0.99 * np.tan(np.deg2rad(30.0))) > 0.3


def test_the_embankment_of_a_pad_has_its_slope_at_sides_and_corners():
    """Height 1, bank 30 deg, rounding 0.2: straight from 0.35 m to 1.73 m beyond the edge."""
    given = {"length": 6.0, "width": 4.0, "height": 1.0, "bank": np.deg2rad(30)}
    steep = -np.tan(np.deg2rad(30))
    assert slope("pad", 4.0, 0.5, **given) == pytest.approx(steep, abs=1e-8)
    assert slope("pad", 0.5, -3.0, (0, -1), **given) == pytest.approx(steep, abs=1e-8)
    assert slope("pad", 3 + 0.6, 2 + 0.8, (0.6, 0.8), **given) == pytest.approx(steep, abs=1e-8)


def test_the_face_of_a_step_has_its_angle_and_at_90_degrees_it_is_a_wall():
    given = {"height": 0.5, "width": 3.0, "length": 2.0}
    assert slope("step", 0.3, 0.2, angle=np.pi / 4, **given) == pytest.approx(1.0, abs=1e-8)
    assert height("step", [0.0, 1e-9, 0.5, 2.0], 0.0, **given) == pytest.approx([0.0, 0.5, 0.5, 0.5])
    assert height("step", [-1.0, -1e-9], 0.0, **given) == pytest.approx([0.0, 0.0])
    assert height("step", 0.5, 1.5 + 1.0, **given) == pytest.approx(0.25)  # half way down a shoulder of 4 * 0.5 m


def test_the_slip_face_of_a_dune_has_the_angle_of_repose_everywhere():
    """Gradient of the face, inside it by 5 cm, by central differences over 2 um; the search along the brink narrows to 1e-6 of it."""
    form, drivers = form_of("dune")
    rng = np.random.default_rng(2)
    y = rng.uniform(-3.0, 3.0, 400)
    brink = drivers["horn"] * (y / (drivers["tips"] * drivers["width"] / 2)) ** 2
    x = brink + rng.uniform(0.05, 1.0, 400)
    on_face = form.profile(x + 0.1, y, drivers) > 0.02
    d = 1e-4
    dx = (form.profile(x + d, y, drivers) - form.profile(x - d, y, drivers)) / (2 * d)
    dy = (form.profile(x, y + d, drivers) - form.profile(x, y - d, drivers)) / (2 * d)
    assert on_face.sum() > 200
    assert np.hypot(dx, dy)[on_face] == pytest.approx(np.full(on_face.sum(), np.tan(np.deg2rad(34.0))), rel=2e-3)


def test_a_dune_has_its_crest_its_windward_side_and_its_horns():
    """Width 10, height 1, stoss 5.145: half way down the windward axis is half of the height; the toe is 1 / tan 34 deg."""
    z = height("dune", [0.0, -5.1446 / 2, 1 / np.tan(np.deg2rad(34)) - 0.01, 1 / np.tan(np.deg2rad(34)) + 0.01, 4.0], 0.0, width=10.0)
    assert z[:2] == pytest.approx([1.0, 0.5], abs=1e-4)
    assert z[2] == pytest.approx(0.01 * np.tan(np.deg2rad(34)), abs=1e-6)
    assert z[3] == z[4] == 0.0
    assert height("dune", 3.8, [3.6, -3.6], width=10.0).min() > 0.01  # the horns reach downwind of the bare ground between them


@pytest.mark.parametrize("given", [{}, {"tips": 0.95}, {"horn": 8.0}])
def test_a_dune_fades_within_its_margin_around_its_foot(given):
    """Weight 1 on the dune; neighbours 2 cm apart differ by 1.5 / 0.75 m * 2 cm = 0.04 at most (a cubic step over the margin of 0.75 m);
    nothing between the horns; the outline holds the sand, and nothing else."""
    form, drivers = form_of("dune", **given)
    half_x, half_y = form.footprint(drivers)
    x, y = np.meshgrid(np.arange(-half_x, half_x, 0.02), np.arange(-half_y, half_y, 0.02))
    weight = form.weight(x, y, drivers)
    assert (weight[form.profile(x, y, drivers) > 0] == 1).all()
    # The distance to sampled points of the foot (1 cm apart) is off by up to 5 mm next to it.
    assert max(np.abs(np.diff(weight, axis=k)).max() for k in (0, 1)) < 0.04 + 0.02
    assert form.weight(np.array([drivers["horn"]]), np.array([0.0]), drivers) == 0
    assert weight[0].max() < 1e-3
    sand = form.profile(x, y, drivers)
    inside = shapely.contains_xy(shapely.Polygon(form.outline(drivers)), x, y)
    assert np.mean(inside != (sand > 0)) < 0.003  # 120 corners: chords cut off 0.1 % of a circle, and some of the slip face's foot
    assert sand[~inside].max() < 0.05 * drivers["height"]


def test_ripples_have_the_slopes_of_their_half_cosines():
    """Straight ripples, wavelength 1, height 0.1, lee 0.3: steepest pi h / (2 lee) downwind of a crest and pi h / 1.4 upwind."""
    given = {"length": 40.0, "width": 40.0, "wavelength": 1.0, "height": 0.1, "waviness": 0.0}
    assert height("ripple_field", [0.0, 0.15, 0.3, 0.65, 1.0], 0.0, **given) == pytest.approx([0.05, 0.0, -0.05, 0.0, 0.05], abs=1e-12)
    assert slope("ripple_field", 0.15, 3.0, **given) == pytest.approx(-np.pi * 0.1 / 0.6, rel=1e-6)
    assert slope("ripple_field", 0.65, 3.0, **given) == pytest.approx(np.pi * 0.1 / 1.4, rel=1e-6)


def test_ripples_fork_without_steps():
    """Neighbours 2 mm apart differ by at most 3 times what the steepest straight ripple would, though crests end in forks."""
    form, drivers = form_of("ripple_field", waviness=1.0)
    x, y = np.meshgrid(np.arange(-6, 6, 0.02), np.arange(-4.5, 4.5, 0.002))
    z = form.profile(x, y, drivers)
    steepest = np.pi * drivers["height"] / (2 * drivers["lee"] * drivers["wavelength"])
    assert np.abs(np.diff(z, axis=0)).max() < 3 * 0.002 * steepest
    straight = form.profile(x, y, {**drivers, "waviness": 0.0})
    assert np.abs(z - straight).max() > 0.9 * drivers["height"] / 2  # and they do swerve


# Volumes in closed form


def test_a_mound_holds_its_volume():
    """h R^2 (pi/2 - 2/pi); the sum converges faster than the square of the posting."""
    assert volume("mound", 0.02, diameter=4.0, height=1.5) == pytest.approx(1.5 * 4 * (np.pi / 2 - 2 / np.pi), rel=1e-6)


@pytest.mark.parametrize("rounding", [0.0, 0.15, 1.0])
def test_a_cone_holds_its_volume(rounding):
    """pi R^2 h (3 + (1 + rho^2) / (1 + rho)^2) / 12, one third of the cylinder where it is sharp."""
    top = 2 * np.tan(0.6) / (1 + rounding)
    exact = np.pi * 4 * top * (3 + (1 + rounding**2) / (1 + rounding) ** 2) / 12
    assert volume("cone", 0.01, diameter=4.0, angle=0.6, rounding=rounding) == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("lean", [0.0, 0.5])
def test_a_straight_ridge_holds_its_volume(lean):
    """height width (length - fade) / 2, however far its crest leans."""
    found = volume("ridge", 0.02, length=10.0, width=2.0, height=0.5, fade=2.0, asymmetry=lean)
    assert found == pytest.approx(0.5 * 2.0 * (10.0 - 2.0) / 2, rel=1e-5)


def test_a_bent_ridge_holds_the_same_volume():
    """Pappus: its centre of mass is on the arc, so bending keeps the volume."""
    assert volume("ridge", 0.02, length=10.0, width=2.0, height=0.5, fade=2.0, bend=2.0) == pytest.approx(4.0, rel=1e-4)


def test_a_meandering_rille_takes_out_its_volume():
    """Pappus again: cross-section depth (floor + run) along a line of length 3 wavelengths / J0(omega), less one fade.

    width 2.4, depth 0.4, bank 30 deg, rounding 0.3: run = 1.3 * 0.4 / tan 30 = 0.90067, floor = 2.4 - 2 run.
    """
    from scipy.special import j0

    given = {"length": 39.0, "width": 2.4, "depth": 0.4, "wavelength": 13.0, "amplitude": 2.6, "bank": np.deg2rad(30), "fade": 5.0}
    run = 1.3 * 0.4 / np.tan(np.deg2rad(30))
    line = 39.0 / j0(meander_angle(13.0, 2.6))
    assert volume("rille", 0.02, **given) == pytest.approx(-0.4 * (2.4 - run) * (line - 5.0), rel=1e-4)


def test_a_rille_passes_through_its_amplitude():
    """A quarter of a wavelength on, the middle of the floor is an amplitude off the axis; half way up the bank it is half as deep."""
    given = {"length": 60.0, "width": 3.0, "depth": 0.5, "wavelength": 20.0, "amplitude": 4.0, "bank": np.deg2rad(35)}
    run = 1.3 * 0.5 / np.tan(np.deg2rad(35))
    y = 4.0 + np.array([0.0, 1.5 - run / 2, 1.5])
    assert height("rille", 5.0, y, **given) == pytest.approx([-0.5, -0.25, 0.0], abs=1e-6)
    assert height("rille", -5.0, -y, **given) == pytest.approx([-0.5, -0.25, 0.0], abs=1e-6)
    assert height("rille", 5.0, 5.5 + 0.45, levee=0.1, **given) == pytest.approx(0.1, abs=1e-6)  # levees 0.9 m wide


@pytest.mark.parametrize(("shape", "area"), [(0.0, 2 / np.pi), (1.0, 0.7)])
def test_bars_hold_their_volume(shape, area):
    """8 bars of 0.5 m: half sine 2/pi of the box, trapezoid (1 + top) / 2 of it; across, the width and half of both sides."""
    given = {"length": 8.0, "width": 3.0, "height": 0.1, "spacing": 1.0, "side": 0.4, "shape": shape, "top": 0.4}
    assert volume("washboard", 0.01, **given) == pytest.approx(8 * 0.1 * 0.5 * area * 3.4, rel=2e-4)
    assert height("washboard", [0.5, 0.0, -3.5], 0.0, **given) == pytest.approx([0.1, 0.0, 0.1])


def test_a_pad_holds_its_volume():
    """Box, four sides of half a run, and four corners that make one cone of the bank around a point."""
    given = {"length": 6.0, "width": 4.0, "height": 1.0, "bank": np.deg2rad(30), "rounding": 0.2}
    run = 1.2 / np.tan(np.deg2rad(30))
    corners = np.pi / np.tan(np.deg2rad(30)) ** 2 * ((1 + 0.2**2) / 12 + 1.2**2 / 4)
    assert volume("pad", 0.02, **given) == pytest.approx(24.0 + 20.0 * run / 2 + corners, rel=1e-5)


@pytest.mark.parametrize(("bank_angle", "floor", "rounding"), [(0.9, 0.6, 0.2), (1.4, 0.0, 0.0), (0.4, 2.0, 1.0)])
def test_the_spoil_of_a_ditch_is_what_was_cut(bank_angle, floor, rounding):
    """The sum over the grid vanishes beside the cut volume: under 5e-4 of it at 1 cm, and at least 3 times less than at 4 cm.

    The second ditch is a sharp V of 0.2 m width, 20 values wide at 1 cm: the trapezoid rule is off by (1/20)^2 / 12 of it at most.
    """
    given = {"length": 6.0, "depth": 0.6, "floor": floor, "bank": bank_angle, "rounding": rounding}
    cut = 0.6 * (floor + (1 + rounding) * 0.6 / np.tan(bank_angle)) * (6.0 - 1.2)
    coarse, fine = abs(volume("ditch", 0.04, **given)) / cut, abs(volume("ditch", 0.01, **given)) / cut
    assert fine < 5e-4
    assert fine < coarse / 3 or coarse < 1e-6


def test_soil_swells_by_what_is_asked():
    """Swell 1.25 leaves a quarter of the cut above the ground; 0 leaves none of it."""
    given = {"length": 6.0, "depth": 0.6, "floor": 0.6, "bank": 0.9}
    cut = 0.6 * (0.6 + 1.2 * 0.6 / np.tan(0.9)) * (6.0 - 1.2)
    assert volume("ditch", 0.01, swell=1.25, **given) == pytest.approx(0.25 * cut, rel=1e-3)
    assert volume("ditch", 0.01, swell=0.0, **given) == pytest.approx(-cut, rel=1e-3)
    assert landforms()["ditch"].conserves == "volume"


# Points


def test_mound_and_slope_have_the_bytes_they_had():
    """As written before landforms had boxes for footprints, so that scenes in use keep every bit of their heights."""
    x, y = np.meshgrid(np.linspace(-6, 6, 241), np.linspace(-6, 6, 241))
    d = np.minimum(np.hypot(x, y) / 5.5, 1.0)
    old = np.where(d < 1, 1.6 * np.cos(np.pi * d / 2) ** 2, 0.0)
    assert height("mound", x, y, diameter=11.0, height=1.6).tobytes() == old.tobytes()

    def smooth(u):
        u = np.clip(u, 0.0, 1.0)
        return u * u * (3.0 - 2.0 * u)

    angle = np.deg2rad(7.0)
    ascent = np.tan(angle) * np.clip(x + 2.5, 0.0, 5.0)
    old = ascent * smooth((2.5 + 2.5 - x) / 2.5) * smooth((2 + 2.5 - np.abs(y)) / 2.5)
    assert height("slope", x, y, angle=angle, length=5.0, width=4.0, shoulder=2.5).tobytes() == old.tobytes()


def test_a_bent_ridge_follows_its_arc():
    """Length 10, bend 2 rad to the left: radius 5; at s = 2.5 the crest is at 5 (sin 0.5, 1 - cos 0.5); a leaning one is a w / 2 inside."""
    given = {"length": 10.0, "width": 2.0, "height": 0.5, "fade": 1.0}
    x, y = 5 * np.sin(0.5), 5 * (1 - np.cos(0.5))
    assert height("ridge", x, y, bend=2.0, **given) == pytest.approx(0.5)
    assert height("ridge", x, -y, bend=-2.0, **given) == pytest.approx(0.5)
    inner = (4.5 * np.sin(0.5), 5 - 4.5 * np.cos(0.5))
    assert height("ridge", *inner, bend=2.0, asymmetry=0.5, **given) == pytest.approx(0.5)
    assert height("ridge", 0.0, 1.0, **given) == pytest.approx(0.0, abs=1e-15)
    assert height("ridge", 0.0, 0.5, **given) == pytest.approx(0.25)
    assert height("ridge", 4.5, 0.0, **given) == pytest.approx(0.25)  # half way through the fade


def test_a_ridge_takes_its_height_from_its_width():
    assert landforms()["ridge"].values({"length": 1000.0, "width": 370.0}, "it")["height"] == pytest.approx(31.08)


def test_the_tracks_have_their_phase():
    """Wavelength 2 from x = -6: crest of the left track at -6 + 2.5 = -3.5; the right one, half a wave on, has its trough there."""
    given = {"length": 12.0, "wavelength": 2.0, "height": 0.3, "gauge": 2.4, "track": 1.0}
    assert height("sine_track", -3.5, [1.2, -1.2, 0.0], **given) == pytest.approx([0.15, -0.15, 0.0], abs=1e-12)
    assert height("sine_track", -3.5, [1.2, -1.2], phase=np.pi / 2, **given) == pytest.approx([0.15, 0.0], abs=1e-12)
    one = {"length": 12.0, "wavelength": 2.0, "height": 0.3}
    assert height("sine_track", -3.5, [-1.4, 0.0, 1.4], **one) == pytest.approx([0.15, 0.15, 0.15])
    assert height("sine_track", -6.0 + 0.5 + 0.0, 0.0, **one) == pytest.approx(0.15 * 0.15625)  # a quarter into a fade of 2 m


def test_a_pad_is_level_on_a_slope():
    """On ground that rises by 0.2 along x, the pad is level at the ground's height in its middle plus its own; far off nothing changes."""
    form, drivers = form_of("pad", height=0.3)
    grid = Grid(n_rows=201, n_cols=241, posting_x=0.1, posting_y=0.1, x_west=-12.0, y_north=10.0)
    x, y = grid.points(grid.whole)
    ground = 0.2 * x + 1.0
    placed = Placed(instance=LandformInstance(name="p", landform="pad", x=1.0, y=0.0, drivers=drivers), landform=form)
    datum = placed.stand(0.2 * placed.ring()[0] + 1.0)
    heights = ground.copy()
    Placed(instance=placed.instance, landform=form, datum=datum).stamp(heights, grid, grid.whole)
    on_pad = (np.abs(x - 1) < 2.9) & (np.abs(y) < 1.9)
    assert heights[on_pad] == pytest.approx(np.full(on_pad.sum(), 1.0 + 0.2 + 0.3), abs=1e-9)
    half_x, half_y = form.footprint(drivers)
    outside = (np.abs(x - 1) > half_x) | (np.abs(y) > half_y)
    assert (heights[outside] == ground[outside]).all()


# The drivers


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("ridge", {"length": 2.0, "width": 3.0, "bend": 3.0}, "'it'.*meets itself"),
        ("rille", {"length": 30.0, "width": 2.0, "depth": 1.5}, r"'it'.*need 8\.36\d m.*width of 2 m"),
        ("rille", {"length": 30.0, "width": 2.0, "wavelength": 10.0, "amplitude": 4.5}, "runs back on itself"),
        ("washboard", {"length": 8.0, "width": 2.0, "height": 0.1, "spacing": 0.5, "bar": 0.7}, "0.7 m long, more than their spacing"),
        ("sine_track", {"length": 8.0, "wavelength": 2.0, "height": 0.1, "gauge": 1.0, "track": 1.2}, "overlap"),
    ],
)
def test_values_that_do_not_go_together_are_refused(name, given, words):
    with pytest.raises(InputRefused, match=words):
        landforms()[name].values(given, "landform 'it'")


@pytest.mark.parametrize("name", RELIEF)
def test_every_driver_says_why(name):
    for driver in landforms()[name].drivers:
        assert driver.reason, driver.name
        assert driver.source, driver.name
        assert bool(driver.law) == (driver.link is not None), driver.name


@pytest.mark.parametrize("name", RELIEF)
def test_with_drivers_anywhere_in_range_it_is_finite_and_ends_at_its_footprint(name):
    """60 draws per landform around its example, by factors up to 30 each way; what does not go together is refused by a sentence."""
    form = landforms()[name]
    rng = np.random.default_rng(11)
    done = 0
    for _ in range(60):
        given = {}
        for driver in form.drivers:
            if driver.name in form.example:
                value = form.example[driver.name] * 30 ** rng.uniform(-1, 1)
            elif rng.random() < 0.5 and driver.default is not None:
                value = rng.uniform(driver.lower, driver.upper)
            else:
                continue
            given[driver.name] = float(np.clip(value, driver.lower, driver.upper))
        try:
            drivers = form.values(given, "it")
        except InputRefused:
            continue
        half_x, half_y = form.footprint(drivers)
        x, y = rng.uniform(-1.3, 1.3, 4000) * half_x, rng.uniform(-1.3, 1.3, 4000) * half_y
        z = form.profile(x, y, drivers)
        assert np.isfinite(z).all(), given
        assert not z[(np.abs(x) > half_x) | (np.abs(y) > half_y)].any(), given
        done += 1
    assert done > 10
