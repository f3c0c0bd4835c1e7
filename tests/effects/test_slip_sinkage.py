"""A wheel with slip sinkage is a wheel on a soil of exponent n + n_1 |s|."""

from dataclasses import replace

import pytest

from effect_rigs import LUNAR_SOIL, assert_same_point, wheel_point
from rille.model import Effect


@pytest.mark.parametrize("slip", [-0.5, 0.0, 0.2, 0.8])
def test_equals_a_soil_with_the_larger_exponent(slip):
    """Two descriptions of one thing. Zero slip counts as 1e-8 (physics/slip.hpp), which moves the exponent by 3e-9: 1e-7."""
    effect = Effect(kind="slip_sinkage", parameters={"slip_gain": 0.3})
    soil = replace(LUNAR_SOIL, sinkage_exponent=1 + 0.3 * abs(slip))
    assert_same_point(wheel_point(effect, slip=slip, load=20.0), wheel_point(soil=soil, slip=slip, load=20.0), rel=1e-7)


def test_sinkage_grows_with_slip_far_more_than_wong_and_reece_say():
    """The published growth from slip 0 to 0.9 is 1.8 times on smooth wheels; the base model gives a few per cent."""
    effect = Effect(kind="slip_sinkage", parameters={"slip_gain": 0.4})
    growth = [wheel_point(e, slip=0.9, load=20.0)["sinkage"] / wheel_point(e, slip=0.0, load=20.0)["sinkage"] for e in (None, effect)]
    assert growth[0] < 1.15
    assert growth[1] > 1.5
