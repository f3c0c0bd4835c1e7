"""A drive between its command and its joint: gain, delay, lag, supply, torque-speed line, servo, transmission."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import Drive, Effect, Scenario
from rille.proof.generator.law import Law
from rille.proof.generator.moment import Moment

Array = NDArray[np.float64]
HELD = 1e6  # [1/s] gain per inertia of a servo that holds its speed exactly: an effort that gives 100 rad/s^2 yields 1e-4 rad/s


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """What effects make of a drive. gain [-], delay, lag [s], slope [s/rad]: 1 / no-load speed, sag [-], gap [rad], compliance [rad/(N m)],
    damping [N m s/rad], rotor [kg m^2].
    """

    gain: float = 1.0
    delay: float = 0.0
    lag: float = 0.0
    slope: float = 0.0
    sag: float = 0.0
    gap: float = 0.0
    compliance: float = 0.0
    damping: float = 0.0
    rotor: float = 0.0


AMPLITUDES = {"backlash": "gap", "joint_elasticity": "compliance"}  # without it there is no transmission
LINE_KINDS = ("command_gain", "command_delay", "motor_lag", "motor_saturation", "supply_sag", "backlash", "joint_elasticity")


def line_of(joint: str, effects: Sequence[Effect]) -> Line:
    """All effects on the drive of a joint together."""
    found: dict[str, float] = {"gain": 1.0}

    def add(name: str, value: float) -> None:
        found[name] = found.get(name, 0.0) + value

    for effect in effects:
        if effect.kind not in LINE_KINDS or effect.target not in ("*", joint):
            continue
        n: dict = dict(effect.parameters)
        if effect.kind in AMPLITUDES and not n[AMPLITUDES[effect.kind]]:
            continue
        match effect.kind:
            case "command_gain":
                found["gain"] *= 1.0 + n["relative_error"]
            case "command_delay":
                add("delay", n["delay"])
            case "motor_lag":
                add("lag", n["time_constant"])
            case "motor_saturation":
                add("slope", n["inverse_no_load_speed"])
            case "supply_sag":
                add("sag", n["sag"])
            case "backlash" | "joint_elasticity":
                add("gap", n.get("gap", 0.0))
                add("compliance", n["compliance"] if "compliance" in n else 1.0 / n["stiffness"])
                add("damping", n["damping"])
                add("rotor", n["rotor_inertia"])
    return Line(**found)


def within(value: float, lower: float, upper: float) -> float:
    """The value, or the bound that it passes."""
    return min(max(value, lower), upper)


class DriveLine(Law):
    """A drive as a law of its joint.

    States : the lagged set value, where there is a lag; the motor's angle and, of a torque drive, its speed, where there is a transmission;
    the integral of the speed error, where there is an integral_gain.

    Servos: effort = speed_gain (w_set - w), w_set = set speed (1 - sag effort/max_torque). Torque drives: the set value over 1 + sag
    |value|/max_torque. Both end at max_torque/(1 + sag), less max_torque w/w_0 for the back-EMF. w : speed of the motor.
    """

    def __init__(self, drive: Drive, line: Line, scenario: Scenario, inertia: float) -> None:
        """inertia : that the joint feels at its drive [kg m^2], for servos that hold their speed exactly."""
        super().__init__(drive.joint, {})
        self.drive, self.line = drive, line
        own = sorted(
            ((c.time + line.delay, line.gain * c.value) for c in scenario.commands if c.drive == drive.name), key=lambda one: one[0]
        )
        self._times, self._values = [t for t, _ in own], [v for _, v in own]
        self._gain = drive.speed_gain if drive.speed_gain is not None else HELD * inertia
        self._most = drive.max_torque / (1.0 + line.sag)
        self._falls = drive.max_torque * line.slope  # [N m s/rad] the largest effort, with speed
        self._sprung = line.compliance > 0 or line.gap > 0
        self._torque = drive.mode == "torque"
        self.states = (1 if line.lag > 0 else 0) + (0 if not self._sprung else 2 if self._torque else 1) + (1 if drive.integral_gain else 0)

    def switches(self) -> tuple[float, ...]:
        return tuple(self._times)

    def start(self, moment: Moment) -> Array:
        state = np.zeros(self.states)
        position = moment.position(self.target)
        self._first = position
        if self.line.lag > 0 and self.drive.mode == "position":
            state[0] = position
        if self._sprung:
            place = 1 if self.line.lag > 0 else 0
            state[place] = position
            if self._torque:
                state[place + 1] = moment.speed(self.target)  # it turns with its joint
        return state

    def set_value(self, time: float) -> float:
        """What is commanded [N m, rad/s or rad] at a time within an interval of commands."""
        k = bisect_right(self._times, time) - 1
        return self._values[k] if k >= 0 else (self._first if self.drive.mode == "position" else 0.0)

    def _set_speed(self, value: float, position: float) -> float:
        speed = value if self.drive.mode == "speed" else self.drive.position_gain * (value - position)
        most = self.drive.max_speed
        return speed if most is None else within(speed, -most, most)

    def act(self, moment: Moment, state: Array) -> Array:
        rates = np.zeros(self.states)
        value, place = self.set_value(moment.time), 0
        if self.line.lag > 0:
            rates[0] = (value - state[0]) / self.line.lag
            value, place = float(state[0]), 1
        position, speed = moment.position(self.target), moment.speed(self.target)
        if self._sprung:
            effort = self._through_transmission(value, position, speed, state[place:], rates[place:])
        else:
            back = self._falls * speed
            asked = self._sagging(value) if self._torque else self._servo(self._set_speed(value, position), speed, back, state, rates)
            effort = within(asked, -self._most - back, self._most - back)
        moment.add_effort(self.target, effort)
        moment.drive_effort[self.target] = effort
        return rates

    def _servo(self, wanted: float, speed: float, back: float, state: Array, rates: Array) -> float:
        droop = self.line.sag * abs(wanted) / self.drive.max_torque
        effort = self._gain * (wanted - speed)
        if self.drive.integral_gain:
            effort += self.drive.integral_gain * state[-1]
        effort /= 1.0 + self._gain * droop
        if self.drive.integral_gain and abs(effort + back) < self._most:
            rates[-1] = wanted - speed
        return effort

    def _sagging(self, torque: float) -> float:
        """What the supply lets a torque drive give."""
        return torque / (1.0 + self.line.sag * abs(torque) / self.drive.max_torque)

    def _through_transmission(self, value: float, position: float, speed: float, state: Array, rates: Array) -> float:
        """Effort of spring and damper between motor and joint; where there is play, of the tooth that touches, which only pushes."""
        line = self.line
        stiffness = 1.0 / line.compliance if line.compliance > 0 else 1e6
        twist = state[0] - position
        wanted, yielding = 0.0, 0.0
        if not self._torque:
            wanted = self._set_speed(value, float(state[0]))
            yielding = 1.0 / self._gain + line.sag * abs(wanted) / self.drive.max_torque

        def led(effort: float) -> tuple[float, float]:
            """A motor's speed without effort, and how much it gives way, where this effort goes through: by its servo, or its line."""
            beyond = effort + self._falls * (wanted - yielding * effort)
            if self._falls and abs(beyond) > self._most:
                return (self._most if beyond > 0 else -self._most) / self._falls, 1.0 / self._falls
            return wanted, yielding

        def face(play: float, lower: float, upper: float) -> float:
            stretch = stiffness * (twist - play)
            if self._torque:
                return within(stretch + line.damping * (state[1] - speed), lower, upper)

            def through(free: float, gives: float) -> float:
                return within((stretch + line.damping * (free - speed)) / (1.0 + line.damping * gives), lower, upper)

            return through(*led(through(wanted, yielding)))

        half = 0.5 * line.gap
        effort = face(half, 0.0, np.inf) + face(-half, -np.inf, 0.0) if line.gap > 0 else face(0.0, -np.inf, np.inf)
        if self._torque:
            back = self._falls * state[1]
            rates[0] = state[1]
            rates[1] = (within(self._sagging(value), -self._most - back, self._most - back) - effort) / max(line.rotor, 1e-9)
            return effort
        if not self._falls:
            effort = within(effort, -self._most, self._most)
        free, gives = led(effort)
        rates[0] = free - gives * effort
        return effort
