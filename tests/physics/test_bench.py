"""The single-wheel bench: the simulated rig against the root of the integrals, and a vehicle against the bench."""

import csv
import io

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import EARTH, LUNAR_SOIL, SMOOTH, rows, wheel_point
from machines import cart, plane
from rille import simulate
from rille.model import Command, Effect, InputRefused, Scenario

LOADS = [kg * EARTH for kg in (3, 5, 7, 20)]  # the loads of the original paper
SLIPS = [-0.6, -0.2, 0.0, 0.1, 0.3, 0.6, 0.9, 1.0]


@pytest.mark.parametrize("law", ["bekker", "bekker_wong", "reece"])
def test_the_simulated_rig_settles_on_the_root_of_the_integrals(law):
    """Within 1 % of the load at every load and slip. The rows' steady state obeys the soil law at any step: measured 1e-6."""
    grid = np.array([(w, s) for w in LOADS for s in SLIPS])
    both = [
        simulate.bench(law, LUNAR_SOIL, SMOOTH, load=grid[:, 0], slip_ratio=grid[:, 1], method=method)
        for method in ("quasi_static", "dynamic")
    ]
    assert both[0].status == both[1].status == ("done",) * len(grid)
    quasi, dynamic = (result.points for result in both)
    assert np.abs(dynamic.sinkage / quasi.sinkage - 1).max() < 1e-4
    assert np.abs((dynamic.drawbar_pull - quasi.drawbar_pull) / quasi.load).max() < 1e-3
    assert np.abs((dynamic.drive_torque - quasi.drive_torque) / (quasi.load * SMOOTH.radius)).max() < 1e-3


@pytest.mark.parametrize("angle", [-12.0, 5.0, 30.0])
def test_side_force_of_the_rig_at_a_slip_angle(angle):
    """Against the drift in both descriptions, with its sign, and within 1 % of the load."""
    quasi, dynamic = (wheel_point(angle=np.radians(angle), slip=0.3, method=m, wheel=SMOOTH) for m in ("quasi_static", "dynamic"))
    assert np.sign(quasi["side_force"]) == np.sign(angle)
    for name in ("side_force", "drawbar_pull"):
        assert dynamic[name] == pytest.approx(quasi[name], abs=0.01 * 50)


def test_a_vehicle_on_flat_soil_has_the_forces_of_the_bench_at_its_own_slips(make_model):
    """Every wheel of a driving cart: its load and slip put into the bench give its sinkage, drawbar pull and torque to 1 % of the load."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=10, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=3, commands=commands
    )
    simulation = Simulation(str(make_model(rover, scenario, plane(0.08))))
    simulation.settle()
    simulation.step(6000)
    for wheel in simulation.wheels():
        point = wheel_point(load=wheel[7], slip=wheel[4], wheel=SMOOTH)
        assert wheel[6] == pytest.approx(point["sinkage"], rel=1e-3)
        assert wheel[8] == pytest.approx(point["drawbar_pull"], abs=0.01 * wheel[7])
        assert wheel[10] == pytest.approx(point["drive_torque"], abs=0.01 * wheel[7] * 0.15)


def test_effects_act_on_both_benches_alike():
    for effect in (Effect(kind="slip_sinkage", parameters={"slip_gain": 0.3}), Effect(kind="exit_angle", parameters={"ratio_change": 0.5})):
        quasi, dynamic = (wheel_point(effect, method=m) for m in ("quasi_static", "dynamic"))
        for name in ("sinkage", "drawbar_pull", "drive_torque"):
            assert dynamic[name] == pytest.approx(quasi[name], rel=5e-3)
    with pytest.raises(InputRefused, match="bench knows nothing else"):
        simulate.bench(
            "bekker_wong", LUNAR_SOIL, SMOOTH, load=50, slip_ratio=0.2, effects=rows(Effect(kind="mass_change", parameters={"mass": 1.0}))
        )


def test_what_no_rig_can_run_is_a_sentence_and_what_no_soil_carries_a_status():
    for values, word in (
        ({"load": -1}, "load"),
        ({"slip_ratio": 1.2}, "slip ratio"),
        ({"load": float("nan")}, "not a number"),
        ({"speed": 0.0}, "speed"),
    ):
        with pytest.raises(InputRefused, match=word):
            simulate.bench("bekker_wong", LUNAR_SOIL, SMOOTH, **({"load": 50, "slip_ratio": 0.2} | values))
    with pytest.raises(InputRefused, match="known: bekker"):
        simulate.bench("janosi", LUNAR_SOIL, SMOOTH, load=50, slip_ratio=0.2)
    result = simulate.bench("bekker_wong", LUNAR_SOIL, SMOOTH, load=[50, 1e7], slip_ratio=0.2)
    assert result.status == ("done", "not_carried")
    assert np.isnan(result.points.drawbar_pull[1])


def test_csv_goes_out_and_comes_back(tmp_path):
    result = simulate.bench("bekker_wong", LUNAR_SOIL, SMOOTH, load=50, slip_ratio=[0.0, 0.2, 0.5], slip_angle=0.1)
    lines = simulate.bench_csv_lines(result.points, {"soil": "x"})
    path = tmp_path / "points.csv"
    path.write_text("\n".join(lines) + "\n")
    back = simulate.read_bench_csv(path)
    for name in ("load", "slip_ratio", "slip_angle", "sinkage", "drawbar_pull", "side_force", "drive_torque"):
        assert getattr(back, name) == pytest.approx(getattr(result.points, name), rel=1e-8)
    assert len(list(csv.DictReader(io.StringIO("\n".join(lines))))) == 3


@pytest.mark.parametrize(
    ("text", "columns", "word"),
    [
        ("slip,drawbar_pull_N\n0.1,2\n", {}, "no column for load"),
        ("load_N,slip\n50,0.1\n", {}, "no column for sinkage"),
        ("load_N,slip,drawbar_pull_N\n50,12,2\n", {}, "percent"),
        ("load_N,slip,drawbar_pull_N\n50,x,2\n", {}, "no number"),
        ("load_N,slip,drawbar_pull_N\n,0.1,2\n", {}, "line 2"),
        ("# bench\nload,slip,drawbar_pull\nN,-,N\n50,0.1,2\n\n50,0.1,x\n", {}, "line 6 .* has 'x'"),
        ("load_N,slip,drawbar_pull_N\n50,0.1,2\n", {"torque": "slip"}, "no quantity"),
        ("load_N,slip,drawbar_pull_N\n50,0.1,2\n", {"sinkage": "depth"}, "no column 'depth'"),
        ("load_N,slip,drawbar_pull_N\n50,0.1,2\n", {"drawbar_pull": "drawbar_pull_N:furlong"}, "furlong"),
        ("", {}, "is empty"),
    ],
)
def test_csv_that_cannot_be_used_is_a_sentence(tmp_path, text, columns, word):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(InputRefused, match=word):
        simulate.read_bench_csv(path, columns)


def test_units_and_signs_of_columns(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("Fz_N,slip_pct,slip_angle_deg,Z_mm,Fy_N\n-24,20,10,-15,-3\n")
    points = simulate.read_bench_csv(path, {"load": "-Fz_N", "sinkage": "-Z_mm", "drawbar_pull": "-Fy_N", "drive_torque": "0.4"})
    assert points.load[0] == 24
    assert points.slip_ratio[0] == pytest.approx(0.2)
    assert points.slip_angle[0] == pytest.approx(np.radians(10))
    assert points.sinkage[0] == pytest.approx(0.015)
    assert points.drawbar_pull[0] == 3
    assert points.drive_torque[0] == 0.4
