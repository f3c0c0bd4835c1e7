"""Channels of a recording as the sensor would have given them: read from steps of the solver, between steps, in the sensor's axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

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
        read = _Between(steps, row, at)
        columns = [read.values(c, self.needs[c][0]) for c in self.columns[number]]
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
    return _Between(series[:, :, None], row, at).values(0, quantity)


class _Between:
    """Reads several series (n_rows, n_steps + 1, n_series) at the same instants: places and weights are found once. See ``between``."""

    def __init__(self, series: Array, row: NDArray[np.int64], at: Array) -> None:
        self.flat, self.row, self.at = np.ascontiguousarray(series).reshape(-1), row, at
        self.length, self.stride = series.shape[1:]
        self.last = self.length - 1

    def values(self, number: int, quantity: str) -> Array:
        """Values (m,) of one series."""
        if quantity not in MOTION_QUANTITIES:
            return self._take(self._containing, number)
        if quantity not in SMOOTH or self.last < 3:
            left, after, part = self._linear
            return (1 - part) * self._take(left, number) + part * self._take(after, number)
        first, weights = self._cubic
        values = [weight * self._take(first, number + k * self.stride) for k, weight in enumerate(weights)]
        return values[0] + values[1] + values[2] + values[3]

    def _take(self, places: NDArray[np.int64], number: int) -> Array:
        return self.flat.take(places + number)

    def _places(self, step: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of series 0 at the end of steps (m,), in ``flat``."""
        return (self.row * self.length + step) * self.stride

    @cached_property
    def _containing(self) -> NDArray[np.int64]:
        return self._places(np.clip(np.ceil(self.at - ROUNDED).astype(np.int64), min(1, self.last), self.last))

    @cached_property
    def _left(self) -> NDArray[np.int64]:
        return np.clip(np.floor(self.at).astype(np.int64), 0, max(self.last - 1, 0))

    @cached_property
    def _linear(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """Places before and after, and the share of the latter."""
        return self._places(self._left), self._places(np.minimum(self._left + 1, self.last)), self.at - self._left

    @cached_property
    def _cubic(self) -> tuple[NDArray[np.int64], tuple[Array, Array, Array, Array]]:
        """Place of the first of four steps, and the weights of these (Lagrange)."""
        first = np.clip(self._left - 1, 0, self.last - 3)
        x = self.at - first
        a, b, c = x - 1, x - 2, x - 3
        return self._places(first), (-a * b * c / 6, x * b * c / 2, -x * a * c / 2, x * a * b / 6)
