"""Where a part is at a moment of a run."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Body, BodyTrace, PartInstance
from rille.model.rotation import matrix_of

Array = NDArray[np.float64]


def to_world(vertices: Array, instance: PartInstance, body: Body, trace: BodyTrace, index: int) -> Array:
    """Vertices (n, 3) of a part, in W at stored time ``index``.

    p_W = p_WB + R_WB (R_MI v + p_MI - p_MB): the instance is placed in M at the zero pose, where the body frame B is parallel to M
    with its origin at ``body.frame``.
    """
    in_body = vertices @ matrix_of(instance.pose.rotation).T + np.array(instance.pose.position) - np.array(body.frame)
    return in_body @ matrix_of(trace.rotation[index]).T + trace.position[index]
