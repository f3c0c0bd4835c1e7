"""Where a part is at a moment of a run."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rille.model import Body, BodyTrace, Mesh, PartInstance, Rover
from rille.model.rotation import matrix_of

Array = NDArray[np.float64]


def placed_meshes(rover: Rover) -> Iterator[tuple[str, Mesh, Array]]:
    """Every visual mesh of the bodies: the body's name, the mesh, and its vertices (n, 3) [m] in M at the zero pose."""
    parts = {part.name: part for part in rover.parts}
    for instance in rover.instances:
        if instance.body is None:
            continue
        for mesh in parts[instance.part].meshes:
            if mesh.purpose == "visual":
                yield instance.body, mesh, in_model(mesh.vertices.astype(float), instance)


def in_model(vertices: Array, instance: PartInstance) -> Array:
    """Vertices (n, 3) of a part, in M at the zero pose."""
    return vertices @ matrix_of(instance.pose.rotation).T + np.array(instance.pose.position)


def to_world(vertices: Array, instance: PartInstance, body: Body, trace: BodyTrace, index: int) -> Array:
    """Vertices (n, 3) of a part, in W at stored time ``index``.

    p_W = p_WB + R_WB (R_MI v + p_MI - p_MB): the instance is placed in M at the zero pose, where the body frame B is parallel to M
    with its origin at ``body.frame``.
    """
    in_body = in_model(vertices, instance) - np.array(body.frame)
    return in_body @ matrix_of(trace.rotation[index]).T + trace.position[index]
