"""A convex piece of a collision shape, and what pieces enclose together."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import Pose
from rille.model.rotation import matrix_of, quaternion

Array = NDArray[np.float64]

FACETS = 96  # round a cylinder or a sphere where it is taken for a polyhedron


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A convex collision shape in the part's frame; kind, pose, size and vertices as those of a CollisionShape."""

    kind: Literal["box", "sphere", "cylinder", "hull"]
    pose: Pose
    size: tuple[float, ...] = ()
    vertices: Array | None = None


def corners(piece: Piece, *, around: bool = False) -> Array:
    """Points [m] in the part's frame whose hull is the piece, shape (n, 3).

    Of round pieces it is a polyhedron of the same volume, or with ``around`` one that holds the piece.
    """
    return _own_corners(piece, around) @ matrix_of(piece.pose.rotation).T + np.array(piece.pose.position)


def _own_corners(piece: Piece, around: bool) -> Array:
    if piece.kind == "box":
        return np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * np.array(piece.size)
    if piece.kind == "cylinder":
        radius, height = piece.size
        step = 2 * math.pi / FACETS
        # A regular polygon has the area n r^2 sin(2 pi/n) / 2, its sides stand at r cos(pi/n).
        grown = radius / math.cos(step / 2) if around else radius * math.sqrt(step / math.sin(step))
        angles = step * np.arange(FACETS)
        circle = grown * np.column_stack([np.cos(angles), np.sin(angles)])
        return np.concatenate([np.column_stack([circle, np.full(FACETS, z)]) for z in (-height / 2, height / 2)])
    if piece.kind == "sphere":
        return _ball(piece.size[0], around)
    assert piece.vertices is not None  # a hull has vertices
    return piece.vertices


def _ball(radius: float, around: bool) -> Array:
    """Points spread evenly over a sphere (Fibonacci lattice), scaled so that their hull has its volume or holds it."""
    from scipy.spatial import ConvexHull

    k = np.arange(6 * FACETS)
    z = 1 - (2 * k + 1) / len(k)
    angle = k * math.pi * (3 - math.sqrt(5))
    points = np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])
    hull = ConvexHull(points)
    scale = 1 / float(-hull.equations[:, 3].max()) if around else (4 / 3 * math.pi / hull.volume) ** (1 / 3)
    return radius * scale * points


def union_volume(pieces: list[Piece]) -> float:
    """Volume that the pieces enclose together, what they share counted once [m^3]."""
    from manifold3d import Manifold, OpType

    if len(pieces) == 1:
        return _volume(pieces[0])
    hulls = [Manifold.hull_points(np.ascontiguousarray(corners(piece))) for piece in pieces]
    return Manifold.batch_boolean(hulls, OpType.Add).volume() if hulls else 0.0


def _volume(piece: Piece) -> float:
    from scipy.spatial import ConvexHull

    if piece.kind == "box":
        return math.prod(piece.size)
    if piece.kind == "cylinder":
        return math.pi * piece.size[0] ** 2 * piece.size[1]
    if piece.kind == "sphere":
        return 4 / 3 * math.pi * piece.size[0] ** 3
    return float(ConvexHull(_own_corners(piece, around=False)).volume)


def moved(piece: Piece, rotation: Array, shift: Array) -> Piece:
    """The piece at x -> rotation x + shift; it shares its vertices with the first."""
    x, y, z = map(float, rotation @ np.array(piece.pose.position) + shift)
    pose = Pose(position=(x, y, z), rotation=quaternion(rotation @ matrix_of(piece.pose.rotation)))
    return Piece(kind=piece.kind, pose=pose, size=piece.size, vertices=piece.vertices)
