"""Cubic B-splines on a lattice."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cubic_weights(u: Array) -> Array:
    """Weights (4, n) of the coefficients k - 1 .. k + 2 of a cubic B-spline at k + u, 0 <= u < 1; they sum to 1 (de Boor 1978)."""
    v = 1.0 - u
    return np.stack([v**3 / 6, (4 - 3 * u**2 * (1 + v)) / 6, (4 - 3 * v**2 * (1 + u)) / 6, u**3 / 6])


def weighted(parts: list[Array], weights: list[Array]) -> Array:
    """Sum of parts with weights, always in this order, so that all ways to a height give the same bytes."""
    total = parts[0] * weights[0]
    for part, weight in zip(parts[1:], weights[1:], strict=True):
        total += part * weight
    return total
