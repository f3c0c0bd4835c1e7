"""The axle needs coefficient x load x radius more torque."""

import pytest

from effect_rigs import wheel_point
from rille.model import Effect


@pytest.mark.parametrize("method", ["quasi_static", "dynamic"])
def test_torque_grows_by_coefficient_load_radius(method):
    """0.05 x 50 N x 0.15 m; load, sinkage and drawbar pull stay. The rig settles to 2e-5 of the load."""
    effect = Effect(kind="rolling_resistance", parameters={"coefficient": 0.05})
    base, rolling = wheel_point(method=method), wheel_point(effect, method=method)
    assert rolling["drive_torque"] - base["drive_torque"] == pytest.approx(0.05 * 50 * 0.15, rel=1e-3)
    assert rolling["drawbar_pull"] == pytest.approx(base["drawbar_pull"], abs=2e-3)
