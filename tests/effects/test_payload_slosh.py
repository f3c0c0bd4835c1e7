"""A sloshing mass and its body are two masses on a spring."""

import numpy as np
import pytest
from scipy.linalg import expm

from effect_rigs import free_space, particle, sample
from rille.model import Effect


def test_two_masses_after_a_kick(make_model):
    """Against the exact solution of the linear system; first order in h: w h / 2 = 3e-4 of the velocity, damped; 2e-3 is asked for."""
    slosh = Effect(kind="payload_slosh", parameters={"mass": 1.0, "natural_frequency": 6.0, "damping_ratio": 0.1})
    kick = Effect(kind="external_pulse", parameters={"force_x": 300.0, "start": 0.0, "duration": 1e-3})
    path = make_model(particle(4.0), free_space(step=1e-4), None, [slosh, kick])
    v = sample(path, 20000, ("part.linear_velocity", "body", 0), every=500)[:, 0]
    t = 0.05 * np.arange(1, 41)
    m, s, k, c = 3.0, 1.0, 36.0, 1.2
    system = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-k / m, k / m, -c / m, c / m], [k / s, -k / s, c / s, -c / s]])
    exact = np.array([(expm(system * (ti - 5e-4)) @ [0, 0, 0.3 / 3.0, 0])[2] for ti in t])
    assert v == pytest.approx(exact, abs=2e-3 * 0.1)
    assert v[-1] == pytest.approx(0.3 / 4.0, abs=0.01)  # momentum of both


def test_at_rest_the_whole_mass_weighs(make_model):
    """Falling freely, body and payload fall together."""
    slosh = Effect(kind="payload_slosh", parameters={"mass": 1.0})
    v = sample(
        make_model(particle(4.0), free_space(gravity=(0, 0, -2.0)), None, [slosh]), 1000, ("part.linear_velocity", "body", 2), every=1000
    )
    # The spring was stretched by the weight before the fall, and swings out: mean momentum is what counts.
    assert -2.6 < v[0, 0] < -1.4
