"""The gain is off."""

import numpy as np
import pytest

from effect_rigs import sensed
from rille.model import Effect


def test_the_reading_is_distorted_as_the_law_says(make_model):
    """The flywheel turns at 2 rad/s, so that the angle is 2 t; the rigid servo's start costs 1e-6."""
    times, values = sensed(make_model, Effect(kind="scale", target="encoder", parameters={"relative_error": -0.2}))
    true = 2.0 * np.arange(101) / 100
    assert times == pytest.approx(np.arange(101) / 100, abs=1e-9)
    assert values == pytest.approx(0.8 * true, abs=1e-5)
