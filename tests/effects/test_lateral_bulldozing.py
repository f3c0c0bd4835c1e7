"""The side of a drifting wheel pushes a wedge of soil (Hegedus)."""

import numpy as np
import pytest
from scipy.integrate import quad

from effect_rigs import EARTH, LUNAR_SOIL, wheel_point
from rille.model import Effect

EFFECT = Effect(kind="lateral_bulldozing", parameters={"efficiency": 1.0})


def test_side_force_grows_by_the_wedge_along_the_contact():
    """Adaptive quadrature of R_b over the contact; the solver's 4 points reach 1e-6 of this smooth integrand."""
    base, pushed = (wheel_point(e, angle=np.radians(10), slip=0.2, load=100.0) for e in (None, EFFECT))
    phi, c, gamma = LUNAR_SOIL.friction_angle, LUNAR_SOIL.cohesion, LUNAR_SOIL.density * EARTH
    x = np.pi / 4 - phi / 2
    d1, d2 = 1 / np.tan(x) + np.tan(x + phi), 1 / np.tan(x) + np.tan(phi) / np.tan(x) ** 2
    r, entry = 0.15, np.arccos(1 - base["sinkage"] / 0.15)
    depth = lambda t: r * (np.cos(t) - np.cos(entry))  # noqa: E731
    wedge, _ = quad(lambda t: d1 * (c * depth(t) + d2 * gamma * depth(t) ** 2 / 2) * r * np.cos(t), 0, entry, epsabs=1e-13)
    drift = 0.5 * r * entry * np.tan(np.radians(10)) * (1 - 0.2)
    expected = wedge * (1 - np.exp(-drift / LUNAR_SOIL.lateral_shear_modulus))
    assert pushed["side_force"] - base["side_force"] == pytest.approx(expected, rel=1e-5)


def test_the_coefficients_are_those_of_the_literature():
    """Ishigami prints D1 = 4.03 and D2/2 = 2.55 for phi = 37.2 deg."""
    phi = np.radians(37.2)
    x = np.pi / 4 - phi / 2
    assert 1 / np.tan(x) + np.tan(x + phi) == pytest.approx(4.03, abs=0.01)
    assert (1 / np.tan(x) + np.tan(phi) / np.tan(x) ** 2) / 2 == pytest.approx(2.55, abs=0.01)


def test_a_wheel_that_does_not_drift_feels_nothing():
    assert wheel_point(EFFECT) == wheel_point()
