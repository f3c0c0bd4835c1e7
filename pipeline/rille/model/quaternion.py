"""Many orientations at once: unit quaternions (..., 4) w x y z, and roll, pitch and yaw: R = Rz(yaw) Ry(pitch) Rx(roll)."""

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import ANGLES

Array = NDArray[np.float64]


def unit(quaternion: Array) -> Array:
    """Quaternions (..., 4) at length 1."""
    return quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)


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


def angle_of(quaternion: Array, component: str) -> Array:
    """Roll, pitch or yaw (...,) [rad] of unit quaternions."""
    return angles(quaternion)[..., ANGLES.index(component)]


def into_body(quaternion: Array, vector: Array) -> Array:
    """Vectors (m, 3) of W in the axes of bodies with quaternions (m, 4): R^T v."""
    w, axis = quaternion[:, :1], -quaternion[:, 1:]
    across = 2 * np.cross(axis, vector)
    return vector + w * across + np.cross(axis, across)
