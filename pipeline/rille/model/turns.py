"""Angles that count full turns, from those that an encoder wraps."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SHARE = 0.9  # of the jumps by more than half a turn, that must be full turns


def unwrapped(value: Array) -> Array:
    """Angles (n,) [rad] without the jumps of a full turn; values that jump by anything else are no wrapped radians and stay."""
    good = np.isfinite(value)
    jumps = np.abs(np.diff(value[good]))
    jumps = jumps[jumps > np.pi]
    if not len(jumps) or float(np.mean((jumps > 1.5 * np.pi) & (jumps < 2.01 * np.pi))) < SHARE:
        return value
    out = value.copy()
    out[good] = np.unwrap(value[good])
    return out


def counted_on(value: Array, period: float) -> Array:
    """Angles (n,) [rad] of an encoder that begins anew every ``period`` [rad], counted on; half of it or more within a sample is a jump.

    What is missing stays so, and nothing is known of turns meanwhile.
    """
    good = np.isfinite(value)
    out = value.copy()
    turns = np.round((np.unwrap(value[good], period=period) - value[good]) / period)
    out[good] += period * turns
    return out
