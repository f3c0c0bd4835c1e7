"""How a rover's bodies hang together: carriers, chains, subtrees, coupled joints, constraints and the freedom that they leave."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import Joint, Rover

Array = NDArray[np.float64]

FREEDOM = {"hinge": 1, "prismatic": 1, "spherical": 3, "fixed": 0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mobility:
    """Count of freedom at the zero pose.

    joints : freedoms of all joints. free_bodies : roots that no joint ties to the world, with 6 freedoms each. constraints : equations of
    gears, differentials and loops. rank : how many of them are independent. degrees : freedoms in all, joints + 6 free_bodies - rank.
    inner : independent motions of the joints that are left.
    """

    joints: int
    free_bodies: int
    constraints: int
    rank: int
    degrees: int
    inner: int


class Linkage:
    """Topology of a rover whose references are sound (see :func:`rille.cad.checks.check`)."""

    def __init__(self, rover: Rover) -> None:
        self.rover = rover
        self.joints: dict[str, Joint] = {joint.name: joint for joint in rover.joints}
        self.carrier: dict[str, Joint] = {}
        for joint in rover.joints:
            self.carrier.setdefault(joint.child, joint)

    def chain(self, body: str) -> list[Joint]:
        """Joints from a body down to its root, the body's own first."""
        found: list[Joint] = []
        at: str | None = body
        while at is not None and (joint := self.carrier.get(at)) is not None and joint not in found:
            found.append(joint)
            at = joint.parent
        return found

    def root(self, body: str) -> str | None:
        """The body that carries all others of its tree; None: the world."""
        chain = self.chain(body)
        return chain[-1].parent if chain else body

    def between(self, a: str, b: str) -> tuple[str, ...] | None:
        """Names of the joints between two bodies; None where nothing connects them."""
        if self.root(a) != self.root(b):
            return None
        first, second = {j.name for j in self.chain(a)}, {j.name for j in self.chain(b)}
        return tuple(name for name in self.joints if name in first ^ second)

    def subtree(self, body: str) -> list[str]:
        """A body and all that it carries."""
        return [other.name for other in self.rover.bodies if other.name == body or any(j.parent == body for j in self.chain(other.name))]

    def couplings(self) -> list[tuple[str, str, float]]:
        """Linear relations q_b = c q_a of gears and differentials.

        Differential: theta_a + theta_b = 2 theta_carrier about the direction of a's hinge, so q_b = -q_a where both axes point the
        same way and q_b = q_a where they are opposed.
        """
        found = [(gear.joint_a, gear.joint_b, gear.ratio) for gear in self.rover.gears]
        for differential in self.rover.differentials:
            a, b = self.joints[differential.joint_a], self.joints[differential.joint_b]
            found.append((a.name, b.name, -1.0 if np.dot(a.axis, b.axis) >= 0 else 1.0))
        single = {name for name, joint in self.joints.items() if FREEDOM[joint.kind] == 1}
        return [(a, b, ratio) for a, b, ratio in found if a != b and {a, b} <= single]

    def columns(self) -> dict[str, slice]:
        """Place of every joint's freedoms, and of the six of every free root, in a vector of speeds."""
        places: dict[str, slice] = {}
        at = 0
        for joint in self.rover.joints:
            places[joint.name] = slice(at, at + FREEDOM[joint.kind])
            at += FREEDOM[joint.kind]
        for body in self.rover.bodies:
            if body.name not in self.carrier:
                places[f"root {body.name}"] = slice(at, at + 6)
                at += 6
        return places

    def jacobian(self, poses: Mapping[str, Array] | None = None) -> tuple[Array, Array]:
        """Constraint equations, J v = 0, and their errors at a pose.

        poses : X_MB of every body, (4, 4); None: the zero pose. v : speeds of the joints, then of the free roots (turning, moving).

        Returns
        -------
        J, shape (n_rows, n_speeds), and the errors [rad, m] of the loops' rows, zero in those of the couplings, shape (n_rows,).
        """
        places = self.columns()
        width = max((place.stop for place in places.values()), default=0)
        rows: list[Array] = []
        errors: list[Array] = []
        for a, b, ratio in self.couplings():
            row = np.zeros((1, width))
            row[0, places[b]] += 1.0
            row[0, places[a]] -= ratio
            rows.append(row)
            errors.append(np.zeros(1))
        for loop in self.rover.loop_closures:
            point = np.array(loop.point)
            here = self.moved(poses, loop.body_a, point)
            there = point if loop.body_b is None else self.moved(poses, loop.body_b, point)
            row = self._speed(poses, loop.body_a, here, places, width)
            if loop.body_b is not None:
                row = row - self._speed(poses, loop.body_b, there, places, width)
            rows.append(row)
            errors.append(here - there)
        if not rows:
            return np.zeros((0, width)), np.zeros(0)
        return np.concatenate(rows), np.concatenate(errors)

    def mobility(self) -> Mobility:
        """Freedom at the zero pose: rank of the constraints against their number (Gogu 2005: the count of Chebychev, Gruebler and Kutzbach
        alone is wrong for planar loops)."""
        matrix, _ = self.jacobian()
        joints = sum(FREEDOM[joint.kind] for joint in self.rover.joints)
        free = sum(body.name not in self.carrier for body in self.rover.bodies)
        motions = _null_space(matrix)
        return Mobility(
            joints=joints,
            free_bodies=free,
            constraints=len(matrix),
            rank=matrix.shape[1] - motions.shape[1],
            degrees=motions.shape[1],
            inner=joints - _null_space(motions[:joints].T).shape[1] if motions.size else 0,
        )

    def moved(self, poses: Mapping[str, Array] | None, body: str | None, point: Array) -> Array:
        """Where a point of a body, given in M at the zero pose, is in a pose."""
        if poses is None or body is None:
            return point
        frame = next(b.frame for b in self.rover.bodies if b.name == body)
        return poses[body][:3, :3] @ (point - np.array(frame)) + poses[body][:3, 3]

    def _speed(self, poses: Mapping[str, Array] | None, body: str, here: Array, places: Mapping[str, slice], width: int) -> Array:
        matrix = np.zeros((3, width))
        for joint in self.chain(body):
            turn = np.eye(3) if poses is None or joint.parent is None else poses[joint.parent][:3, :3]
            arm = here - self.moved(poses, joint.parent, np.array(joint.point))
            axis = turn @ np.array(joint.axis)
            if joint.kind == "hinge":
                matrix[:, places[joint.name]] = np.cross(axis, arm)[:, None]
            elif joint.kind == "prismatic":
                matrix[:, places[joint.name]] = axis[:, None]
            elif joint.kind == "spherical":
                matrix[:, places[joint.name]] = -_skew(arm)
        root = self.root(body)
        if root is not None:
            place = places[f"root {root}"]
            matrix[:, place.start : place.start + 3] = -_skew(here)
            matrix[:, place.start + 3 : place.stop] = np.eye(3)
        return matrix


def _null_space(matrix: Array) -> Array:
    """Orthonormal basis of the vectors that a matrix (n, k) takes to zero, shape (k, n_null); rows are weighed alike."""
    if matrix.size == 0:
        return np.eye(matrix.shape[1])
    sizes = np.linalg.norm(matrix, axis=1)
    _, values, right = np.linalg.svd(matrix / np.maximum(sizes, 1e-12)[:, None])
    return right[int((values > 1e-6 * max(values[0], 1e-300)).sum()) :].T


def _skew(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
