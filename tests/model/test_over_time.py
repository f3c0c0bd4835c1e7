"""Are means over time, and is slip counted where there is some?"""

import numpy as np
import pytest

from rille.model.over_time import MOVING, shares, slipping


def test_means_are_over_time_not_over_readings():
    """The trapezoidal rule is exact for what is linear, however uneven the readings: the mean of 3 t over 0 to 4 s is 6."""
    time = np.array([0.0, 0.1, 0.2, 0.3, 1.0, 2.5, 4.0])
    assert np.average(3 * time, weights=shares(time)) == pytest.approx(6.0, rel=1e-12)
    assert shares(time).sum() == pytest.approx(4.0, rel=1e-12)
    assert shares(np.array([7.0])) == 1
    assert len(shares(np.empty(0))) == 0


def test_slip_counts_where_rim_or_rover_move_in_soil():
    speed = np.array([0.0, 2 * MOVING, 0.0, 2 * MOVING])
    rim = np.array([-2 * MOVING, 0.0, 0.0, 2 * MOVING])
    assert slipping(speed, rim, np.array([0.01, 0.01, 0.01, 0.0])).tolist() == [True, True, False, False]
