"""A change of the exit ratio is a soil with that exit ratio."""

from dataclasses import replace

import pytest

from effect_rigs import LUNAR_SOIL, assert_same_point, wheel_point
from rille.model import Effect


@pytest.mark.parametrize("change", [0.2, 0.9])
def test_equals_a_soil_with_that_exit_ratio(change):
    soil = replace(LUNAR_SOIL, exit_sinkage_ratio=change)
    assert_same_point(wheel_point(Effect(kind="exit_angle", parameters={"ratio_change": change})), wheel_point(soil=soil))


def test_it_never_leaves_the_wheel():
    """A change that would make the ratio negative ends at 0, the base model here."""
    assert_same_point(wheel_point(Effect(kind="exit_angle", parameters={"ratio_change": -1.0})), wheel_point())
