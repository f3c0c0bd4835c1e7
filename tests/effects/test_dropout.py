"""Samples are missing, the same ones for the same seed."""

import numpy as np
import pytest

from effect_rigs import sensed
from rille.model import Effect


def test_a_share_is_lost_and_the_rest_is_untouched(make_model):
    """500 samples at probability 0.3: 150 +- 10 (1 sigma) are lost; 4 sigma are allowed. The seed makes it repeatable."""
    kept = []
    for seed in (1, 1, 2):
        effect = Effect(kind="dropout", target="encoder", parameters={"fraction": 0.3, "seed": seed})
        times, values = sensed(make_model, effect, duration=5.0)
        assert 501 - 190 < len(times) < 501 - 110
        assert values == pytest.approx(2.0 * times, abs=1e-5)
        kept.append(np.round(100 * times).astype(int).tolist())
    assert kept[0] == kept[1]
    assert kept[0] != kept[2]
