"""What is read of a rover: states at any instants, and what a step makes (forces, efforts, accelerations) as means of the step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rille.model.recording import ANGLES, AXES, MOTION_QUANTITIES
from rille.proof.generator.reading import Reading

Array = NDArray[np.float64]
QUATERNION = ("w", "x", "y", "z")


@dataclass(slots=True, kw_only=True)
class Trace:
    """A quantity of a target over a run. states : (n + 1, k) at the ends of steps; made : (n, k) by the steps."""

    states: list[Array]
    made: list[Array]


def read(reading: Reading, instants: Array, trace: Trace, orientation: Trace | None) -> Array:
    """Values (n,) of a reading.

    Between steps states are interpolated linearly, quaternions too and then normalised; what a step makes is that of the step that
    contains the instant. instants : (n + 1,) [s] ends of the steps. orientation : of the body, for vectors along its axes.
    """
    times = np.clip(reading.times, instants[0], instants[-1])
    if reading.quantity == "part.orientation":
        return _orientation(reading.component, times, instants, trace)
    if reading.quantity in MOTION_QUANTITIES:
        table = np.array(trace.states)
        values = np.column_stack([np.interp(times, instants, column) for column in table.T])
    else:
        table = np.array(trace.made)
        values = table[np.clip(np.searchsorted(instants, times - 1e-9) - 1, 0, len(table) - 1)]
    if not reading.component:
        return values[:, 0]
    if reading.frame == "body":
        assert orientation is not None
        values = _rotation(times, instants, orientation).apply(values, inverse=True)
    return values[:, AXES.index(reading.component)]


def _rotation(times: Array, instants: Array, trace: Trace) -> Rotation:
    table = np.array(trace.states)
    table[1:] *= np.cumprod(np.where(np.sum(table[1:] * table[:-1], axis=1) < 0, -1.0, 1.0))[:, None]  # q and -q are one orientation
    mixed = np.column_stack([np.interp(times, instants, column) for column in table.T])
    return Rotation.from_quat(mixed[:, [1, 2, 3, 0]])


def _orientation(component: str, times: Array, instants: Array, trace: Trace) -> Array:
    turned = _rotation(times, instants, trace)
    if component in ANGLES:
        return turned.as_euler("ZYX")[:, 2 - ANGLES.index(component)]
    return turned.as_quat(canonical=False)[:, [3, 0, 1, 2]][:, QUATERNION.index(component)]
