"""Decompositions that are made once and kept by the content of what they were made of."""

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np

from rille.cad.collision.decompose import Decomposition, Method, decompose
from rille.cad.collision.pieces import Piece
from rille.cad.files import cache
from rille.model import Mesh, Pose


def pieces_of(digest: str, part: Callable[[], Any], method: Method, tolerance: float) -> Decomposition:
    """Collision pieces of what ``part`` fetches (TopoDS_Shape or Mesh), kept under the digest of its geometry."""
    key = f"collision {digest} {method} {tolerance!r}"
    kept = cache.get(key)
    if kept is not None:
        return _unpacked(kept)
    made = decompose(part(), method, tolerance=tolerance)
    cache.put(key, _packed(made))
    return made


def mesh_digest(mesh: Mesh) -> str:
    """SHA-256 of the vertices and triangles."""
    return hashlib.sha256(mesh.vertices.tobytes() + mesh.triangles.tobytes()).hexdigest()


def _packed(made: Decomposition) -> dict[str, np.ndarray]:
    clouds = [np.zeros((0, 3)) if p.vertices is None else p.vertices for p in made.pieces]
    return {
        "kinds": np.array([p.kind for p in made.pieces], dtype="U8"),
        "poses": np.array([[*p.pose.position, *p.pose.rotation] for p in made.pieces]).reshape(-1, 7),
        "sizes": np.array([[*p.size, *[np.nan] * (3 - len(p.size))] for p in made.pieces]).reshape(-1, 3),
        "counts": np.array([len(cloud) for cloud in clouds], dtype=int),
        "vertices": np.concatenate([np.zeros((0, 3)), *clouds]),
        "method": np.array(made.method),
        "numbers": np.array([made.volume_ratio, made.outside]),
        "notes": np.array(made.notes, dtype=str),
    }


def _unpacked(kept: dict[str, np.ndarray]) -> Decomposition:
    clouds = np.split(kept["vertices"], np.cumsum(kept["counts"])[:-1]) if len(kept["counts"]) else []
    pieces = tuple(
        Piece(
            kind=str(kind),  # type: ignore[arg-type]
            pose=Pose(position=tuple(pose[:3].tolist()), rotation=tuple(pose[3:].tolist())),
            size=tuple(v for v in size.tolist() if v == v),
            vertices=cloud if len(cloud) else None,
        )
        for kind, pose, size, cloud in zip(kept["kinds"], kept["poses"], kept["sizes"], clouds, strict=True)
    )
    ratio, outside = kept["numbers"].tolist()
    notes = tuple(str(note) for note in kept["notes"])
    return Decomposition(pieces=pieces, method=str(kept["method"]), volume_ratio=ratio, outside=outside, notes=notes)
