"""Forward kinematics of a mechanism: where its bodies are when its joints stand at given positions."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused, nearest_names
from rille.model.rover import Body, Differential, Joint, Rover

Matrix = NDArray[np.float64]

PARALLEL = 0.999
"""Smallest |cosine| between the hinges of a differential, as in the solver."""


def movable_joints(rover: Rover) -> tuple[Joint, ...]:
    """The joints that one number positions: hinges [rad] and prismatic joints [m]."""
    return tuple(joint for joint in rover.joints if joint.kind in ("hinge", "prismatic"))


def carriers(rover: Rover) -> dict[str, Joint]:
    """The joint that carries each body, by the body's name; a free root has none.

    Raises
    ------
    InputRefused : for joints of unknown bodies and for a body with two carriers.
    """
    names = {body.name for body in rover.bodies}
    found: dict[str, Joint] = {}
    for joint in rover.joints:
        for body in (joint.parent, joint.child):
            if body is not None and body not in names:
                raise InputRefused(f"joint '{joint.name}' names the body '{body}', which does not exist; {nearest_names(body, names)}")
        if joint.child in found:
            raise InputRefused(
                f"body '{joint.child}' is the child of joints '{found[joint.child].name}' and '{joint.name}'; "
                "a body has one carrier, close loops with a loop closure"
            )
        found[joint.child] = joint
    return found


def parents_first(rover: Rover) -> tuple[tuple[Body, Joint | None], ...]:
    """Every body with the joint that carries it (None: it is free), carriers before what they carry, else in the rover's order.

    Raises
    ------
    InputRefused : as :func:`carriers`, and for a circle of joints.
    """
    carrier = carriers(rover)
    children: dict[str | None, list[Body]] = {}
    for body in rover.bodies:
        joint = carrier.get(body.name)
        children.setdefault(None if joint is None else joint.parent, []).append(body)
    ordered: list[tuple[Body, Joint | None]] = []
    waiting = list(reversed(children.get(None, [])))
    while waiting:
        body = waiting.pop()
        ordered.append((body, carrier.get(body.name)))
        waiting.extend(reversed(children.get(body.name, [])))
    if len(ordered) < len(rover.bodies):
        reached = {body.name for body, _ in ordered}
        lost = next(body.name for body in rover.bodies if body.name not in reached)
        raise InputRefused(f"body '{lost}' is carried by a circle of joints; cut one of them and close it with a loop closure")
    return tuple(ordered)


def joint_motion(joint: Joint, position: float) -> Matrix:
    """Displacement (4, 4) of whatever a joint carries, in M, when only this joint leaves zero.

    Hinge: x -> p + R(a, q) (x - p), R = E + sin q [a] + (1 - cos q) [a]^2 (Rodrigues 1840); prismatic: x -> x + q a; the others: x -> x.
    """
    matrix = np.eye(4)
    if joint.kind not in ("hinge", "prismatic"):
        return matrix
    axis = np.asarray(joint.axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    if joint.kind == "prismatic":
        matrix[:3, 3] = position * axis
        return matrix
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 2 sin^2(q/2) rather than 1 - cos q, which cancels at small angles.
    matrix[:3, :3] += np.sin(position) * cross + 2 * np.sin(position / 2) ** 2 * cross @ cross
    point = np.asarray(joint.point, dtype=float)
    matrix[:3, 3] = point - matrix[:3, :3] @ point
    return matrix


def forward_kinematics(rover: Rover, positions: Mapping[str, float]) -> dict[str, Matrix]:
    """Pose X_MB (4, 4) of every body, by name: p_M = X_MB p_B.

    D_child = D_parent motion(joint, q), X_MB = D translation(frame), with the displacement D of a body against the zero pose, at which
    the body frame B is parallel to M with its origin at ``body.frame``. A free root stays at the zero pose.

    Parameters
    ----------
    rover : the mechanism. Differentials, gears and loop closures are not enforced: they are relations between the positions.
    positions : position of hinges [rad] and prismatic joints [m] by name; 0 for those that are not named. Spherical joints stay at zero.

    Raises
    ------
    InputRefused : for a position of a joint that has none or does not exist, one that is not finite, and joints that are no tree.
    """
    names = {joint.name for joint in movable_joints(rover)}
    for name, position in positions.items():
        if name not in names:
            raise InputRefused(f"there is no hinge or prismatic joint '{name}' to position; {nearest_names(name, names)}")
        if not np.isfinite(position):
            raise InputRefused(f"the position of joint '{name}' is {position}; give a finite value")
    displacement: dict[str | None, Matrix] = {None: np.eye(4)}
    poses = {}
    for body, joint in parents_first(rover):
        moved = np.eye(4) if joint is None else displacement[joint.parent] @ joint_motion(joint, positions.get(joint.name, 0.0))
        displacement[body.name] = moved
        pose = moved.copy()
        pose[:3, 3] += moved[:3, :3] @ np.asarray(body.frame, dtype=float)
        poses[body.name] = pose
    return poses


def find_joint(rover: Rover, name: str, subject: str) -> Joint:
    """The joint of a name that ``subject`` mentions.

    Raises
    ------
    InputRefused : if there is none.
    """
    for joint in rover.joints:
        if joint.name == name:
            return joint
    names = [joint.name for joint in rover.joints]
    raise InputRefused(f"{subject} names the joint '{name}', which does not exist; {nearest_names(name, names)}")


def position_sign(rover: Rover, differential: Differential) -> int:
    """Sign s in q_a + s q_b = 0, which a differential asks of the positions of its joints.

    theta_a + theta_b = 2 theta_carrier holds about one common direction: +1 if the axes of the two hinges are parallel, -1 if opposed.

    Raises
    ------
    InputRefused : for unknown joints, joints that are no hinges on its carrier, and axes that are not parallel.
    """
    subject = f"differential '{differential.name}'"
    a, b = (find_joint(rover, name, subject) for name in (differential.joint_a, differential.joint_b))
    for joint in (a, b):
        if joint.kind != "hinge" or joint.parent != differential.carrier:
            raise InputRefused(f"{subject} needs joint '{joint.name}' to be a hinge on its carrier '{differential.carrier}'")
    u, v = np.asarray(a.axis, dtype=float), np.asarray(b.axis, dtype=float)
    cosine = float(u @ v / (np.linalg.norm(u) * np.linalg.norm(v)))
    if abs(cosine) < PARALLEL:
        angle = np.degrees(np.arccos(cosine))
        raise InputRefused(f"{subject} needs parallel hinges, but '{a.name}' and '{b.name}' stand at {angle:.2f} deg; correct an axis")
    return 1 if cosine > 0 else -1
