"""Stresses ripple N times a turn, and the wheel rides on them."""

import numpy as np

from effect_rigs import assert_same_point, rig_model, sample, wheel_point
from rille.model import Effect

EFFECT = Effect(kind="grouser_ripple", parameters={"relative_amplitude": 0.2, "phase": 0.4})


def test_ripple_has_the_period_and_the_size_of_the_law(make_model):
    """The load is given, so that the sinkage ripples: N(z) (1 + a sin psi) = W, slowly enough to be quasi-static.

    Grousers pass at 24 x 0.476 / 2 pi = 1.82 Hz, against which the damped soil (40 ms) lags by 0.46 rad and shrinks the ripple by 10 %.
    """
    path = rig_model(make_model, EFFECT, slip=0.3, duration=8.0)
    z, angle = sample(path, 8000, ("wheel.sinkage", "wheel"), ("joint.position", "axle"), every=5).T
    z, angle = z[800:], angle[800:]
    psi = 24 * angle
    basis = np.column_stack([np.ones_like(psi), np.sin(psi), np.cos(psi), np.sin(2 * psi), np.cos(2 * psi)])
    fit, *_ = np.linalg.lstsq(basis, z, rcond=None)
    amplitude = np.hypot(fit[1], fit[2])
    # d ln N / d ln z = n + 1/2, so that dz/z = a / 1.5 to first order in a = 0.2
    expected = wheel_point(slip=0.3)["sinkage"] * 0.2 / 1.5
    assert 0.8 * expected < amplitude < 1.02 * expected
    assert np.std(z - basis @ fit) < 0.05 * amplitude  # nothing but the law's period and its first harmonic
    assert np.hypot(fit[3], fit[4]) < 0.2 * amplitude


def test_the_mean_over_a_turn_is_the_base_model():
    assert_same_point(wheel_point(EFFECT), wheel_point(), rel=1e-12)
