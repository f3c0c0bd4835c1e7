"""Speed decays as exp(-c t / m)."""

import numpy as np
import pytest

from effect_rigs import free_space, particle, sample
from rille.model import Effect


def test_exponential_decay_in_any_direction(make_model):
    """Implicit: (1 + h c/m)^-n, which is within (c/m)^2 h t/2 = 1.3e-4 of exp(-c t/m)."""
    path = make_model(
        particle(4.0), free_space(start_velocity=(1.0, -2.0, 0.5)), None, [Effect(kind="linear_drag", parameters={"coefficient": 2.0})]
    )
    v = sample(path, 1000, *(("part.linear_velocity", "body", k) for k in range(3)), every=1000)[0]
    assert v == pytest.approx(np.array([1.0, -2.0, 0.5]) * np.exp(-0.5), rel=2e-4)
