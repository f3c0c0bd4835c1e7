"""Where a part is at a moment of a run."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Body, BodyTrace, PartInstance

Array = NDArray[np.float64]


def rotation_matrix(quaternion: Array | tuple[float, float, float, float]) -> Array:
    """Rotation (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def to_world(vertices: Array, instance: PartInstance, body: Body, trace: BodyTrace, index: int) -> Array:
    """Vertices (n, 3) of a part, in W at stored time ``index``.

    p_W = p_WB + R_WB (R_MI v + p_MI - p_MB): the instance is placed in M at the zero pose, where the body frame B is parallel to M
    with its origin at ``body.frame``.
    """
    in_body = vertices @ rotation_matrix(instance.pose.rotation).T + np.array(instance.pose.position) - np.array(body.frame)
    return in_body @ rotation_matrix(trace.rotation[index]).T + trace.position[index]
