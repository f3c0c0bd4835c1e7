"""The axle needs coefficient x load x radius more torque."""

from dataclasses import replace

import pytest

from effect_rigs import EARTH, rig, sample, wheel_point
from machines import plane
from rille.model import Effect, MaterialPair, Scenario


@pytest.mark.parametrize("method", ["quasi_static", "dynamic"])
def test_torque_grows_by_coefficient_load_radius(method):
    """0.05 x 50 N x 0.15 m; load, sinkage and drawbar pull stay. The rig settles to 2e-5 of the load."""
    effect = Effect(kind="rolling_resistance", parameters={"coefficient": 0.05})
    base, rolling = wheel_point(method=method), wheel_point(effect, method=method)
    assert rolling["drive_torque"] - base["drive_torque"] == pytest.approx(0.05 * 50 * 0.15, rel=1e-3)
    assert rolling["drawbar_pull"] == pytest.approx(base["drawbar_pull"], abs=2e-3)


def test_it_acts_on_hard_ground_too(make_model):
    """A wheel that slips has the friction of the pair whatever its torque; the drive gives the torque of the resistance beside it."""
    hard = replace(plane(), pairs=(MaterialPair(response="rigid", soil="lunar_sourcebook", friction=0.5),))
    rover, commands = rig(slip=0.2)
    scenario = Scenario(name="s", duration=3, gravity=(0, 0, -EARTH), terrain="plane", commands=commands)
    effect = Effect(kind="rolling_resistance", parameters={"coefficient": 0.05})
    efforts = [
        sample(make_model(rover, scenario, hard, effects), 3000, ("joint.effort", "axle"), every=3000)[0, 0] for effects in ((), (effect,))
    ]
    assert efforts[1] - efforts[0] == pytest.approx(0.05 * 50 * 0.15, rel=1e-3)
