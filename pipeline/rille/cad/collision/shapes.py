"""Collision shapes of bodies: a cylinder for a wheel; for everything else what the sheet asks for."""

from collections.abc import Iterable

import numpy as np

from rille.cad.collision.decompose import Method
from rille.cad.collision.kept_pieces import mesh_digest, pieces_of
from rille.cad.component import Placed
from rille.model import CollisionShape, Joint, Mesh, Pose
from rille.model.rotation import pose_matrix, pose_of
from rille.model.rover import Wheel

WHOLE = ("box", "hull")
"""Methods that put one shape around a whole body; the others look at each of its parts."""


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


def body_shapes(body: str, members: Iterable[Placed], method: Method, tolerance: float) -> tuple[CollisionShape, ...]:
    """Shapes of a body in M.

    method : see :func:`rille.cad.collision.decompose.decompose`; "box" and "hull" enclose the whole body, the others go part by part.
    """
    if method == "none":
        return ()
    if method in WHOLE:
        whole = body_mesh(members, tolerance)
        if whole is None:
            return ()
        return tuple(_shape(body, piece, np.eye(4)) for piece in pieces_of(mesh_digest(whole), lambda: whole, method, tolerance).pieces)
    return tuple(_shape(body, piece, p.matrix) for p in members for piece in p.component.pieces(method, tolerance).pieces)


def body_mesh(members: Iterable[Placed], tolerance: float) -> Mesh | None:
    """All visual meshes of a body in M as one; None if it has none."""
    vertices, triangles, count = [], [], 0
    for p in members:
        mesh = p.component.mesh(tolerance)
        if mesh is None:
            continue
        vertices.append(mesh.vertices @ p.matrix[:3, :3].T + p.matrix[:3, 3])
        triangles.append(mesh.triangles + count)
        count += len(mesh.vertices)
    if not vertices:
        return None
    return Mesh(
        vertices=np.concatenate(vertices).astype(np.float32), triangles=np.concatenate(triangles).astype(np.int32), tolerance=tolerance
    )


def _shape(body: str, piece, matrix: np.ndarray) -> CollisionShape:
    return CollisionShape(
        body=body, kind=piece.kind, pose=pose_of(matrix @ pose_matrix(piece.pose)), size=piece.size, vertices=piece.vertices
    )
