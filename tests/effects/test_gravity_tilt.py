"""Free fall along the tilted vertical."""

import numpy as np
import pytest

from effect_rigs import free_space, particle, sample
from rille.model import Effect


def test_fall_along_the_tilted_gravity(make_model):
    """g = R_y(pitch) R_x(roll) (0, 0, -g); free fall is exact with RK4."""
    roll, pitch = 0.1, -0.2
    effect = Effect(kind="gravity_tilt", parameters={"roll": roll, "pitch": pitch})
    path = make_model(particle(4.0), free_space(gravity=(0, 0, -1.62)), None, [effect])
    v = sample(path, 1000, *(("part.linear_velocity", "body", k) for k in range(3)), every=1000)[0]
    after_roll = np.array([0, np.sin(roll), -np.cos(roll)]) * 1.62
    expected = [
        np.cos(pitch) * after_roll[0] + np.sin(pitch) * after_roll[2],
        after_roll[1],
        -np.sin(pitch) * after_roll[0] + np.cos(pitch) * after_roll[2],
    ]
    assert v == pytest.approx(expected, rel=1e-9)
