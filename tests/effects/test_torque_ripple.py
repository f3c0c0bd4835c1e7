"""A servo at constant speed works against tau sin(k q + phase)."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


def test_the_servo_shows_the_ripple_with_opposite_sign(make_model):
    """At constant speed the drive's effort is minus the ripple; its angle is that of the step's beginning, k w h = 1.2e-2 rad earlier."""
    effect = Effect(kind="torque_ripple", parameters={"torque": 0.4, "cycles": 6, "phase": 0.3})
    path = make_model(flywheel(2.0, "speed"), commanded(2.0), None, [effect])
    q, effort = sample(path, 2000, ("joint.position", "hub"), ("joint.effort", "hub")).T
    before = q[10:] - 2.0 * 1e-3
    assert effort[10:] == pytest.approx(-0.4 * np.sin(6 * before + 0.3), abs=1e-6)
