"""Least squares from products: against scipy on random problems, and where nothing can be told."""

import numpy as np
from scipy.optimize import lsq_linear

from rille.diagnosis.inference.bounded_squares import bounded_minimum


def test_agrees_with_scipy_within_bounds():
    rng = np.random.default_rng(1)
    for _ in range(50):
        k = rng.integers(1, 6)
        columns, aim = rng.normal(size=(40, k)) * 10.0 ** rng.uniform(-4, 4, k), rng.normal(size=40)
        size = 1.0 / np.linalg.norm(columns, axis=0)
        lower, upper = -size * rng.uniform(0, 1, k), size * rng.uniform(0, 1, k)
        x, drop = bounded_minimum(columns.T @ columns, columns.T @ aim, lower, upper)
        best = lsq_linear(columns * size, -aim, (lower / size, upper / size), method="bvls", tol=1e-12).x * size
        assert np.all((x >= lower) & (x <= upper))
        expected = aim @ aim - np.sum((columns @ best + aim) ** 2)
        assert np.isclose(drop, expected, rtol=1e-5, atol=1e-6)


def test_directions_without_curvature_stay_where_they_are():
    x, drop = bounded_minimum(np.diag([1.0, 0.0]), np.array([-1.0, 0.0]), np.full(2, -9.0), np.full(2, 9.0))
    assert np.allclose(x, [1.0, 0.0])
    assert np.isclose(drop, 1.0)
    assert bounded_minimum(np.zeros((2, 2)), np.zeros(2), np.full(2, -1.0), np.ones(2))[1] == 0.0


def test_twins_share_what_they_explain():
    """Two equal columns: no division by zero, and the sum is what one alone would get."""
    x, _ = bounded_minimum(np.ones((2, 2)), np.array([-2.0, -2.0]), np.full(2, -9.0), np.full(2, 9.0))
    assert np.isclose(x.sum(), 2.0)
