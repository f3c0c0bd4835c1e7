"""Soil that is loaded faster is stiffer by 1 + gain (v/v_0)^m."""

import pytest

from effect_rigs import assert_same_point, scaled, wheel_point
from rille.model import Effect


@pytest.mark.parametrize("speed", [0.02, 0.2])
@pytest.mark.parametrize("gain", [0.3, -0.2])
def test_equals_a_stiffer_soil_at_the_speed_of_the_rim(speed, gain):
    """At slip 0.3 the rim runs at speed / 0.7."""
    effect = Effect(kind="rate_dependence", parameters={"gain": gain, "reference_speed": 0.1, "exponent": 0.5})
    factor = 1 + gain * (speed / 0.7 / 0.1) ** 0.5
    assert_same_point(wheel_point(effect, speed=speed), wheel_point(soil=scaled(factor), speed=speed))
