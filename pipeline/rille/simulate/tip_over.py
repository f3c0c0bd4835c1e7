"""How far a rover is from tipping over: the angle between its weight and the edges of its support.

For each edge between neighbouring wheels, the angle by which the weight would have to turn about it: atan2(d, h), d the distance in plan of
the centre of mass inside the edge, h its height above the edge. The smallest angle counts; below 0 the rover tips. Static: no inertial
forces. Source: Papadopoulos & Rey 1996, "A new measure of tipover stability margin for mobile manipulators", ICRA, with the weight alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.machine import Machine

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Corners:
    """Wheels at the corners of the support, anticlockwise in plan: their places in the list of wheels, and the bodies that they are."""

    wheels: tuple[int, ...]
    bodies: tuple[str, ...]


def support_corners(machine: Machine) -> Corners | None:
    """Of a machine with three wheels or more that do not stand in a line; else None."""
    if len(machine.wheels) < 3:
        return None
    from scipy.spatial import ConvexHull, QhullError

    joints = {joint.name: joint for joint in machine.joints}
    hubs = np.array([joints[wheel.joint].point[:2] for wheel in machine.wheels])
    try:
        order = ConvexHull(hubs).vertices.tolist()  # anticlockwise
    except QhullError:
        return None
    return Corners(wheels=tuple(order), bodies=tuple(joints[machine.wheels[k].joint].child for k in order))


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """mass : (m,) [kg] of bodies. com : (m, 3) [m] from each body's frame, along it. hubs : (n, 3) [m] centres of the wheels at the corners
    in the frames of their bodies. radius : (n,) [m]. bodies, corners : names. axes : (3, 3) rows in W, the last one against gravity.
    """

    bodies: tuple[str, ...]
    mass: Array
    com: Array
    corners: tuple[str, ...]
    hubs: Array
    radius: Array
    axes: Array

    def angles(self, poses: Mapping[str, tuple[Array, Array]]) -> Array:
        """(k,) [rad] smallest angle at each instant. poses : by body, position (k, 3) and quaternion w x y z (k, 4) in W."""
        moment = sum(m * _carried(poses[body], com) for body, m, com in zip(self.bodies, self.mass, self.com, strict=True))
        center = np.asarray(moment) / self.mass.sum()
        feet = np.stack([_carried(poses[body], hub) for body, hub in zip(self.corners, self.hubs, strict=True)])
        feet[:, :, 2] -= self.radius[:, None]
        center, feet = center @ self.axes.T, feet @ self.axes.T
        along = np.roll(feet, -1, axis=0) - feet
        to_center = center - feet
        length = np.hypot(along[..., 0], along[..., 1])
        inside = (along[..., 0] * to_center[..., 1] - along[..., 1] * to_center[..., 0]) / length
        share = np.einsum("ijk,ijk->ij", along[..., :2], to_center[..., :2]) / length**2
        height = to_center[..., 2] - share * along[..., 2]
        return np.arctan2(inside, height).min(axis=0)


def support_of(
    corners: Corners, bodies: Sequence[tuple], wheels: Sequence[tuple], body_states: Array, wheel_states: Array, gravity: Sequence[float]
) -> Support:
    """Support of a machine as it is now.

    bodies, wheels : rows of the simulation's facts. body_states, wheel_states : rows of ``Simulation.bodies()`` and ``wheels()``.
    gravity : (3,) in W [m/s^2]; none: as if it pulled down.
    """
    names = [row[0] for row in bodies]
    poses = {name: (state[:3], state[3:7]) for name, state in zip(names, body_states, strict=True)}
    return Support(
        bodies=tuple(names),
        mass=np.array([row[1] for row in bodies]),
        com=np.array([np.subtract(row[2], row[3]) for row in bodies]),
        corners=corners.bodies,
        hubs=np.array([_own(poses[body], wheel_states[k, :3]) for k, body in zip(corners.wheels, corners.bodies, strict=True)]),
        radius=np.array([wheels[k][2] for k in corners.wheels]),
        axes=_upright(np.asarray(gravity, dtype=np.float64)),
    )


def _upright(gravity: Array) -> Array:
    """Right-handed axes (3, 3), of which the last one points against gravity."""
    size = float(np.linalg.norm(gravity))
    up = -gravity / size if size > 0 else np.array([0.0, 0.0, 1.0])
    ahead = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)  # from the axis that is farthest from it
    ahead /= np.linalg.norm(ahead)
    return np.stack([ahead, np.cross(up, ahead), up])


def _carried(pose: tuple[Array, Array], point: Array) -> Array:
    """A point of a body's frame in W, (k, 3)."""
    place, turn = pose
    return place + _turned(turn, point)


def _own(pose: tuple[Array, Array], point: Array) -> Array:
    """A point of W in a body's frame, (3,)."""
    place, turn = pose
    return _turned((turn * [1, -1, -1, -1])[None], point - place)[0]


def _turned(turn: Array, vector: Array) -> Array:
    """A vector turned by quaternions (k, 4)."""
    w, v = turn[:, :1], turn[:, 1:]
    cross = np.cross(v, vector)
    return vector + 2 * (w * cross + np.cross(v, cross))
