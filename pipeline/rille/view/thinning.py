"""Fewer points that look the same: for plots of long series."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def thinned(most: int, *series: ArrayLike) -> NDArray[np.int64]:
    """Indices, ascending, of about ``most`` points that keep the extremes of every series (n,): lowest and highest of each stretch.

    NaN is passed over; all indices if there are no more than ``most``.
    """
    arrays = [np.asarray(values, float) for values in series]
    n = len(arrays[0])
    if n <= most:
        return np.arange(n)
    stretches = max(1, most // (2 * len(arrays)))
    size = -(-n // stretches)
    kept = [np.array([0, n - 1])]
    for values in arrays:
        padded = np.full(stretches * size, np.nan)
        padded[:n] = values
        rows = padded.reshape(stretches, size)
        missing = np.isnan(rows)
        known = ~missing.all(axis=1)
        first = size * np.flatnonzero(known)
        kept.append(first + np.where(missing, np.inf, rows)[known].argmin(axis=1))
        kept.append(first + np.where(missing, -np.inf, rows)[known].argmax(axis=1))
    return np.unique(np.concatenate(kept))
