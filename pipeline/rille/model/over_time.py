"""Means over the time of a run, whose readings may come in unequal steps."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOVING = 1e-4  # [m/s] below this speed of rim and rover a wheel's slip is not counted (the solver reports 0 there)


def shares(time: Array) -> Array:
    """(n,) time [s] that each reading stands for, half way to its neighbours, so that means are over time; of a single one 1."""
    if len(time) == 1:
        return np.ones(1)
    return np.diff(np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]]))


def slipping(speed: Array, rim: Array, sinkage: Array) -> NDArray[np.bool_]:
    """(n,) when a wheel moves in soil, so that its slip ratio counts. speed : (n,) of the rover, rim : of the wheel's rim [m/s].

    sinkage : (n,) [m].
    """
    return (np.maximum(speed, np.abs(rim)) > MOVING) & (sinkage > 0)
