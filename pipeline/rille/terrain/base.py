"""Synthetic ground before landforms: flat, plane, fractal. Heights (n_rows, n_cols) [m], row 0 north."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def plane(x: Array, y: Array, slope: float, direction: float) -> Array:
    """Plane that rises by ``slope`` [rad] towards ``direction`` [rad, from x towards y]; x (n_cols,), y (n_rows,)."""
    gradient = np.tan(slope)
    return gradient * (np.cos(direction) * x[None, :] + np.sin(direction) * y[:, None])


def fractal(shape: tuple[int, int], posting: float, hurst: float, median_slope: float, seed: int) -> Array:
    """Self-affine ground by spectral synthesis (Saupe 1988; Turcotte 1997).

    White noise filtered by |k|^-(H + 1), so that the deviogram grows as L^H; scaled so that the median slope between
    neighbouring values is ``median_slope`` [rad]. The field is made on twice the area, whose periodic copies are cut off, since
    opposite borders of a spectral field fit together.

    Parameters
    ----------
    shape : rows and columns. posting : [m]. hurst : H, 0 < H < 1. seed : of the random numbers; equal seed, equal ground.
    """
    rows, columns = 2 * shape[0], 2 * shape[1]
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((rows, columns)))
    k = np.hypot(np.fft.fftfreq(rows, posting)[:, None], np.fft.rfftfreq(columns, posting)[None, :])
    k[0, 0] = np.inf
    field = np.fft.irfft2(noise * k ** -(hurst + 1.0), (rows, columns))[: shape[0], : shape[1]]
    slopes = np.abs(np.concatenate([np.diff(field, axis=0).ravel(), np.diff(field, axis=1).ravel()])) / posting
    field *= np.tan(median_slope) / np.median(slopes)
    return field - field.mean()
