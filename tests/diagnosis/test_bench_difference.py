"""Bench points beside the bench: a perfect model leaves the repeatability and nothing else, a wrong one is off where it is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import LUNAR_SOIL, SMOOTH
from rille import simulate
from rille.diagnosis.comparison.bench_difference import (
    compare_bench,
    find_curves,
    repeat_groups,
    scatter_of_differences,
    scatter_of_repeats,
)
from rille.model import BenchPoints, InputRefused
from rille.model.recording import Channel, GateFinding, Recording

NOISE = {"sinkage": 3e-4, "drawbar_pull": 0.4, "side_force": 0.3, "drive_torque": 0.05}
SLIPS, ANGLES = np.arange(-0.2, 0.81, 0.1), np.radians([0.0, 10.0, 20.0])


def bench(soil):
    """The simulator that the comparison is given."""

    def run(points):
        result = simulate.bench("bekker_wong", soil, SMOOTH, load=points.load, slip_ratio=points.slip_ratio, slip_angle=points.slip_angle)
        return result.points, result.status

    return run


def conditions(repeats=3, loads=(60.0,), angles=ANGLES, jitter=0.0, seed=1):
    """Grid of conditions in disorder; jitter [-] : 1 sigma of the loads, which are measured and not quite what was set."""
    random = np.random.default_rng(seed)
    grid = np.array([(w, s, a) for w in loads for a in angles for s in SLIPS for _ in range(repeats)])
    grid[:, 0] *= 1 + jitter * random.standard_normal(len(grid))
    return BenchPoints.at(*grid[random.permutation(len(grid))].T)


def recorded(points, soil=LUNAR_SOIL, seed=2, noise=NOISE, **more):
    """A recording of these points: responses of the soil with white noise."""
    random = np.random.default_rng(seed)
    truth, _ = bench(soil)(points)
    number = np.arange(len(points), dtype=float)
    channels = [
        Channel(
            name=name,
            quantity=f"wheel.{name}",
            target="wheel",
            unit="m" if name == "sinkage" else "N",
            time=number,
            value=getattr(truth, name) + sigma * random.standard_normal(len(points)),
            **more,
        )
        for name, sigma in noise.items()
    ]
    return Recording(name="bench", kind="points", channels=tuple(channels))


def normalised(channel):
    """Root mean square of the residuals per noise."""
    return float(np.sqrt(np.mean((channel.residual / channel.noise) ** 2)))


def test_its_own_model_leaves_the_repeatability():
    """99 points: noise within 4 of its standard errors (sigma / sqrt(2 * 66)), residuals at it (1 +- 4 * 0.11), no bias beyond 4 errors."""
    points = conditions()
    made = compare_bench(bench(LUNAR_SOIL), recorded(points), points, wheel="wheel")
    assert made.mode == "points"
    assert len(made.windows) == 3
    for channel in made.channels:
        sigma = NOISE[channel.channel.name]
        assert channel.noise_from == "repeats"
        assert channel.noise == pytest.approx(sigma, rel=4 / np.sqrt(2 * 66))
        assert normalised(channel) == pytest.approx(1, abs=0.44)
        assert abs(channel.residual.mean()) < 4 * sigma / np.sqrt(99)


def test_points_are_ordered_by_curve_and_slip_and_keep_their_number():
    points = conditions()
    made = compare_bench(bench(LUNAR_SOIL), recorded(points), points, wheel="front")
    values = made.regimes.values
    assert np.array_equal(made.regimes.time, np.arange(len(points)))
    assert np.array_equal(values["slip_ratio/front"], points.slip_ratio[values["point"].astype(int)])
    for window in made.windows:
        here = made.regimes.window == window.number
        assert (np.diff(values["slip_ratio/front"][here]) >= 0).all()
        assert np.ptp(values["slip_angle/front"][here]) == 0
        assert (window.start, window.stop) == (made.regimes.time[here].min(), made.regimes.time[here].max())
    assert "window 1: slip angle 10 deg, load 60 N, 33 points over slip ratio" in made.notes


def test_another_soil_shows_in_the_channels_that_it_moves():
    """The real soil has 5 degrees less friction: pull and torque are many sigmas off, in the same sign."""
    points = conditions()
    weaker = replace(LUNAR_SOIL, friction_angle=LUNAR_SOIL.friction_angle - np.radians(5))
    made = {c.channel.name: c for c in compare_bench(bench(LUNAR_SOIL), recorded(points, weaker), points, wheel="wheel").channels}
    assert normalised(made["drawbar_pull"]) > 3
    assert normalised(made["drive_torque"]) > 3
    assert made["drawbar_pull"].residual[made["drawbar_pull"].simulated > 5].mean() < 0


def test_a_side_force_that_the_model_lacks_grows_with_the_slip_angle():
    points = conditions()
    truth = recorded(points)
    extra = np.array([*truth.channels])
    more = replace(extra[2], value=extra[2].value + 30 * np.sin(points.slip_angle))
    made = compare_bench(bench(LUNAR_SOIL), replace(truth, channels=(*truth.channels[:2], more, truth.channels[3])), points, wheel="wheel")
    side = next(c for c in made.channels if c.channel.name == "side_force")
    off = [side.residual[side.window == k].mean() for k in range(3)]
    assert off == pytest.approx([0, 30 * np.sin(np.radians(10)), 30 * np.sin(np.radians(20))], abs=4 * 0.3 / np.sqrt(33))


def test_loads_that_vary_between_repeats_are_not_taken_for_noise():
    """Loads scatter by 5 %, which moves torque by 0.13 N m, beyond its noise of 0.05: the model's own differences are taken out."""
    points = conditions(jitter=0.05)
    made = compare_bench(bench(LUNAR_SOIL), recorded(points), points, wheel="wheel")
    raw = scatter_of_repeats(recorded(points).channels[3].value, repeat_groups(points))
    assert raw.sigma > 1.5 * NOISE["drive_torque"]
    for channel in made.channels:
        assert channel.noise == pytest.approx(NOISE[channel.channel.name], rel=4 / np.sqrt(2 * 60)), channel.channel.name


@pytest.mark.parametrize("seed", range(20))
def test_without_repeats_the_scatter_about_the_curve_is_the_noise(seed):
    """41 points on a parabola as curved as a pull curve: within 4 standard errors (about 1 / sqrt(41)); curvature adds 1 % at most."""
    random = np.random.default_rng(seed)
    x = np.sort(random.uniform(0, 1, 41))
    y = 20 * x - 12 * x**2 + 0.3 * random.standard_normal(41)
    found = scatter_of_differences(y, x, np.zeros(41, dtype=np.int64))
    assert found.degrees == 39
    assert found.sigma == pytest.approx(0.3, rel=4 / np.sqrt(41))


def test_noise_is_stated_before_it_is_found_and_assumed_where_it_cannot_be_found():
    points = conditions()
    stated = compare_bench(bench(LUNAR_SOIL), recorded(points, noise={"drawbar_pull": 0.4}, seed=3), points).channels[0]
    assert stated.noise_from == "repeats"
    both = recorded(points, noise={"drawbar_pull": 0.4})
    told = replace(both, channels=(replace(both.channels[0], noise=0.5, resolution=1.2),))
    channel = compare_bench(bench(LUNAR_SOIL), told, points).channels[0]
    assert (channel.noise_from, channel.noise) == ("stated", pytest.approx(np.hypot(0.5, 1.2 / np.sqrt(12))))
    four = points.where(np.arange(len(points)) < 4)
    channel = compare_bench(bench(LUNAR_SOIL), recorded(four, noise={"drawbar_pull": 0.4}), four).channels[0]
    assert channel.noise_from == "assumed"
    assert channel.noise == pytest.approx(0.03 * np.ptp(channel.measured))


def test_curves_and_repeats_of_many_kinds_of_benches():
    """Set loads close to each other are different; measured ones that scatter are one; a dense sweep is no heap of repeats."""
    set_loads = conditions(loads=(50.0, 55.0, 60.0), angles=(0.0,))
    assert find_curves(set_loads).label.max() == 2
    assert np.bincount(repeat_groups(set_loads)).max() == 3
    assert find_curves(conditions(jitter=0.08, angles=(0.0,))).label.max() == 0
    dense = BenchPoints.at(50.0, np.linspace(0, 1, 401))
    assert np.bincount(repeat_groups(dense)).max() <= 5  # within 0.01 of slip
    over_load = BenchPoints.at(np.linspace(20, 80, 13), 0.2)
    assert find_curves(over_load).sweep == "load"
    assert find_curves(over_load).label.max() == 0
    assert np.bincount(repeat_groups(over_load, "load")).max() == 1


def test_points_without_a_number_on_either_side_are_left_out_and_said():
    points = conditions()
    truth = recorded(points, noise={"drawbar_pull": 0.4})
    value = truth.channels[0].value.copy()
    value[:7] = np.nan
    load = points.load.copy()
    load[50:52] = np.nan

    def run(asked):
        result, _ = bench(LUNAR_SOIL)(asked)
        lost = asked.slip_ratio > 0.75
        return replace(result, drawbar_pull=np.where(lost, np.nan, result.drawbar_pull)), ["not_carried" if k else "done" for k in lost]

    given = replace(truth, channels=(replace(truth.channels[0], value=value),))
    made = compare_bench(run, given, replace(points, load=load))
    known = np.isfinite(value) & np.isfinite(load) & (points.slip_ratio < 0.75)
    assert len(made.channels[0].residual) == known.sum()
    assert np.isfinite(made.channels[0].residual).all()
    assert any(note.startswith("2 points lack") for note in made.notes)
    assert any("not carried" in note for note in made.notes)
    assert all("not carried" in window.ended for window in made.windows)


def test_a_channel_that_the_gate_flags_takes_no_part():
    points = conditions()
    truth = recorded(points)
    finding = GateFinding(code="stuck", severity="warning", channel="side_force", message="stuck")
    made = compare_bench(bench(LUNAR_SOIL), replace(truth, findings=(finding,)), points)
    assert [bool(c.left_out) for c in made.channels] == [False, False, True, False]


def test_what_cannot_be_compared_is_refused():
    points = conditions()
    truth = recorded(points)
    with pytest.raises(InputRefused, match="no observed channel that the bench gives"):
        compare_bench(bench(LUNAR_SOIL), replace(truth, channels=()), points)
    with pytest.raises(InputRefused, match="can be simulated: 99 x not carried"):
        compare_bench(lambda asked: (asked, ["not_carried"] * len(asked)), truth, points)
    with pytest.raises(InputRefused, match="no point of recording 'bench' has a load"):
        compare_bench(bench(LUNAR_SOIL), truth, replace(points, load=np.full(len(points), np.nan)))


def test_one_point_alone_is_compared():
    one = conditions().where(np.arange(99) == 0)
    made = compare_bench(bench(LUNAR_SOIL), recorded(one, noise={"drawbar_pull": 0.4}), one)
    assert len(made.channels[0].residual) == 1
    assert made.channels[0].noise == pytest.approx(0.03 * abs(made.channels[0].measured[0]))
