"""Cases count to their very end: outcomes do not hang on when readings are taken."""

import numpy as np
import pytest

from effect_rigs import free_space, particle
from machines import cart, plane
from rille.model import Command, Scenario, Watch
from rille.model.study import Change, ChannelMeasure, TracedChannel
from rille.simulate.case import CaseRunner

SPEED = 0.3
DURATION = Change(kind="scenario", name="duration")
STEP = Change(kind="scenario", name="step")
X = ChannelMeasure(name="mean_x", quantity="part.position", target="body", component=0, reduce="mean")
TRACED = TracedChannel(name="x", unit="m", quantity="part.position", target="body", component=0)


def coasting(make_model, output_interval=0.02, **more):
    """A free body that moves along x for ever."""
    scenario = free_space(duration=1.0, output_interval=output_interval, start_velocity=(SPEED, 0.0, 0.0), **more)
    return make_model(particle(), scenario), scenario


@pytest.mark.parametrize("interval", [0.001, 0.02, 0.3, 0.7, 5.0])
def test_a_distance_does_not_hang_on_the_output_interval(make_model, interval):
    """Speed times time, to roundings; the mean over time of x = v t is v t / 2."""
    runner = CaseRunner(*coasting(make_model, interval), channels=[X])
    found = runner.run(0, []).outcomes
    assert found["time_reached"] == pytest.approx(1.0, rel=1e-9)
    assert found["distance"] == pytest.approx(SPEED, rel=1e-9)
    assert found["final_x"] == pytest.approx(SPEED, rel=1e-9)
    assert found["mean_x"] == pytest.approx(SPEED / 2, rel=1e-9)


@pytest.mark.parametrize("step", [0.001, 0.007, 0.03, 0.1])
def test_a_distance_hangs_on_the_step_by_a_step_at_most(make_model, step):
    runner = CaseRunner(*coasting(make_model))
    found = runner.run(0, [(STEP, step)]).outcomes
    assert found["distance"] == pytest.approx(SPEED * found["time_reached"], rel=1e-9)
    assert found["time_reached"] == pytest.approx(1.0, abs=step / 2 + 1e-9)


def test_an_outcome_grows_with_the_duration_not_in_stairs(make_model):
    """Durations between the readings, which come every 0.3 s; each drive is whole numbers of steps of 1 ms."""
    runner = CaseRunner(*coasting(make_model, 0.3))
    for duration in np.linspace(0.05, 1.0, 23):
        assert runner.run(0, [(DURATION, duration)]).outcomes["distance"] == pytest.approx(SPEED * duration, abs=SPEED * 0.5e-3 + 1e-9)


def test_a_drive_that_is_stopped_counts_to_where_it_stopped(make_model):
    """A watch stops it past x = 0.1 m: at the first step after that, although readings are 0.3 s apart."""
    watch = Watch(name="there", action="stop", quantity="part.position", target="body", above=0.1)
    result = CaseRunner(*coasting(make_model, 0.3, watches=(watch,))).run(0, [])
    assert result.status == "stopped"
    assert result.outcomes["time_reached"] == pytest.approx(0.1 / SPEED, abs=2e-3)
    assert result.outcomes["final_x"] == pytest.approx(SPEED * result.outcomes["time_reached"], rel=1e-9)


def test_traces_reach_the_last_instant(make_model):
    """Instants that are multiples of 0.1 s in another rounding than the readings' times; none beyond the end."""
    time = tuple(0.1 * k for k in range(12))
    traces = CaseRunner(*coasting(make_model, 0.1), traced=[TRACED], trace_time=time).run(0, []).traces
    np.testing.assert_allclose(traces[0, :11], SPEED * np.array(time[:11]), rtol=1e-9)
    assert np.isnan(traces[0, 11])


def test_a_heading_counts_turns(make_model):
    """A free body that spins about z at 10 rad/s for 1 s."""
    scenario = free_space(duration=1.0, start_angular_velocity=(0.0, 0.0, 10.0))
    found = CaseRunner(make_model(particle(), scenario), scenario).run(0, []).outcomes
    assert found["final_heading"] == pytest.approx(10.0, rel=1e-6)


def test_gravity_and_weight_of_soil_do_not_hang_on_their_order(make_model):
    """A unit weight that is set is what the case has, whether gravity comes before it or after; the cart sinks the same, bit by bit."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(name="s", duration=0.3, terrain="plane", placement="on_terrain", settle_time=0.5, commands=commands)
    model = make_model(rover, scenario, plane())
    runner = CaseRunner(model, scenario)
    (weight,) = [name for name in runner.bounds if name.endswith("unit_weight")]
    settings = [(Change(kind="scenario", name="gravity"), 1.62), (Change(kind="parameter", name=weight), 9000.0)]
    bulldozed = (Change(kind="effect", name="bulldozing", target="*", number="efficiency"), 1.0)  # the weight of soil matters to it
    one, other = (runner.run(0, [*order, bulldozed]).outcomes for order in (settings, settings[::-1]))
    without = runner.run(0, [settings[0], bulldozed]).outcomes
    assert one == other
    assert one != without
