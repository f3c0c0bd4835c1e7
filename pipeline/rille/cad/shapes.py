"""One collision shape per body: a cylinder for a wheel, a box around everything else."""

import numpy as np
from numpy.typing import NDArray

from rille.model import CollisionShape, InputRefused, Joint, Pose
from rille.model.rover import Wheel


def wheel_shape(wheel: Wheel, joint: Joint, body: str) -> CollisionShape:
    """Cylinder of the rim, its axis (z of the shape) along the wheel's hinge."""
    axis = np.array(joint.axis)
    z = np.array([0.0, 0.0, 1.0])
    # Shortest rotation from z to the axis: q ~ (1 + z.a, z x a); half a turn about x where they are opposed.
    w = 1.0 + float(z @ axis)
    q = np.array([w, *np.cross(z, axis)]) if w > 1e-9 else np.array([0.0, 1.0, 0.0, 0.0])
    q /= np.linalg.norm(q)
    pose = Pose(position=wheel.center, rotation=(float(q[0]), float(q[1]), float(q[2]), float(q[3])))
    return CollisionShape(body=body, kind="cylinder", pose=pose, size=(wheel.radius, wheel.width), material=wheel.material)


def body_shape(body: str, vertices: NDArray[np.float64]) -> CollisionShape:
    """Axis-parallel box around the vertices (n, 3) of a body in M."""
    if len(vertices) == 0:
        raise InputRefused(f"body '{body}' has no surface to make a collision shape from")
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x, y, z = map(float, (low + high) / 2)
    return CollisionShape(body=body, kind="box", pose=Pose(position=(x, y, z)), size=tuple(map(float, high - low)))
