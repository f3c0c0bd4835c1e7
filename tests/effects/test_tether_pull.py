"""A cable: nothing while slack, then half a swing of the spring, then slack again."""

import numpy as np
import pytest

from effect_rigs import free_space, particle, sample
from rille.model import Effect


def test_flight_to_the_end_of_the_cable_and_back(make_model):
    """2 m/s from 0.2 m before the end; taut from 0.1 s for pi sqrt(m/k) = 0.314 s; comes back with -2 m/s.

    The implicit spring loses w^2 h / 2 x 0.314 s = 0.8 % of the speed at h = 0.5 ms with w = 10 rad/s.
    """
    values = {"stiffness": 400.0, "length": 1.2, "anchor_x": -1.0}
    scenario = free_space(step=5e-4, start_velocity=(2.0, 0.0, 0.0))
    path = make_model(particle(4.0), scenario, None, [Effect(kind="tether_pull", parameters=values)])
    v = sample(path, 1200, ("part.linear_velocity", "body", 0))[:, 0]
    t = 5e-4 * np.arange(1, 1201)
    assert v[t < 0.0985] == pytest.approx(2.0, rel=1e-12)
    assert v[t > 0.43] == pytest.approx(-2.0, rel=0.02)
    taut = (t > 0.102) & (t < 0.41)
    assert v[taut] == pytest.approx(2.0 * np.cos(10 * (t[taut] - 0.1)), abs=0.03)
