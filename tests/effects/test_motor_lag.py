"""The set value arrives through a first-order lag."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


def test_speed_approaches_its_set_value_exponentially(make_model):
    """The lag is integrated exactly in each step, and its mean is taken: the way q = w (t - T (1 - exp(-t/T))) is right to the rounding of
    the rigid servo, 1e-6; the speed is that of the middle of a step, w h/(2 T) = 2.5 mrad/s late at most.
    """
    path = make_model(flywheel(2.0, "speed"), commanded(1.5), None, [Effect(kind="motor_lag", parameters={"time_constant": 0.3})])
    t, lag, step = 0.05 * np.arange(1, 21), 0.3, 1e-3
    way = sample(path, 1000, ("joint.position", "hub"), every=50)[:, 0]
    assert way == pytest.approx(1.5 * (t - lag * (1 - np.exp(-t / lag))), rel=1e-6)
    speed = sample(path, 1000, ("joint.velocity", "hub"), every=50)[:, 0]
    assert speed == pytest.approx(1.5 * (1 - np.exp(-t / lag)), abs=1.5 * step / (2 * lag))


def test_a_soft_servo_moves_as_far_with_any_step(make_model):
    """A servo of 1 N m s/rad, whose set value lags by less than a step: a step eight times as long changes the way by a small part of what
    the lag does, w T = 5.25 mrad.
    """
    way = []
    for step in (5e-4, 4e-3):
        effects = [Effect(kind="motor_lag", parameters={"time_constant": 3.5e-3})]
        path = make_model(flywheel(2.0, "speed", speed_gain=1.0), commanded(1.5, step=step), None, effects)
        way.append(sample(path, round(0.4 / step), ("joint.position", "hub"), every=round(0.4 / step))[0, 0])
    assert abs(way[1] - way[0]) < 0.1 * 1.5 * 3.5e-3


def test_a_torque_command_lags_too(make_model):
    """I w = tau (t - T (1 - exp(-t/T))): the effort of a step is its mean over the step, so that only rounding remains."""
    path = make_model(flywheel(2.0, "torque"), commanded(3.0), None, [Effect(kind="motor_lag", parameters={"time_constant": 0.3})])
    w = sample(path, 1000, ("joint.velocity", "hub"), every=1000)[0, 0]
    assert w == pytest.approx(1.5 * (1 - 0.3 * (1 - np.exp(-1 / 0.3))), rel=1e-9)
