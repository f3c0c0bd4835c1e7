# pyright: reportAttributeAccessIssue=false
"""Bodies and joints by MuJoCo (Todorov et al. 2012, IROS): positions, mass matrix, Coriolis forces, Jacobians, in reduced coordinates."""

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve
from scipy.spatial.transform import Rotation

from rille.model import InputRefused, Rover
from rille.model.rover import Vector

Array = NDArray[np.float64]
KINDS = {"hinge": mujoco.mjtJoint.mjJNT_HINGE, "prismatic": mujoco.mjtJoint.mjJNT_SLIDE}
FREE = 7  # numbers of a free root: position and quaternion (w, x, y, z)


class Mechanism:
    """A rover (or any mechanism of hinges and slides) in reduced coordinates.

    q : MuJoCo's positions: of a free root x, y, z of its frame in W and its quaternion (w, x, y, z), then one number per joint [rad or m].
    v = G z : MuJoCo's velocities: of a free root the velocity of its frame in W [m/s] and its angular velocity along its own axes [rad/s],
    then joint rates. z (``size``,) : the independent ones; gears (q_b = ratio q_a) and differentials (theta_a + theta_b = 2 theta_carrier,
    so that the hinges of both sides turn against each other) hold exactly, as long as they hold at the start.

    After ``move``: mass (size, size), bias (size,): G^T M G, and G^T of Coriolis forces less gravity, so that mass z' = G^T forces - bias.
    """

    def __init__(self, rover: Rover, gravity: Vector) -> None:
        """gravity : in W [m/s^2].

        Raises
        ------
        InputRefused : for joints other than hinge, prismatic and fixed, and for loops.
        """
        if rover.loop_closures:
            raise InputRefused("the generator knows no loop closures; give a machine without them")
        self._bodies: dict[str, int] = {}
        self._model = self._built(rover, gravity)
        self._data = mujoco.MjData(self._model)
        names = [joint.name for joint in rover.joints if joint.kind in KINDS]
        ids = {name: self._model.joint(name).id for name in names}
        self._q_place: Mapping[str, int] = {name: int(self._model.jnt_qposadr[i]) for name, i in ids.items()}
        self._v_place: Mapping[str, int] = {name: int(self._model.jnt_dofadr[i]) for name, i in ids.items()}
        self.is_free = bool(self._model.njnt and self._model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE)
        self.G = self._reduction(rover)
        self.size = self.G.shape[1]
        self._whole = np.zeros((self._model.nv, self._model.nv))
        self._forces = np.zeros(self._model.nv)
        self._linear, self._angular = np.zeros((3, self._model.nv)), np.zeros((3, self._model.nv))
        self.mass, self.bias = np.zeros((self.size, self.size)), np.zeros(self.size)

    def _built(self, rover: Rover, gravity: Vector) -> mujoco.MjModel:
        spec = mujoco.MjSpec()
        spec.option.gravity = gravity
        spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        spec.compiler.balanceinertia = False
        by_child = {joint.child: joint for joint in rover.joints}
        frames = {body.name: np.array(body.frame) for body in rover.bodies}
        placed = {}
        waiting = list(rover.bodies)
        while waiting:
            body = next((b for b in waiting if b.name not in by_child or by_child[b.name].parent in (None, *placed)), None)
            if body is None:
                raise InputRefused(f"body '{waiting[0].name}' hangs on nothing: its joints form a loop; the generator knows none")
            waiting.remove(body)
            joint = by_child.get(body.name)
            parent = joint.parent if joint is not None else None
            frame = frames[body.name]
            p = body.properties
            made = (placed[parent] if parent is not None else spec.worldbody).add_body(
                name=body.name,
                pos=frame - (frames[parent] if parent is not None else 0.0),
                mass=p.mass,
                ipos=p.com - frame,
                fullinertia=p.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
                explicitinertial=True,
            )
            if joint is None:
                made.add_freejoint(name=f"free {body.name}")
                self.root = body.name
            elif joint.kind in KINDS:
                made.add_joint(name=joint.name, type=KINDS[joint.kind], axis=joint.axis, pos=np.array(joint.point) - frame)
            elif joint.kind != "fixed":
                raise InputRefused(f"joint '{joint.name}' is {joint.kind}; the generator knows hinge, prismatic and fixed")
            placed[body.name] = made
        model = spec.compile()
        self._bodies = {name: model.body(name).id for name in placed}
        return model

    def _reduction(self, rover: Rover) -> Array:
        """G (nv, size) with v = G z: each constraint A v = 0 makes one joint depend on the others."""
        nv, rows, dependent = self._model.nv, [], []
        joints = {joint.name: joint for joint in rover.joints}
        for gear in rover.gears:
            row = np.zeros(nv)
            row[self._v_place[gear.joint_b]], row[self._v_place[gear.joint_a]] = 1.0, -gear.ratio
            rows.append(row)
            dependent.append(self._v_place[gear.joint_b])
        for differential in rover.differentials:
            one, other = joints[differential.joint_a], joints[differential.joint_b]
            row = np.zeros(nv)
            for joint in (one, other):  # hinges of the carrier itself: their angles against it are opposite about a common direction
                outward = 1.0 if joint.parent == differential.carrier else -1.0
                row[self._v_place[joint.name]] = outward * np.sign(np.dot(joint.axis, one.axis))
            rows.append(row)
            dependent.append(self._v_place[other.name])
        free = [k for k in range(nv) if k not in dependent]
        G = np.zeros((nv, len(free)))
        G[free, range(len(free))] = 1.0
        if rows:
            A = np.array(rows)
            G[dependent] = -lu_solve(lu_factor(A[:, dependent]), A[:, free])
        return G

    def start(self) -> Array:
        """q of the zero pose, the root's frame at the origin of W."""
        q = self._model.qpos0.copy()
        if self.is_free:
            q[:FREE] = (0, 0, 0, 1, 0, 0, 0)
        return q

    def put(self, q: Array, position: Array, turned: Array) -> Array:
        """q with the free root's frame at a position (3,) [m] and turned by a matrix (3, 3) in W."""
        made = q.copy()
        made[:3], made[3:FREE] = position, Rotation.from_matrix(turned).as_quat()[[3, 0, 1, 2]]
        return made

    def with_joint(self, q: Array, name: str, position: float) -> Array:
        """q with one joint at a position [rad or m]."""
        made = q.copy()
        made[self._q_place[name]] = position
        return made

    def reduced(self, v: Array) -> Array:
        """z of velocities that fulfil the constraints."""
        return np.asarray(np.linalg.lstsq(self.G, v, rcond=None)[0], dtype=np.float64)

    def velocities(self, joints: Mapping[str, float], linear: Array | None = None, angular: Array | None = None) -> Array:
        """v (nv,) of joint rates, and of a free root's velocity in W and angular velocity along its own axes."""
        v = np.zeros(self._model.nv)
        if self.is_free:
            v[:3], v[3:6] = (0.0 if linear is None else linear), (0.0 if angular is None else angular)
        for name, rate in joints.items():
            v[self._v_place[name]] = rate
        return v

    def rates(self, q: Array, z: Array) -> Array:
        """dq/dt: the quaternion's is q (0, w) / 2."""
        v = self.G @ z
        if not self.is_free:
            return v
        w, x, y, s = q[3:FREE]
        a, b, c = v[3:6]
        turning = (-x * a - y * b - s * c, w * a + y * c - s * b, w * b - x * c + s * a, w * c + x * b - y * a)
        return np.concatenate([v[:3], 0.5 * np.array(turning), v[6:]])

    def integrate(self, q: Array, z: Array, step: float) -> Array:
        """q after a step [s] with constant velocities; a free root turns about a fixed axis of its own."""
        made = q.copy()
        mujoco.mj_integratePos(self._model, made, self.G @ z, step)
        return made

    def normal(self, q: Array) -> Array:
        """q with a free root's quaternion of length 1."""
        if not self.is_free:
            return q
        made = q.copy()
        made[3:FREE] /= np.linalg.norm(made[3:FREE])
        return made

    def move(self, q: Array, z: Array) -> None:
        """Kinematics, mass matrix and bias at a state."""
        model, data = self._model, self._data
        data.qpos[:] = q
        data.qvel[:] = self.G @ z
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._forces)
        mujoco.mj_fullM(model, data, self._whole)
        self.mass = self.G.T @ self._whole @ self.G
        self.bias = self.G.T @ self._forces

    def pose(self, body: str) -> tuple[Array, Array]:
        """Origin (3,) [m] of a body's frame in W, and its turn (3, 3), of the last ``move``."""
        number = self._bodies[body]
        return self._data.xpos[number].copy(), self._data.xmat[number].reshape(3, 3).copy()

    def jacobian(self, body: str, point: Array) -> tuple[Array, Array]:
        """(3, size) each: velocity [m/s] in W of the body at a point (3,) of W, and its angular velocity [rad/s] in W, per z."""
        mujoco.mj_jac(self._model, self._data, self._linear, self._angular, point, self._bodies[body])
        return self._linear @ self.G, self._angular @ self.G

    def joint_position(self, q: Array, name: str) -> float:
        """[rad or m]."""
        return float(q[self._q_place[name]])

    def joint_place(self, name: str) -> int:
        """Where a joint's position stands in q."""
        return self._q_place[name]

    def row(self, name: str) -> Array:
        """(size,): rate of a joint per z; its transpose brings an effort in the joint into the equations of motion."""
        return self.G[self._v_place[name]]
