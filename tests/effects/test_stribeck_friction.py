"""More friction at rest than in motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from effect_rigs import flywheel, sample, spinning
from rille.model import Effect


def test_braking_follows_the_curve(make_model):
    """Against an adaptive integration of I w' = -(tau_c + e exp(-(w/w_s)^2)); first order in h: 1e-3 of the initial speed."""
    values = {"coulomb_torque": 0.6, "stiction_excess": 1.2, "stribeck_speed": 0.4}
    path = make_model(flywheel(2.0), spinning(1.0), None, [Effect(kind="stribeck_friction", parameters=values)])
    w = sample(path, 2000, ("joint.velocity", "hub"), every=100)[:, 0]
    t = 0.1 * np.arange(1, 21)
    law = lambda _, w: [-(0.6 + 1.2 * np.exp(-((w[0] / 0.4) ** 2))) / 2.0 if w[0] > 0 else 0.0]  # noqa: E731
    reference = solve_ivp(law, (0, 2), [1.0], t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    moving = reference > 0.01
    assert w[moving] == pytest.approx(reference[moving], abs=1e-3)
    assert w[~moving] == pytest.approx(0.0, abs=0.011)
