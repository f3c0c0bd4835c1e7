"""The motion of a rover on soft soil: bodies and joints of a ``Mechanism``, wheels of ``Wheels``, drives, in extrapolated implicit steps.

An implicit step of h finds the reduced velocities z+ at its end from

    M (z+ - z) = h (Sum J^T f(z+) + tau(z+) - bias),  q+ = q + h (v + v+)/2

f: forces of the wheels at their speeds and sinkages at the end of the step; tau: efforts of drives and laws. It is solved by Newton's
method with chords for the slopes of f: dry friction and shear are concave in their speeds, so that a chord majorises them and the iteration
converges. Where a law is not concave (a wheel that turns back while it drifts) steps are
halved; what is left is taken along the chords, so that momentum is balanced to rounding. M, J and bias are those of the beginning. Its
error is of first order in h.

A step goes on from all that two halves of it say, twice, less what it says in one (Deuflhard 1985, SIAM Review 27, sec. 3): its error is
of second order, what is stiff dies out in it as in the implicit steps, and every step goes on from a state in which the rover was: two
whole runs, extrapolated, are a motion of no rover once wheels of one bounce where those of the other do not.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve
from scipy.spatial.transform import Rotation

from rille.model import Effect, InputRefused, PhysicsFailed, Scenario
from rille.proof.generator.body_laws import with_other_bodies
from rille.proof.generator.drive_line import line_of
from rille.proof.generator.mechanism import Mechanism
from rille.proof.generator.rover_drives import Drives, SetValues
from rille.proof.generator.rover_laws import RoverLaws
from rille.proof.generator.wheel_soil import SLIP
from rille.proof.generator.wheels import NORMAL, ROLLING, RUT, SHEAR, SIDEWAYS, Footing, Push, Wheels
from rille.proof.subject import Subject

Array = NDArray[np.float64]
PRECISION = 1e-7  # [m/s or rad/s] of the speeds at the end of a step
FULL_STEPS, MOST_ITERATIONS = 6, 48  # then half steps, quarter steps ...
REST_SPEED, REST_TIME = 1e-4, 0.1  # slower than this [m/s, rad/s] for so long [s] is settled
BEFORE = -1.0  # [s] the time of settling: what has a time of its own has not begun
SLIP_SPEED = 1e-4  # [m/s] below which slip is not told: it would be a ratio of two noises
LIFT, RIM, TRAVEL, LATERAL, SPIN = range(5)  # speeds of a wheel


class RoverOnSoil:
    """A rover that moves. ``q``, ``z``: its coordinates and reduced velocities."""

    def __init__(self, machine: Subject, scenario: Scenario, effects: Sequence[Effect]) -> None:
        changed = with_other_bodies(replace(machine, gravity=scenario.gravity), effects)
        rover = changed.rover
        self.machine, self.scenario = changed, scenario
        self.mechanism = Mechanism(rover, changed.gravity)
        self.gravity = np.array(changed.gravity)
        self.laws = RoverLaws(self.mechanism, changed, effects)
        self.wheels = Wheels(machine, effects, float(np.linalg.norm(self.gravity)))
        joints = {joint.name: joint for joint in rover.joints}
        frames = {body.name: np.array(body.frame) for body in rover.bodies}
        self._carried = [joints[wheel.joint].child for wheel in rover.wheels]
        self._centers = [np.array(wheel.center) - frames[body] for wheel, body in zip(rover.wheels, self._carried, strict=True)]
        axes = [np.array(joints[wheel.joint].axis) for wheel in rover.wheels]
        self._axles = [-axis if axis[1] < 0 else axis for axis in axes]  # to the left, whichever way the joint turns
        self._wheel_joints = [wheel.joint for wheel in rover.wheels]
        self._driven = [drive.joint for drive in rover.drives]
        self._selection = np.array([self.mechanism.row(joint) for joint in self._driven])
        self.q, self.z = self.mechanism.start(), np.zeros(self.mechanism.size)
        self._growth = np.zeros(self.mechanism.size)  # of z in the last implicit step, per second
        self._seen: Array | None = None
        self.effort = np.zeros(len(rover.drives))
        start = self._joint_positions(self._driven)
        lines = [line_of(joint, effects) for joint in self._driven]
        self.drives = Drives(rover.drives, lines, start)
        self._values = SetValues(rover.drives, lines, scenario, start)
        self._footing: Footing | None = None
        self._push: Push | None = None
        self._lateral = np.zeros(len(rover.wheels))  # [m/s] of the wheels' feet

    def _joint_positions(self, names: Sequence[str]) -> Array:
        return np.array([self.mechanism.joint_position(self.q, name) for name in names])

    def _look(self) -> None:
        """Kinematics of the present state, unless they are known."""
        if self._seen is not self.q:
            self.mechanism.move(self.q, self.z)
            self._seen = self.q

    def _wheel_frames(self) -> tuple[Array, Array]:
        """Centres (n, 3) [m] and axles (n, 3) in W, of the last ``move``."""
        poses = [self.mechanism.pose(body) for body in self._carried]
        centers = np.array([p + turn @ c for (p, turn), c in zip(poses, self._centers, strict=True)])
        return centers, np.array([turn @ a for (_, turn), a in zip(poses, self._axles, strict=True)])

    def place(self) -> None:
        """Joints where the scenario starts them, the root as given or on the ground; then laws of joints and bodies begin.

        On the ground: the scenario's x, y and heading, tilted like the plane through the ground under the wheels (least squares). Height
        and tilt depend on each other, since they shift the wheels: four rounds reach millimetres. Then the lowest wheel touches.
        """
        start = self.scenario.start
        for state in self.scenario.initial_states:
            self.q = self.mechanism.with_joint(self.q, state.joint, state.position)
        w, i, j, k = start.rotation
        turned = Rotation.from_quat([i, j, k, w])
        position = np.array(start.position)
        self.q = self.mechanism.put(self.q, position, turned.as_matrix())
        if self.scenario.placement == "on_terrain":
            forward = turned.apply([1.0, 0.0, 0.0]) * (1.0, 1.0, 0.0)
            forward /= np.linalg.norm(forward)
            normal = np.array([0.0, 0.0, 1.0])
            for _ in range(4):
                left = np.cross(normal, forward)
                left /= np.linalg.norm(left)
                self.q = self.mechanism.put(self.q, position, np.column_stack([np.cross(left, normal), left, normal]).astype(np.float64))
                normal, position = self._plane_under_wheels(position)
            self._look()
            footing = self.wheels.footing(*self._wheel_frames(), self._joint_positions(self._wheel_joints))
            self.q = self.q.copy()
            self.q[2] += footing.sinkage.max()
        self.laws.begin(self.q, self.z)

    def _plane_under_wheels(self, position: Array) -> tuple[Array, Array]:
        """Normal (3,) of the plane through the ground under the wheels, and its point (3,) [m] at the x and y of ``position``."""
        self._look()
        centers, _ = self._wheel_frames()
        height = self.wheels.ground.height(centers[:, 0], centers[:, 1])
        away = np.column_stack([centers[:, :2] - position[:2], np.ones(len(centers))])
        rise_x, rise_y, here = np.linalg.lstsq(away, height, rcond=None)[0]
        normal = np.array([-rise_x, -rise_y, 1.0]) / np.sqrt(1 + rise_x**2 + rise_y**2)
        return normal, np.array([position[0], position[1], here])

    def settle(self, longest: float, step: float) -> None:
        """Until nothing moves, with drives at rest, at most ``longest`` [s]."""
        slow = 0
        for _ in range(round(longest / step)):
            self._implicit_step(BEFORE, step, hold=True)
            slow = slow + 1 if np.abs(self.z).max() < REST_SPEED else 0
            if slow * step >= REST_TIME:
                return

    def _wheel_rows(self, footing: Footing, centers: Array) -> Array:
        """(n, 5, size): each wheel's lift, r w, v of its centre, v_y of its foot, and spin, per reduced velocity."""
        rows = np.empty((len(centers), 5, self.mechanism.size))
        for k, body in enumerate(self._carried):
            linear, angular = self.mechanism.jacobian(body, centers[k])
            up, ahead, axle, radius = footing.up[k], footing.ahead[k], footing.axle[k], self.wheels.radius[k]
            rows[k, LIFT] = up @ linear
            rows[k, RIM] = radius * (axle @ angular)
            rows[k, TRAVEL] = ahead @ linear
            rows[k, LATERAL] = axle @ linear + radius * (ahead @ angular)
            rows[k, SPIN] = up @ angular
        return rows

    def step(self, time: float, step: float) -> None:
        """Move on from ``time`` by ``step`` [s]. What it makes (forces, efforts) is that of its second half.

        Raises
        ------
        PhysicsFailed : if a wheel leaves the terrain or is buried, or speeds are not finite.
        """
        begin, half = self._memory(), 0.5 * step
        self._implicit_step(time, step, hold=False)
        whole = self._memory()
        self._remember(begin)
        self._implicit_step(time, half, hold=False)
        self._implicit_step(time + half, half, hold=False)
        self._remember([2 * halves - one for halves, one in zip(self._memory(), whole, strict=True)])
        assert self._footing is not None
        self.wheels.mark(self._footing)

    def _memory(self) -> list[Array]:
        """All that a step goes on from, but for ruts, which it makes at its end."""
        return [self.q, self.z, *self.drives.memory(), *self.laws.memory(), *self.wheels.memory()]

    def _remember(self, memory: Sequence[Array]) -> None:
        """Go on from there."""
        q, self.z, *rest = memory
        self.q = self.mechanism.normal(q)
        for part in (self.drives, self.laws, self.wheels):
            n = len(part.memory())
            part.remember(rest[:n])
            rest = rest[n:]

    def _implicit_step(self, time: float, step: float, hold: bool) -> None:
        """Move on from ``time`` by ``step`` [s] to first order. hold : drives stand still."""
        mechanism, wheels = self.mechanism, self.wheels
        self._look()
        centers, axles = self._wheel_frames()
        footing = wheels.footing(centers, axles, self._joint_positions(self._wheel_joints))
        rows = self._wheel_rows(footing, centers)
        before = rows @ self.z
        slow = wheels.slow(before)
        wheels.read_ruts(footing, before[:, RIM], before[:, TRAVEL])
        along = np.stack(
            [rows[:, LIFT], rows[:, RIM] - rows[:, TRAVEL], rows[:, RIM], rows[:, TRAVEL], rows[:, LATERAL], rows[:, SPIN]], axis=1
        ).reshape(-1, mechanism.size)
        value = self._values.mean(time, time + step)
        target = self.drives.target(value, self._joint_positions(self._driven), step, hold)
        mass, bias, selection = mechanism.mass, mechanism.bias, self._selection

        z = self.z + step * self._growth
        k = 0
        while True:
            speeds = rows @ z
            push = wheels.push(footing, footing.sinkage - 0.5 * step * (before[:, LIFT] + speeds[:, LIFT]), speeds, slow)
            slope = push.slope.copy()
            slope[:, NORMAL] += 0.5 * step * push.stiffness
            effort, chord = self.drives.efforts(target, selection @ z, step, hold)
            forces = along.T @ push.force.ravel() + selection.T @ effort - bias
            matrix = mass + step * ((along.T * slope.ravel()) @ along + (selection.T * chord) @ selection)
            if self.laws.any:
                given, fall = self.laws.forces(time + step, step, self.q, z, dict(zip(self._driven, effort, strict=True)))
                forces += given
                matrix += step * fall
            missing = mass @ (z - self.z) - step * forces
            change = solve(matrix, -missing, assume_a="pos", check_finite=False, overwrite_a=True)
            change *= 0.5 ** (k // FULL_STEPS)  # a wheel that turns back while it drifts is no concave law
            z = z + change
            if not np.isfinite(change).all():
                raise PhysicsFailed(f"at t = {time:.3f} s the rover's speeds are not finite; take a smaller step than {step:g} s")
            if np.abs(change).max() < PRECISION or k + 1 == MOST_ITERATIONS:
                break
            k += 1
        push.force -= slope * (along @ change).reshape(slope.shape)  # what moved the rover, to rounding
        effort = effort - chord * (selection @ change)
        self.drives.advance(target, selection @ z, effort, step, hold)
        if self.laws.any:
            self.laws.advance()
        wheels.advance(push, step)
        self.q = mechanism.integrate(self.q, 0.5 * (self.z + z), step)
        self._growth, self.z = (z - self.z) / step, z
        self.effort, self._footing, self._push, self._lateral = effort, footing, push, speeds[:, LATERAL]

    def state(self, quantity: str, target: str) -> Array:
        """A quantity of motion at the present instant, for an acceleration the velocity; (0,) of what else steps make."""
        mechanism = self.mechanism
        if quantity == "joint.position":
            return np.array([mechanism.joint_position(self.q, target)])
        if quantity == "joint.velocity":
            return np.array([mechanism.row(target) @ self.z])
        if quantity in ("part.position", "part.orientation", "part.linear_velocity", "part.angular_velocity", "part.linear_acceleration"):
            self._look()
            position, turned = mechanism.pose(target)
            if quantity == "part.position":
                return position
            if quantity == "part.orientation":
                return Rotation.from_matrix(turned).as_quat()[[3, 0, 1, 2]]
            linear, angular = mechanism.jacobian(target, position)
            return (angular if quantity == "part.angular_velocity" else linear) @ self.z
        return np.empty(0)

    def made(self, quantity: str, target: str) -> Array:
        """What the last step made; (0,) of motion."""
        rover = self.machine.rover
        if quantity == "joint.effort":
            return np.array([self.effort[self._driven.index(target)] if target in self._driven else 0.0])
        if quantity in ("motor.current", "motor.voltage"):
            k = [drive.name for drive in rover.drives].index(target)
            drive = rover.drives[k]
            if drive.torque_constant is None or (quantity == "motor.voltage" and drive.resistance is None):
                raise InputRefused(f"drive '{target}' has no torque_constant or resistance; give it what {quantity} needs")
            current = self.effort[k] / drive.torque_constant
            if quantity == "motor.current":
                return np.array([current])
            return np.array([current * drive.resistance + drive.torque_constant * (self._selection[k] @ self.z)])
        if not quantity.startswith("wheel."):
            return np.empty(0)
        assert self._push is not None
        assert self._footing is not None
        k = self.wheels.names.index(target)
        force, contacts = self._push.force[k], self._push.contacts
        u, v = contacts.rim[k], contacts.travel[k]
        rolls = max(abs(u), abs(v)) > SLIP_SPEED and self._footing.sinkage[k] > 0
        values = {
            "wheel.sinkage": max(self._footing.sinkage[k], 0.0),
            "wheel.normal_load": force[NORMAL],
            "wheel.drawbar_pull": force[RUT] - force[SHEAR],
            "wheel.side_force": force[SIDEWAYS],
            "wheel.drive_torque": -self.wheels.radius[k] * (force[SHEAR] + force[ROLLING]),
            "wheel.slip_ratio": contacts.motion[k, SLIP] if rolls else 0.0,
            "wheel.slip_angle": np.arctan2(self._lateral[k], abs(v)) if rolls else 0.0,
        }
        return np.array([values[quantity]])
