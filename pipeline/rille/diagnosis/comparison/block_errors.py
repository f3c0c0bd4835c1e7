"""Standard errors and intervals that stay honest when neighbouring residuals are alike: by blocks of time."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
DRAWS = 2000
LEAST = 6  # blocks below which no error is stated


def block_sums(values: Array, block: Whole) -> Array:
    """(B,) sums of (n,) values over the blocks that occur."""
    return np.bincount(block, weights=values)[np.bincount(block) > 0].astype(np.float64)


def mean_and_error(values: Array, block: Whole) -> tuple[float, float, float]:
    """Mean of (n,) values, its standard error and the two-sided p of its being 0 (Student's t over blocks); NaN below ``LEAST`` blocks."""
    if not len(values):
        return np.nan, np.nan, np.nan
    mean = float(np.mean(values))
    deviations = block_sums(values - mean, block)
    n = len(deviations)
    if n < LEAST:
        return mean, np.nan, np.nan
    error = float(np.sqrt(n / (n - 1) * np.sum(deviations**2)) / len(values))
    p = float(2 * t_distribution.sf(abs(mean) / error, n - 1)) if error > 0 else float(mean == 0)
    return mean, error, p


def ratio_interval(above: Array, below: Array, block: Whole) -> tuple[float, float]:
    """95 % interval of sum(above) / sum(below) by bootstrap of blocks, seeded; NaN below ``LEAST`` blocks."""
    a, b = block_sums(above, block), block_sums(below, block)
    if len(a) < LEAST:
        return np.nan, np.nan
    drawn = np.random.default_rng(6).multinomial(len(a), np.full(len(a), 1 / len(a)), size=DRAWS)
    bottom = drawn @ b
    ratios = (drawn @ a)[bottom > 0] / bottom[bottom > 0]
    low, high = np.percentile(ratios, [2.5, 97.5]) if len(ratios) else (np.nan, np.nan)
    return float(low), float(high)


def regression(design: Array, values: Array, block: Whole) -> tuple[Array, Array]:
    """Least squares of (n,) values on (n, k) columns: coefficients (k,) and their covariance (k, k), robust to correlation within blocks.

    The sandwich (X'X)^-1 (sum over blocks of X_b' e_b e_b' X_b) (X'X)^-1 B / (B - 1), MacKinnon, White 1985; scaled up where few blocks
    happen to give a smaller variance than uncorrelated residuals would (s^2 (X'X)^-1). NaN below ``LEAST`` blocks.
    """
    size = np.sqrt(np.sum(design**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    scaled = design / size
    inverse = np.linalg.pinv(scaled.T @ scaled) / np.outer(size, size)
    coefficients = inverse @ (design.T @ values)
    rest = values - design @ coefficients
    scores = np.stack([block_sums(column * rest, block) for column in design.T], axis=1)
    n = len(scores)
    if n < LEAST:
        return coefficients, np.full((design.shape[1],) * 2, np.nan)
    covariance = inverse @ (scores.T @ scores) @ inverse * n / (n - 1)
    plain = np.diagonal(inverse) * float(rest @ rest) / max(len(values) - design.shape[1], 1)
    variance = np.diagonal(covariance)
    return coefficients, covariance * max(1.0, float(np.max(np.divide(plain, variance, out=np.ones_like(plain), where=variance > 0))))


def wald(coefficients: Array, covariance: Array, n_blocks: int) -> float:
    """p of all coefficients being 0: Hotelling's T^2 as F with (k, n_blocks - k) degrees of freedom; NaN if it cannot be told."""
    k = len(coefficients)
    if n_blocks < max(LEAST, k + 2) or not np.isfinite(covariance).all() or np.linalg.matrix_rank(covariance) < k:
        return np.nan
    squared = float(coefficients @ np.linalg.solve(covariance, coefficients))
    return float(f_distribution.sf(squared * (n_blocks - k) / (k * (n_blocks - 1)), k, n_blocks - k))


def adjusted(p: Array) -> Array:
    """(n,) q of Benjamini and Hochberg (1995): the false discovery rate at which each p would just be called; NaN stays NaN."""
    q = np.full(len(p), np.nan)
    known = np.flatnonzero(np.isfinite(p))
    if not len(known):
        return q
    order = known[np.argsort(p[known], kind="stable")]
    scaled = p[order] * len(order) / np.arange(1, len(order) + 1)
    q[order] = np.minimum(np.minimum.accumulate(scaled[::-1])[::-1], 1.0)
    return q
