"""Rotations as matrices and quaternions."""

import math

import numpy as np
from numpy.typing import NDArray

from rille.model import Pose

Matrix = NDArray[np.float64]

# Rotations that bring the drawing's up axis to z.
UP: dict[str, Matrix] = {
    "z": np.eye(3),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]),
    "-y": np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]),
    "x": np.array([[0, 0, -1.0], [0, 1.0, 0], [1.0, 0, 0]]),
    "-x": np.array([[0, 0, 1.0], [0, 1.0, 0], [-1.0, 0, 0]]),
}


def quaternion(rotation: Matrix) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z), w >= 0, of a rotation matrix (3, 3) (Shepperd 1978)."""
    trace = float(np.trace(rotation))
    candidates = [trace, *(float(rotation[i, i]) for i in range(3))]
    k = int(np.argmax(candidates))
    q = np.empty(4)
    q[k] = math.sqrt(max(1.0 + 2.0 * candidates[k] - trace, 0.0)) / 2
    skew = (rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1])
    if k == 0:
        q[1:] = np.array(skew) / (4 * q[0])
    else:
        i = k - 1
        q[0] = skew[i] / (4 * q[k])
        for j in range(3):
            if j != i:
                q[1 + j] = (rotation[i, j] + rotation[j, i]) / (4 * q[k])
    q /= np.linalg.norm(q)
    if q[0] < 0:
        q = -q
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])


def matrix_of(q: tuple[float, float, float, float] | Matrix) -> Matrix:
    """Rotation matrix (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def from_rpy(roll: float, pitch: float, yaw: float) -> Matrix:
    """R = Rz(yaw) Ry(pitch) Rx(roll), the convention of URDF."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def pose_of(matrix: Matrix) -> Pose:
    """Pose of a homogeneous matrix (4, 4)."""
    x, y, z = map(float, matrix[:3, 3])
    return Pose(position=(x, y, z), rotation=quaternion(matrix[:3, :3]))


def pose_matrix(pose: Pose) -> Matrix:
    """Homogeneous matrix (4, 4) of a pose."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = matrix_of(pose.rotation), pose.position
    return matrix
