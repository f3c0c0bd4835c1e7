"""Speed falls as v_0 / (1 + c v_0 t / m)."""

import numpy as np
import pytest

from effect_rigs import free_space, particle, sample
from rille.model import Effect


def test_hyperbolic_decay(make_model):
    """First order in h: c v_0 h / m = 1e-3 at the start, less later."""
    path = make_model(
        particle(4.0), free_space(start_velocity=(0.0, 2.0, 0.0)), None, [Effect(kind="quadratic_drag", parameters={"coefficient": 2.0})]
    )
    v = sample(path, 2000, ("part.linear_velocity", "body", 1), every=200)[:, 0]
    t = 0.2 * np.arange(1, 11)
    assert v == pytest.approx(2.0 / (1 + 2.0 * 2.0 * t / 4.0), rel=1e-3)
