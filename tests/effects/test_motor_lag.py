"""The set value arrives through a first-order lag."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


def test_speed_approaches_its_set_value_exponentially(make_model):
    """The lag is integrated exactly in each step; the value at its end is taken, so that rounding of the rigid servo remains: 1e-6."""
    path = make_model(flywheel(2.0, "speed"), commanded(1.5), None, [Effect(kind="motor_lag", parameters={"time_constant": 0.3})])
    w = sample(path, 1000, ("joint.velocity", "hub"), every=50)[:, 0]
    t = 0.05 * np.arange(1, 21)
    assert w == pytest.approx(1.5 * (1 - np.exp(-t / 0.3)), rel=1e-6)


def test_a_torque_command_lags_too(make_model):
    """I w = tau (t - T (1 - exp(-t/T))): the effort of a step is its mean over the step, so that only rounding remains."""
    path = make_model(flywheel(2.0, "torque"), commanded(3.0), None, [Effect(kind="motor_lag", parameters={"time_constant": 0.3})])
    w = sample(path, 1000, ("joint.velocity", "hub"), every=1000)[0, 0]
    assert w == pytest.approx(1.5 * (1 - 0.3 * (1 - np.exp(-1 / 0.3))), rel=1e-9)
