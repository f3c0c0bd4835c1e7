"""Grousers multiply the shear strength under the wheel."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import LUNAR_SOIL, SMOOTH, WHEEL, assert_same_point, wheel_point
from rille.model import BenchWheel, Effect, InputRefused

EFFECT = Effect(kind="grouser_thrust", parameters={"efficiency": 0.8})


@pytest.mark.parametrize("slip", [-0.3, 0.1, 0.6])
def test_equals_a_soil_of_more_shear_strength(slip):
    """c and tan phi grow by 1 + 0.8 N h / (2 pi r); both descriptions share the quadrature."""
    gain = 1 + 0.8 * 24 * 0.01 / (2 * np.pi * 0.15)
    soil = replace(LUNAR_SOIL, cohesion=gain * LUNAR_SOIL.cohesion, friction_angle=np.arctan(gain * np.tan(LUNAR_SOIL.friction_angle)))
    assert_same_point(wheel_point(EFFECT, slip=slip), wheel_point(soil=soil, slip=slip))


def test_the_gain_is_capped_and_smooth_wheels_are_refused():
    tall = replace(WHEEL, grouser_height=0.05)
    taller = replace(WHEEL, grouser_height=0.08)
    assert_same_point(wheel_point(EFFECT, wheel=tall), wheel_point(EFFECT, wheel=taller))
    assert isinstance(SMOOTH, BenchWheel)
    with pytest.raises(InputRefused, match="grousers"):
        wheel_point(EFFECT, wheel=SMOOTH)
