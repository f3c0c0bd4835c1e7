"""Self-affine ground by spectral synthesis (Saupe 1988; Turcotte 1997): power |k|^-(2 H + 2), so that the deviogram grows as L^H."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rille.terrain.base.lattice import Lattice, Range, Stored
from rille.terrain.base.synthesis import Level, Synthesis, synthesise

Array = NDArray[np.float64]

MOST_DIRECT = 4_000_000  # heights made at once; more are made by levels, as they are asked for


def fractal_lattice(shape: tuple[int, int], posting: float, hurst: float, median_slope: float, seed: int) -> Lattice:
    """Self-affine heights [m] of any size, with mean 0 (of large ones: of the level that repeats last).

    Parameters
    ----------
    shape : rows and columns. posting : [m]. hurst : H, 0 < H < 1. seed : of the random numbers; equal seed and shape, equal ground.
    median_slope : median of |dz| / posting over neighbours along rows and columns, as an angle [rad].
    """
    if shape[0] * shape[1] <= MOST_DIRECT:
        return Stored(fractal(shape, posting, hurst, median_slope, seed))
    raw = _raw(shape, hurst, seed)
    scale = np.tan(median_slope) * posting / _median_step(raw)
    constant = raw.levels[-1].values - _mean(raw)  # weights of a level's coefficients sum to 1
    values = [*(level.values for level in raw.levels[:-1]), constant]
    scaled = [Level(v * scale, level.step) for level, v in zip(raw.levels, values, strict=True)]
    return Synthesis(tuple(scaled), raw.rows, raw.cols)


def fractal(shape: tuple[int, int], posting: float, hurst: float, median_slope: float, seed: int) -> Array:
    """Heights [m], (n_rows, n_cols), made at once; arguments as of :func:`fractal_lattice`. Mean 0; the median slope is met exactly."""
    field = _raw(shape, hurst, seed).outer(np.arange(shape[0]), np.arange(shape[1]))
    steps = np.abs(np.concatenate([np.diff(field, axis=0).ravel(), np.diff(field, axis=1).ravel()]))
    field *= np.tan(median_slope) * posting / np.median(steps)
    return field - field.mean()


def _raw(shape: tuple[int, int], hurst: float, seed: int) -> Synthesis:
    exponent = 2 * hurst + 2
    rows, cols = (0, shape[0]), (0, shape[1])
    return Synthesis(synthesise(lambda f: f**-exponent, 1.0, rows, cols, np.inf, seed, folded=_folding(exponent)), rows, cols)


def _folding(exponent: float) -> Callable[[Array, Array], Array]:
    """Power of waves too short for a lattice, which sampling folds onto longer ones: sum over (m, n) != 0 of |f + (m, n)|^-exponent.

    With it, the heights are samples of ground that is rough at all scales, and the deviogram follows L^H from the first neighbour on.
    The sum runs to 6; what lies beyond is its integral. It is smooth, so that a table of 65 x 65 suffices. f in cycles per value.
    """
    far, size = 6, 65
    axis = np.linspace(0.0, 0.5, size)
    table = np.zeros((size, size))
    for m in range(-far, far + 1):
        for n in range(-far, far + 1):
            if (m, n) != (0, 0):
                table += np.hypot(axis[:, None] + m, axis[None, :] + n) ** -exponent
    table += 2 * np.pi / (exponent - 2) * ((2 * far + 1) / np.sqrt(np.pi)) ** (2 - exponent)

    def folded(fx: Array, fy: Array) -> Array:
        column, row = (np.abs(f) * (2 * (size - 1)) for f in (fx, fy))
        j, i = (np.minimum(v.astype(np.intp), size - 2) for v in (column, row))
        u, v = column - j, row - i
        return (1 - v) * ((1 - u) * table[i, j] + u * table[i, j + 1]) + v * ((1 - u) * table[i + 1, j] + u * table[i + 1, j + 1])

    return folded


def _median_step(ground: Synthesis) -> float:
    """Median height difference between neighbours along rows and columns, of 16 x 16 patches spread over the ground."""
    steps = []
    for i in _spread(ground.rows, 16, 64):
        for j in _spread(ground.cols, 16, 64):
            patch = ground.outer(np.arange(i, min(i + 64, ground.rows[1])), np.arange(j, min(j + 64, ground.cols[1])))
            steps += [np.diff(patch, axis=0).ravel(), np.diff(patch, axis=1).ravel()]
    return float(np.median(np.abs(np.concatenate(steps))))


def _spread(indices: Range, count: int, width: int) -> list[int]:
    """Starts of at most ``count`` runs of ``width`` indices, evenly spread."""
    return sorted({int(v) for v in np.linspace(indices[0], max(indices[1] - width, indices[0]), count)})


def _mean(ground: Synthesis) -> float:
    """Mean of a sparse sample."""
    rows, cols = (np.unique(np.linspace(first, last - 1, 512).astype(np.intp)) for first, last in (ground.rows, ground.cols))
    return float(ground.outer(rows, cols).mean())
