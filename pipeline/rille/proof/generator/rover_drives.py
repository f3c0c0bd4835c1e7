"""Drives of a rover in implicit steps: PI control of speed, servos that hold a speed, given torques."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import Drive, InputRefused, Scenario
from rille.proof.generator.drive_line import Line

Array = NDArray[np.float64]
SERVO = 1e6  # [N m s/rad] gain of a drive that holds its speed exactly: 5 N m are 5e-6 rad/s
TEETH = 1e-6  # [rad/(N m)] of play whose teeth have no compliance of their own


class SetValues:
    """What each drive is commanded: mean over any interval.

    A command holds until the next; before the first a speed or torque is 0 and a position that of the joint at the start. lines : with
    their delays [s] and gains.
    """

    def __init__(self, drives: Sequence[Drive], lines: Sequence[Line], scenario: Scenario, start: Array) -> None:
        self._delay = [line.delay for line in lines]
        self._series = []
        for drive, line, position in zip(drives, lines, start, strict=True):
            given = sorted((c for c in scenario.commands if c.drive == drive.name), key=lambda command: command.time)
            times = np.array([-1e6, *(c.time for c in given), 1e6])
            values = np.array([position if drive.mode == "position" else 0.0, *(line.gain * c.value for c in given)])
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
    """Efforts of all drives at their joints, (m,) each, under the catalogue's laws of drives.

    speed drive : gain (set - w) + integral_gain Int(set - w) dt, within max_torque; its integral stands still while it saturates, and so
    it does before t = 0. position drive : holds the speed position_gain (set - q), within max_speed. Without a speed_gain a servo of gain
    ``SERVO``.

    motor_lag : x' = (set - x)/T. motor_saturation : efforts end at max_torque (1 - w/w_0).
    supply_sag : the set speed falls to set (1 - sag tau/max_torque), the largest effort to max_torque/(1 + sag). joint_elasticity,
    backlash : the controller sees the motor; the joint feels k d + c d' beyond the play, d = motor angle - q, at the end of the step.

    Raises
    ------
    InputRefused : for play or elasticity at a torque drive, whose rotor a rover of the generator has not.
    """

    def __init__(self, drives: Sequence[Drive], lines: Sequence[Line], start: Array) -> None:
        """start : (m,) positions of the joints."""
        self._most = np.array([d.max_torque for d in drives])
        self._gain = np.array([SERVO if d.speed_gain is None else d.speed_gain for d in drives])
        self._integral_gain = np.array([0.0 if d.speed_gain is None else d.integral_gain for d in drives])
        self._position = np.array([d.mode == "position" for d in drives])
        self._torque = np.array([d.mode == "torque" for d in drives])
        self._position_gain = np.array([d.position_gain for d in drives])
        self._fastest = np.array([np.inf if d.max_speed is None else d.max_speed for d in drives])
        self._lag, self._sag = np.array([line.lag for line in lines]), np.array([line.sag for line in lines])
        self._back = self._most * np.array([line.slope for line in lines])  # [N m s/rad] back-EMF
        self._most = self._most / (1 + self._sag)
        compliance, self._gap = np.array([line.compliance for line in lines]), np.array([line.gap for line in lines])
        self._loose = (compliance > 0) | (self._gap > 0)
        self._back = np.where(self._loose, 0.0, self._back)  # behind a transmission the line is that of the motor, and is not modelled
        self._stiffness = 1 / np.where(compliance > 0, compliance, TEETH)
        self._damping = np.array([line.damping for line in lines])
        self._droop = self._sag / np.array([d.max_torque for d in drives])
        if (self._loose & self._torque).any():
            raise InputRefused(
                "a torque drive of the rover has play or elasticity; the generator knows them at speed and position drives only"
            )
        self._integral = np.zeros(len(drives))
        self._lagged = np.where(self._position, start, 0.0)
        self._twist = np.zeros(len(drives))

    def target(self, value: Array, position: Array, step: float, hold: bool) -> Array:
        """What is aimed at in a step [s]: set speed [rad/s], of a torque drive its torque [N m]. hold : stand still instead."""
        follows = np.where(self._lag > 0, -np.expm1(-step / np.maximum(self._lag, 1e-9)), 1.0)
        self._lagged = self._lagged + follows * (value - self._lagged)
        seen = position + self._twist  # by the controller
        speed = np.where(self._position, self._position_gain * (self._lagged - seen), 0.0 if hold else self._lagged)
        return np.where(self._torque & (not hold), speed, np.clip(speed, -self._fastest, self._fastest))

    def efforts(self, target: Array, speed: Array, step: float, hold: bool) -> tuple[Array, Array]:
        """Efforts [N m], and the chords by which they fall per speed.

        target : as made for the step. speed : [rad/s] at its end.
        """
        gain = self._gain + step * self._integral_gain
        aim = target + self._integral_gain * self._integral / gain
        give = 1 / gain + self._droop * np.abs(target)  # speed that the motor loses per effort
        error = aim - speed
        wanted, chord = error / give, 1 / give
        if self._loose.any():
            slope = step * self._stiffness + self._damping
            pushed, pulled = (self._stiffness * (self._twist - side * 0.5 * self._gap) + slope * error for side in (1, -1))
            bent = np.where(self._gap > 0, np.maximum(pushed, 0.0) + np.minimum(pulled, 0.0), pushed)
            wanted = np.where(self._loose, bent / (1 + slope * give), wanted)
            chord = np.where(self._loose, np.where(bent != 0, slope / (1 + slope * give), 0.0), chord)
        given = self._torque & (not hold)
        back = self._back * speed
        asked = np.where(given, target, wanted)
        effort = np.clip(asked, -self._most - back, self._most - back)
        held = np.where(given, 0.0, self._most / np.maximum(np.abs(error), 1e-12)) + self._back
        return effort, np.where(np.abs(asked + back) > self._most, held, np.where(given, 0.0, chord))

    def advance(self, target: Array, speed: Array, effort: Array, step: float, hold: bool) -> None:
        """Integrals of the speed errors, and motors, after a step [s] that ended with these speeds and efforts."""
        free = np.abs(effort + self._back * speed) < (1 - 1e-9) * self._most
        gain = self._gain + step * self._integral_gain
        led = target + self._integral_gain * self._integral / gain - effort * (1 / gain + self._droop * np.abs(target))
        motor = np.where(self._loose & free, led, speed)
        self._twist = self._twist + np.where(self._loose, step * (motor - speed), 0.0)
        if not hold:
            self._integral = self._integral + np.where(free, step * (target - motor), 0.0)

    def memory(self) -> list[Array]:
        """What steps go on from: (m,) integrals of speed errors, lagged set values, twists of transmissions."""
        return [self._integral, self._lagged, self._twist]

    def remember(self, memory: Sequence[Array]) -> None:
        """Go on from there."""
        self._integral, self._lagged, self._twist = memory
