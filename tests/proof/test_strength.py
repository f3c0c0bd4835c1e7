"""The size of what is concealed is found from the strength that is wanted."""

import math

import pytest

from rille.proof.strength import ACCEPTED, NEAR, Unreachable, find_size


@pytest.mark.parametrize("power", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_strength_that_grows_with_a_power_is_met(power, scale):
    """Excess = (size / scale)^power, hidden below 0.05: the answer is within the stated 10 % of the strength, or 35 % after nine tries."""
    size, found, channel = find_size(lambda s: (max(0.0, (s / scale) ** power - 0.05), "c"), 2.0, 0.3, 1e6)
    assert abs(math.log(found / 2.0)) < ACCEPTED
    assert found == (size / scale) ** power - 0.05
    assert channel == "c"
    if power <= 1.0 and scale == 1.0:
        assert abs(math.log(found / 2.0)) < NEAR


def test_a_threshold_is_climbed():
    """Nothing is seen until 0.7, then the excess is 10 (size - 0.7): between them the size is found by halving."""
    size, found, _ = find_size(lambda s: (max(0.0, 10 * (s - 0.7)), ""), 2.0, 0.3, 50.0)
    assert abs(math.log(found / 2.0)) < ACCEPTED
    assert 0.7 < size < 1.0


def test_what_no_size_makes_so_strong_is_refused():
    with pytest.raises(Unreachable, match="wanted 2"):
        find_size(lambda s: (0.1 * s, ""), 2.0, 0.3, 5.0)


def test_what_is_there_or_not_must_be_strong_enough():
    assert find_size(lambda s: (40.0, "x"), 5.0, 1.0, 1.0, 1.0) == (1.0, 40.0, "x")
    with pytest.raises(Unreachable):
        find_size(lambda s: (0.5, "x"), 5.0, 1.0, 1.0, 1.0)


def test_a_run_that_physics_ends_is_too_large():
    size, found, _ = find_size(lambda s: (math.inf, "") if s > 1.0 else (2.5 * s, ""), 2.0, 3.0, 100.0)
    assert abs(math.log(found / 2.0)) < ACCEPTED
    assert size <= 1.0
