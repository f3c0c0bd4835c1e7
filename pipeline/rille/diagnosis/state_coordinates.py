"""Coordinates of a start state: root and joints, with differentials and gears eliminated, and how a state moves along them.

A state is a row of the simulator: time, root position, quaternion w x y z, velocity, angular velocity, positions and velocities of joints.
Each coordinate has a value and a rate. Rotations are small turns about the axes of W. Joints that a ratio ties together are one coordinate:
position of joint j = factor_j times the coordinate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
N_ROOT = 14  # numbers of a state before those of joints


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinate:
    """kind : ``position`` or ``turn`` of the root about ``axis`` (0 to 2), or ``joint``. factors : joint's place -> factor."""

    kind: str
    name: str
    axis: int = 0
    factors: Mapping[int, float]


def coordinates_of(root: str, joints: Sequence[str], ratios: Sequence[tuple[str, str, float]]) -> tuple[Coordinate, ...]:
    """Coordinates of a model: six of a free root, then one of each group of joints."""
    found: list[Coordinate] = []
    if root:
        found += [Coordinate(kind="position", name=f"{axis} of {root}", axis=k, factors={}) for k, axis in enumerate("xyz")]
        found += [Coordinate(kind="turn", name=f"turn about {axis} of {root}", axis=k, factors={}) for k, axis in enumerate("xyz")]
    tied: dict[str, list[tuple[str, float]]] = {joint: [] for joint in joints}
    for a, b, ratio in ratios:
        if ratio != 0:
            tied[a].append((b, ratio))
            tied[b].append((a, 1 / ratio))
    reached: set[str] = set()
    for joint in joints:
        if joint in reached:
            continue
        factors, open_ends = {joint: 1.0}, [joint]
        while open_ends:
            here = open_ends.pop()
            for other, ratio in tied[here]:
                if other not in factors:
                    factors[other] = factors[here] * ratio
                    open_ends.append(other)
        reached |= set(factors)
        found.append(Coordinate(kind="joint", name=joint, factors={list(joints).index(name): f for name, f in factors.items()}))
    return tuple(found)


def moved(states: Array, coordinates: Sequence[Coordinate], change: Array) -> Array:
    """States (..., n) moved along coordinates: ``change`` (..., n_coordinates, 2) of value and rate."""
    result = states.copy()
    n_joints = (states.shape[-1] - N_ROOT) // 2
    turn = np.zeros((*states.shape[:-1], 3))
    for k, coordinate in enumerate(coordinates):
        value, rate = change[..., k, 0], change[..., k, 1]
        if coordinate.kind == "position":
            result[..., 1 + coordinate.axis] += value
            result[..., 8 + coordinate.axis] += rate
        elif coordinate.kind == "turn":
            turn[..., coordinate.axis] += value
            result[..., 11 + coordinate.axis] += rate
        for place, factor in coordinate.factors.items():
            result[..., N_ROOT + place] += factor * value
            result[..., N_ROOT + n_joints + place] += factor * rate
    result[..., 4:8] = product(exponential(turn), result[..., 4:8])
    return result


def product(a: Array, b: Array) -> Array:
    """Hamilton product of quaternions (..., 4) w x y z."""
    w = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(axis=-1, keepdims=True)
    return np.concatenate([w, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])], axis=-1)


def exponential(turn: Array) -> Array:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    half = 0.5 * np.linalg.norm(turn, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * turn], axis=-1)


def logarithm(quaternion: Array) -> Array:
    """Rotation vectors (..., 3) [rad], at most pi long, of unit quaternions (..., 4)."""
    quaternion = np.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    length = np.linalg.norm(quaternion[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(length, quaternion[..., :1])
    return np.where(length > 1e-12, angle / np.maximum(length, 1e-300), 2.0) * quaternion[..., 1:]


def conjugate(quaternion: Array) -> Array:
    """Inverse of unit quaternions (..., 4)."""
    return quaternion * np.array([1.0, -1.0, -1.0, -1.0])


def angles(quaternion: Array) -> Array:
    """Roll, pitch, yaw (..., 3) [rad] of unit quaternions: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    return np.stack([roll, pitch, np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))], axis=-1)


def from_angles(roll_pitch_yaw: Array) -> Array:
    """Unit quaternions (..., 4) of roll, pitch, yaw (..., 3) [rad]."""
    about = [exponential(np.eye(3)[k] * roll_pitch_yaw[..., k : k + 1]) for k in range(3)]
    return product(about[2], product(about[1], about[0]))


def angle_axes(roll_pitch_yaw: Array) -> Array:
    """(3, 3): columns are the axes of W about which roll, pitch and yaw (3,) turn; angular velocity = this times their rates."""
    _, pitch, yaw = roll_pitch_yaw
    cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
    return np.array([[cos_yaw * np.cos(pitch), -sin_yaw, 0.0], [sin_yaw * np.cos(pitch), cos_yaw, 0.0], [-np.sin(pitch), 0.0, 1.0]])
