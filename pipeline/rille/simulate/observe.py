"""Channels of a recording as the sensor would have given them: read from steps of the solver, between steps, in the sensor's axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.quaternion import angle_of, into_body, unit
from rille.model.recording import ANGLES, MOTION_QUANTITIES, Channel

Array = NDArray[np.float64]
SolverChannel = tuple[str, str, int]
ROUNDED = 1e-2  # [steps] by which a stamp may be late for the end of a step and still mean it
AXIS = {"x": 0, "y": 1, "z": 2}
TURN = {"w": 0, "x": 1, "y": 2, "z": 3}
SMOOTH = ("joint.position", "part.position", "part.orientation")  # of one more order between steps than velocities


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """Reads channels. ``needs``: what the solver must sample at every step; ``columns``: of each channel, its places in ``needs``."""

    channels: tuple[Channel, ...]
    needs: tuple[SolverChannel, ...]
    columns: tuple[tuple[int, ...], ...]

    def read(self, number: int, steps: Array, row: NDArray[np.int64], at: Array) -> Array:
        """Values of one channel.

        Parameters
        ----------
        number : of the channel. steps : (n_rows, n_steps + 1, n_needs) from the start on. row : (m,). at : (m,) [steps] since the start.

        Returns
        -------
        (m,) [unit]; NaN where the run had ended.
        """
        channel = self.channels[number]
        columns = [between(steps[:, :, c], row, at, self.needs[c][0]) for c in self.columns[number]]
        if channel.quantity == "part.orientation":
            turn = unit(np.stack(columns, axis=-1))
            return angle_of(turn, channel.component) if channel.component in ANGLES else turn[:, TURN[channel.component]]
        if len(columns) == 1:
            return columns[0]
        turn, vector = unit(np.stack(columns[:4], axis=-1)), np.stack(columns[4:], axis=-1)
        return into_body(turn, vector)[:, AXIS[channel.component]]


def observer(channels: Sequence[Channel]) -> Observer:
    """What to read for these channels."""
    needs: dict[SolverChannel, int] = {}

    def place(quantity: str, target: str, component: int) -> int:
        return needs.setdefault((quantity, target, component), len(needs))

    columns: list[tuple[int, ...]] = []
    for channel in channels:
        quantity, target = channel.quantity, channel.target
        turn = [(k, "part.orientation") for k in range(4)]
        if quantity == "part.orientation":
            wanted = turn
        elif not channel.component:
            wanted = [(0, quantity)]
        elif channel.frame == "body" and quantity != "part.position":
            wanted = turn + [(k, quantity) for k in range(3)]
        else:
            wanted = [(AXIS[channel.component], quantity)]
        columns.append(tuple(place(name, target, k) for k, name in wanted))
    return Observer(channels=tuple(channels), needs=tuple(needs), columns=tuple(columns))


def steady(steps: Array, needs: Sequence[SolverChannel]) -> Array:
    """Steps (n_rows, n_steps + 1, n_needs) with quaternions whose sign does not jump: q and -q are one orientation, and a step may change
    them.
    """
    for first, (quantity, target, component) in enumerate(needs):
        if quantity != "part.orientation" or component != 0:
            continue
        four = [first, *(list(needs).index((quantity, target, k)) for k in (1, 2, 3))]
        along = sum(steps[:, 1:, c] * steps[:, :-1, c] for c in four)
        sign = np.cumprod(np.where(along < 0, -1.0, 1.0), axis=1)
        for c in four:
            steps[:, 1:, c] *= sign
    return steps


def between(series: Array, row: NDArray[np.int64], at: Array, quantity: str) -> Array:
    """Values (m,) of ``series`` (n_rows, n_steps + 1) at ``at`` [steps], (m,) >= 0.

    Positions by the cubic through four steps (error of fourth order in the step), velocities linearly (second order); efforts, loads and
    accelerations are means over a step: that of the step which contains the instant.
    """
    last = series.shape[1] - 1
    if quantity not in MOTION_QUANTITIES:
        return series[row, np.clip(np.ceil(at - ROUNDED).astype(np.int64), min(1, last), last)]
    left = np.clip(np.floor(at).astype(np.int64), 0, max(last - 1, 0))
    part = at - left
    if quantity not in SMOOTH or last < 3:
        return (1 - part) * series[row, left] + part * series[row, np.minimum(left + 1, last)]
    first = np.clip(left - 1, 0, last - 3)
    x = at - first
    values = [series[row, first + k] for k in range(4)]
    return (
        -(x - 1) * (x - 2) * (x - 3) / 6 * values[0]
        + x * (x - 2) * (x - 3) / 2 * values[1]
        - x * (x - 1) * (x - 3) / 2 * values[2]
        + x * (x - 1) * (x - 2) / 6 * values[3]
    )
