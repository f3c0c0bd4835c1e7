"""Speed falls with the load on the supply."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Effect


def test_steady_speed_against_viscous_load(make_model):
    """w = set (1 - sag b w / tau_max)  ->  w = set / (1 + sag set b / tau_max) = 2 / 1.08."""
    effects = [Effect(kind="supply_sag", parameters={"sag": 0.2}), Effect(kind="viscous_friction", parameters={"coefficient": 2.0})]
    path = make_model(flywheel(2.0, "speed", max_torque=10.0), commanded(2.0, duration=5.0), None, effects)
    w = sample(path, 5000, ("joint.velocity", "hub"), every=5000)[0, 0]
    assert w == pytest.approx(2.0 / 1.08, rel=1e-5)
    assert np.isfinite(w)
