"""Friction grows with the effort that the drive transmits."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


def test_a_torque_drive_loses_a_share(make_model):
    """I w' = tau (1 - mu) = 3 x 0.8; the effort is that of the last step, so that the first step has no friction yet: 1 ms of 1 s."""
    path = make_model(flywheel(2.0, "torque"), commanded(3.0), None, [Effect(kind="load_friction", parameters={"coefficient": 0.2})])
    w = sample(path, 1000, ("joint.velocity", "hub"), every=1000)[0, 0]
    assert w == pytest.approx(3.0 * 0.8 / 2.0 * 1.0, rel=1e-3)


def test_without_effort_there_is_none(make_model):
    path = make_model(flywheel(2.0, "torque"), commanded(0.0), None, [Effect(kind="load_friction", parameters={"coefficient": 0.2})])
    assert np.abs(sample(path, 100, ("joint.velocity", "hub"))).max() == 0
