"""Recordings of machines without wheels on the ground: adaptive integration between the instants at which something switches."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import ODEintWarning, odeint
from scipy.linalg.lapack import dposv  # pyright: ignore[reportAttributeAccessIssue]
from scipy.spatial.transform import Rotation

from rille.model import Effect, InputRefused, PhysicsFailed, Scenario
from rille.model.recording import ANGLES, AXES
from rille.proof.generator.body_laws import BODY_LAWS, PayloadSlosh, with_other_bodies
from rille.proof.generator.drive_line import LINE_KINDS, DriveLine, line_of
from rille.proof.generator.joint_laws import JOINT_LAWS
from rille.proof.generator.law import Law
from rille.proof.generator.mechanism import FREE, Mechanism
from rille.proof.generator.moment import Moment
from rille.proof.generator.reading import Reading
from rille.proof.generator.strange_laws import STRANGE_LAWS
from rille.proof.subject import Subject

Array = NDArray[np.float64]
PRECISION = 1e-9  # relative and absolute, of positions and velocities
OF_LAWS = 1e-6, 1e-8  # relative and absolute, of states of laws: a rotor behind a stiff transmission rings on and on
NUDGE = 1e-5  # [s] of a difference quotient along the motion
CHANGES = ("mass_change", "com_offset", "gravity_tilt")  # laws that are other bodies
MOST_STEPS = 20000  # of one interval
SAME = 1e-9  # [s]: instants that are so near to each other are one


def laws_of(machine: Subject, effects: Sequence[Effect]) -> list[Law]:
    """Laws of joints and bodies at their targets; '*' is every one.

    Raises
    ------
    InputRefused : for a law that the generator does not know.
    """
    found: list[Law] = []
    joints = [joint.name for joint in machine.rover.joints if joint.kind in ("hinge", "prismatic")]
    bodies = [body.name for body in machine.rover.bodies]
    for effect in effects:
        if effect.kind in (*CHANGES, *LINE_KINDS):
            continue
        numbers = {name: float(value) for name, value in effect.parameters.items()}  # type: ignore[arg-type]
        if effect.kind == "payload_slosh":
            gravity = np.array(machine.gravity)
            found += [PayloadSlosh(name, numbers, gravity) for name in bodies if effect.target in ("*", name) and numbers["mass"]]
            continue
        law = JOINT_LAWS.get(effect.kind) or BODY_LAWS.get(effect.kind) or STRANGE_LAWS.get(effect.kind)
        if law is None:
            raise InputRefused(f"the generator knows no law '{effect.kind}' of joints or bodies")
        known = joints if effect.target in joints else bodies
        if effect.target == "*":
            known = joints if effect.kind in JOINT_LAWS else bodies
        found += [law(name, numbers) for name in known if effect.target in ("*", name)]
    return found


def motion(machine: Subject, scenario: Scenario, laws: Sequence[Effect], wanted: Sequence[Reading]) -> list[Array]:
    """Values (n,) of each reading.

    laws : at work in the machine, beside those that its model has.

    Raises
    ------
    PhysicsFailed : if a motion cannot be integrated, or is not finite.
    """
    return _Motion(machine, scenario, (*machine.effects, *laws)).readings(wanted)


class _Motion:
    def __init__(self, machine: Subject, scenario: Scenario, effects: Sequence[Effect]) -> None:
        machine = with_other_bodies(replace(machine, gravity=scenario.gravity), effects)
        self._scenario, self._gravity = scenario, np.array(machine.gravity)
        self._mechanism = Mechanism(machine.rover, machine.gravity)
        self._moment = Moment(self._mechanism, machine.rover)
        self._n_q, self._n_z = len(self._mechanism.start()), self._mechanism.size
        q, z = self._first()
        self._moment.at(0.0, q, z)
        self._drives = {drive.name: drive for drive in machine.rover.drives}
        drives: list[Law] = []
        for drive in machine.rover.drives:
            row = self._mechanism.row(drive.joint)
            inertia = 1.0 / float(row @ np.linalg.solve(self._mechanism.mass, row))
            drives.append(DriveLine(drive, line_of(drive.joint, effects), scenario, inertia))
        self._laws = [*drives, *laws_of(machine, effects)]  # drives first: others ask for their efforts
        places = np.cumsum([self._n_q + self._n_z, *(law.states for law in self._laws)])
        self._places = [slice(int(a), int(b)) for a, b in pairwise(places)]
        self._relative, self._absolute = (np.repeat([PRECISION, of_laws], [places[0], places[-1] - places[0]]) for of_laws in OF_LAWS)
        self._start = np.concatenate([q, z, *(law.start(self._moment) for law in self._laws)])

    def _first(self) -> tuple[Array, Array]:
        mechanism, scenario = self._mechanism, self._scenario
        q = mechanism.start()
        linear = angular = None
        if mechanism.is_free:
            w, x, y, z = scenario.start.rotation
            turned = Rotation.from_quat([x, y, z, w])
            q = mechanism.put(q, np.array(scenario.start.position), turned.as_matrix())
            linear, angular = np.array(scenario.start_velocity), turned.inv().apply(scenario.start_angular_velocity)
        rates = {}
        for state in scenario.initial_states:
            q = mechanism.with_joint(q, state.joint, state.position)
            rates[state.joint] = state.velocity
        return q, mechanism.reduced(mechanism.velocities(rates, linear, angular))

    def _act(self, y: Array, time: float) -> Array:
        """dy/dt."""
        moment, n = self._moment, self._n_q + self._n_z
        q = y[: self._n_q]
        if self._mechanism.is_free:
            q = q.copy()
            q[3:FREE] /= np.sqrt(q[3:FREE] @ q[3:FREE])
        moment.at(time, q, y[self._n_q : n])
        rates = np.empty(len(y))
        for law, place in zip(self._laws, self._places, strict=True):
            rates[place] = law.act(moment, y[place])
        rates[: self._n_q] = self._mechanism.rates(q, moment.z)
        _, rates[self._n_q : n], failed = dposv(self._mechanism.mass, moment.force - self._mechanism.bias)
        if failed:
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        return rates

    def readings(self, wanted: Sequence[Reading]) -> list[Array]:
        """Values of each reading, at instants of their own."""
        asked = np.unique(np.concatenate([reading.times for reading in wanted]))
        switches = {time for law in self._laws for time in law.switches()}
        ends = np.unique([0.0, self._scenario.duration, *(t for t in switches if SAME < t < self._scenario.duration - SAME)])
        ends = ends[np.diff(ends, append=np.inf) > SAME]
        values = [np.full(len(reading.times), np.nan) for reading in wanted]
        places = [np.searchsorted(reading.times, asked) for reading in wanted]
        y = self._start
        for begin, end in pairwise(ends):
            inside = np.flatnonzero((asked > begin) & (asked <= end) | ((asked == 0.0) & (begin == 0.0)))
            path = self._integrated(y, begin, end, asked[inside])
            for k, state in zip(inside.tolist(), path, strict=False):
                when = min(float(asked[k]), end - 1e-9 * (end - begin))  # efforts are those before the switch
                rates = self._act(state, when)
                for reading, value, place in zip(wanted, values, places, strict=True):
                    at = place[k]
                    if at < len(reading.times) and reading.times[at] == asked[k]:
                        value[at] = self._value(reading, state, rates, when)
            y = path[-1]
        return values

    def _integrated(self, y: Array, begin: float, end: float, instants: Array) -> Array:
        """States at instants of an interval in which nothing switches, and at its end."""
        last = end - 1e-12 * max(1.0, end)

        def rates(state: Array, time: float) -> Array:
            return self._act(state, min(max(time, begin), last))

        times = np.concatenate([[begin], instants, [end]])
        times[times < begin + SAME], times[times > end - SAME] = begin, end  # LSODA refuses steps of a rounding
        with warnings.catch_warnings():
            warnings.simplefilter("error", ODEintWarning)
            try:
                path = odeint(rates, y, times, rtol=self._relative, atol=self._absolute, mxstep=MOST_STEPS)
            except (ODEintWarning, ValueError, np.linalg.LinAlgError) as error:
                raise PhysicsFailed(f"the motion from {begin:.3f} s on cannot be integrated: {error}") from None
        if not np.isfinite(path).all():
            raise PhysicsFailed(f"the motion is not finite after {begin:.3f} s")
        return path[1:]

    def _value(self, reading: Reading, state: Array, rates: Array, time: float) -> float:
        """A reading at the moment of the last ``_act``."""
        moment, target = self._moment, reading.target
        match reading.quantity:
            case "joint.position":
                return moment.position(target)
            case "joint.velocity":
                return moment.speed(target)
            case "joint.effort":
                return moment.drive_effort.get(target, 0.0)
            case "motor.current":
                drive = self._drives[target]
                if drive.torque_constant is None:
                    raise InputRefused(f"drive '{target}' has no torque_constant; give it one, its current is effort / torque_constant")
                return moment.drive_effort[drive.joint] / drive.torque_constant
        position, turned = self._mechanism.pose(target)
        if reading.quantity == "part.orientation":
            turn = Rotation.from_matrix(turned)
            if reading.component in ANGLES:
                return float(turn.as_euler("ZYX")[2 - ANGLES.index(reading.component)])
            return float(turn.as_quat(canonical=True)["xyzw".index(reading.component)])
        if reading.quantity == "part.position":
            vector = position
        else:
            linear, angular = self._mechanism.jacobian(target, position)
            z = state[self._n_q : self._n_q + self._n_z]
            if reading.quantity == "part.linear_acceleration":
                vector = linear @ rates[self._n_q : self._n_q + self._n_z] + self._along(target, state, rates, time) - self._gravity
            else:
                vector = (linear if reading.quantity == "part.linear_velocity" else angular) @ z
        vector = turned.T @ vector if reading.frame == "body" else vector
        return float(vector[AXES.index(reading.component)])

    def _along(self, body: str, state: Array, rates: Array, time: float) -> Array:
        """Change of a frame's velocity as the machine moves on with constant z [m/s^2]."""
        q, z = state[: self._n_q], state[self._n_q : self._n_q + self._n_z]
        seen = []
        for nudge in (-NUDGE, NUDGE):
            self._mechanism.move(q + nudge * rates[: self._n_q], z)
            linear, _ = self._mechanism.jacobian(body, self._mechanism.pose(body)[0])
            seen.append(linear @ z)
        self._mechanism.move(q, z)
        return (seen[1] - seen[0]) / (2 * NUDGE)
