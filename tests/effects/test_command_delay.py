"""Every command acts later."""

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


def test_speed_steps_after_the_delay(make_model):
    path = make_model(flywheel(2.0, "speed"), commanded(1.5, time=0.2), None, [Effect(kind="command_delay", parameters={"delay": 0.137})])
    w = sample(path, 1000, ("joint.velocity", "hub"))[:, 0]
    t = 1e-3 * np.arange(1, 1001)
    assert np.abs(w[t < 0.3365]).max() == 0
    assert w[t > 0.3385] == pytest.approx(1.5, rel=1e-6)


def test_a_delay_that_is_no_whole_number_of_steps_shortens_the_pull_by_itself(make_model):
    """I w = tau (t - delay) for any delay: an effort that sets in within a step acts by its mean over that step."""
    for delay in (0.0003, 0.0137, 0.1372):
        path = make_model(flywheel(2.0, "torque"), commanded(3.0), None, [Effect(kind="command_delay", parameters={"delay": delay})])
        w = sample(path, 1000, ("joint.velocity", "hub"), every=1000)[0, 0]
        assert w == pytest.approx(1.5 * (1 - delay), rel=1e-9)


def test_what_is_commanded_on_the_way_is_late_too(make_model):
    """By hand, as in a live session, and once more for another moment: not only what the scenario lists."""
    path = make_model(flywheel(2.0, "speed"), commanded(0.0), None, [Effect(kind="command_delay", parameters={"delay": 0.05})])
    simulation = Simulation(str(path))
    simulation.settle()
    simulation.sample(100, 100, [])
    simulation.command("motor", 1.5)
    simulation.sample(20, 20, [])
    simulation.command("motor", -0.5)
    w = simulation.sample(100, 1, [("joint.velocity", "hub", 0)])[:, 0]
    t = 0.12 + 1e-3 * np.arange(1, 101)
    assert np.abs(w[t < 0.1495]).max() == 0
    assert w[(t > 0.1515) & (t < 0.1695)] == pytest.approx(1.5, rel=1e-6)
    assert w[t > 0.1715] == pytest.approx(-0.5, rel=1e-6)
