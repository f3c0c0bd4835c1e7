"""A constant is added."""

import numpy as np
import pytest

from effect_rigs import sensed
from rille.model import Effect


def test_the_reading_is_distorted_as_the_law_says(make_model):
    """The flywheel turns at 2 rad/s, so that the angle is 2 t; the rigid servo's start costs 1e-6."""
    times, values = sensed(make_model, Effect(kind="bias", target="encoder", parameters={"offset": 0.3}))
    true = 2.0 * np.arange(101) / 100
    assert times == pytest.approx(np.arange(101) / 100, abs=1e-9)
    assert values == pytest.approx(true + 0.3, abs=1e-5)
