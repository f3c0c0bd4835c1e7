"""Wide wheels meet more pressure: the moduli scale with (b/b_0)^e."""

from dataclasses import replace

import pytest

from effect_rigs import WHEEL, assert_same_point, scaled, wheel_point
from rille.model import Effect


@pytest.mark.parametrize("width", [0.05, 0.1, 0.3])
def test_equals_a_soil_with_scaled_moduli(width):
    effect = Effect(kind="plate_size", parameters={"exponent": 0.8, "reference_width": 0.1})
    wheel = replace(WHEEL, width=width)
    assert_same_point(wheel_point(effect, wheel=wheel, load=20.0), wheel_point(soil=scaled((width / 0.1) ** 0.8), wheel=wheel, load=20.0))
