"""Drives of a rover in implicit steps: PI control of speed, servos that hold a speed, given torques."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import Drive, Scenario

Array = NDArray[np.float64]
SERVO = 1e6  # [N m s/rad] gain of a drive that holds its speed exactly: 5 N m are 5e-6 rad/s


class SetValues:
    """What each drive is commanded: mean over any interval.

    A command holds until the next; before the first a speed or torque is 0 and a position that of the joint at the start. delay : (m,) [s] of
    each drive's commands.
    """

    def __init__(self, drives: Sequence[Drive], scenario: Scenario, start: Array, delay: Array) -> None:
        self._delay = delay
        self._series = []
        for drive, position in zip(drives, start, strict=True):
            given = sorted((c for c in scenario.commands if c.drive == drive.name), key=lambda command: command.time)
            times = np.array([-1e6, *(c.time for c in given), 1e6])
            values = np.array([position if drive.mode == "position" else 0.0, *(c.value for c in given)])
            self._series.append((times, np.concatenate([[0.0], np.cumsum(values * np.diff(times))]), values))

    def mean(self, begin: float, end: float) -> Array:
        """Means (m,) of the set values from ``begin`` to ``end`` [s]."""
        means = np.empty(len(self._series))
        for k, (times, total, values) in enumerate(self._series):
            first, last = begin - self._delay[k], end - self._delay[k]
            i, j = int(np.searchsorted(times, first + 1e-9)) - 1, int(np.searchsorted(times, last - 1e-9)) - 1
            if i >= j:
                means[k] = values[i]
                continue
            upto = [total[n] + values[n] * (at - times[n]) for n, at in ((i, first), (j, last))]
            means[k] = (upto[1] - upto[0]) / (last - first)
        return means


class Drives:
    """Efforts of all drives, (m,) each.

    speed drive : gain (set - w) + integral_gain Int(set - w) dt, within max_torque; its integral stands still while it saturates, and so it does
    before t = 0. position drive : holds the speed position_gain (set - q), within max_speed. Without a speed_gain a servo of gain ``SERVO``.
    """

    def __init__(self, drives: Sequence[Drive]) -> None:
        self.count = len(drives)
        self.most = np.array([d.max_torque for d in drives])
        self._gain = np.array([SERVO if d.speed_gain is None else d.speed_gain for d in drives])
        self._integral_gain = np.array([0.0 if d.speed_gain is None else d.integral_gain for d in drives])
        self._position = np.array([d.mode == "position" for d in drives])
        self._torque = np.array([d.mode == "torque" for d in drives])
        self._position_gain = np.array([d.position_gain for d in drives])
        self._fastest = np.array([np.inf if d.max_speed is None else d.max_speed for d in drives])
        self._integral = np.zeros(len(drives))

    def target(self, value: Array, position: Array, hold: bool) -> Array:
        """What is aimed at in a step: set speed [rad/s], of a torque drive its torque [N m]. hold : stand still instead."""
        speed = np.where(self._position, self._position_gain * (value - position), 0.0 if hold else value)
        return np.where(self._torque & (not hold), speed, np.clip(speed, -self._fastest, self._fastest))

    def efforts(self, target: Array, speed: Array, step: float, hold: bool) -> tuple[Array, Array]:
        """Efforts [N m] at speeds [rad/s] at the end of a step [s], and the chords by which they fall per speed."""
        gain = self._gain + step * self._integral_gain
        error = target - speed
        wanted = gain * error + self._integral_gain * self._integral
        given = self._torque & (not hold)
        effort = np.clip(np.where(given, target, wanted), -self.most, self.most)
        free = np.abs(wanted) <= self.most
        chord = np.where(free, gain, self.most / np.maximum(np.abs(error), 1e-12))
        return effort, np.where(given, 0.0, chord)

    def advance(self, target: Array, speed: Array, effort: Array, step: float) -> None:
        """Integrals of the speed errors after a step [s]."""
        self._integral = self._integral + np.where(np.abs(effort) < self.most, step * (target - speed), 0.0)
