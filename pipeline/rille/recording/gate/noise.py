"""White noise of a channel, from second differences."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def white_noise(value: Array) -> float:
    """Standard deviation of white noise on a smooth signal (n,): 1.48 median |v[i-1] - 2 v[i] + v[i+1]| / sqrt(6); 0 below three values."""
    value = value[np.isfinite(value)]
    if len(value) < 3:
        return 0.0
    return float(1.4826 * np.median(np.abs(value[2:] - 2 * value[1:-1] + value[:-2])) / np.sqrt(6))
