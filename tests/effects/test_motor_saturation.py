"""The torque-speed line: w = w_0 (1 - exp(-tau_max t / (I w_0)))."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


@pytest.mark.parametrize("mode", ["speed", "torque"])
def test_run_up_against_the_line(make_model, mode):
    """Both kinds of drive ask for more than there is (10 N m); first order in h, tau_max h/(I w_0) = 1.3e-3."""
    effect = Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.25})
    path = make_model(flywheel(2.0, mode, max_torque=10.0), commanded(100.0, duration=3.0), None, [effect])
    w = sample(path, 3000, ("joint.velocity", "hub"), every=100)[:, 0]
    t = 0.1 * np.arange(1, 31)
    assert w == pytest.approx(4.0 * (1 - np.exp(-10.0 * t / (2.0 * 4.0))), rel=2e-3)


def test_below_the_line_a_speed_drive_holds_its_speed(make_model):
    effect = Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.25})
    path = make_model(flywheel(2.0, "speed", max_torque=10.0), commanded(2.0), None, [effect])
    assert sample(path, 2000, ("joint.velocity", "hub"))[-1, 0] == pytest.approx(2.0, rel=1e-6)


def test_below_the_line_a_soft_servo_does_what_it_did(make_model):
    """The law only ends efforts: where none comes near its limit, nothing changes but rounding (two rows instead of one): 1e-9."""
    seen = []
    for effects in ([], [Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.05})]):
        rover = flywheel(2.0, "speed", max_torque=10.0)
        soft = replace(rover, drives=tuple(replace(d, speed_gain=1.5) for d in rover.drives))
        seen.append(sample(make_model(soft, commanded(2.0), None, effects), 1000, ("joint.velocity", "hub"), every=50)[:, 0])
    assert seen[1] == pytest.approx(seen[0], rel=1e-9)


def test_a_line_steeper_than_the_servo_ends_its_effort(make_model):
    """Gain 1.5, line 10 (1 - 0.5 w): the servo for 5 rad/s asks for 1.5 (5 - w), beyond the line from w = 0.714 on (their crossing), then
    I w' = 10 - 5 w: exponential to 2 rad/s. First order in h: 5 h / I = 2.5e-3.
    """
    rover = flywheel(2.0, "speed", max_torque=10.0)
    soft = replace(rover, drives=tuple(replace(d, speed_gain=1.5) for d in rover.drives))
    effect = Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.5})
    w = sample(make_model(soft, commanded(5.0, duration=3.0), None, [effect]), 3000, ("joint.velocity", "hub"), every=1)[:, 0]
    t = 1e-3 * np.arange(1, 3001)
    crossing = (10.0 - 7.5) / (5.0 - 1.5)
    begin = -np.log(1 - crossing / 5.0) * 2.0 / 1.5
    wanted = np.where(t < begin, 5 * (1 - np.exp(-1.5 * t / 2)), 2.0 + (crossing - 2.0) * np.exp(-5.0 * (t - begin) / 2))
    assert w == pytest.approx(wanted, rel=5e-3)
