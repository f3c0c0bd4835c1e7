"""The smallest box, sphere or cylinder around a body, and by how much its volume exceeds the body's."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.cad.collision.convex import hull_of
from rille.cad.collision.pieces import Piece
from rille.cad.collision.symmetry import frame_along
from rille.model import Pose
from rille.model.rotation import quaternion
from rille.model.rover import Vector

Array = NDArray[np.float64]

DIRECTIONS = 6  # of the hull's faces, by area, that may be an edge of the box or the axis of the cylinder
PREFERRED = 1.005  # an axis-parallel box wins over one that is smaller by less


@dataclass(frozen=True, slots=True, kw_only=True)
class Primitive:
    """A primitive around a body. error : its volume less the body's, relative to the body's volume."""

    piece: Piece
    volume: float
    error: float


def smallest_primitive(points: Array, volume: float, kinds: tuple[str, ...] = ("box", "cylinder", "sphere")) -> Primitive | None:
    """The smallest primitive that holds all points.

    Parameters
    ----------
    points : corners of the body's surface [m], shape (n, 3). On round surfaces they lie on the surface itself, so the radius is exact.
    volume : of the body [m^3].

    Returns
    -------
    The primitive with the least volume; None for points in a plane. Boxes and cylinders are tried along the normals of the hull's
    largest faces, the principal axes of the hull and the part's own axes. Centres of spheres and circles are fitted by least squares
    (Kasa 1976) to the corners of the hull, which is exact where the body is what is looked for.
    """
    hull = hull_of(points)
    if hull is None:
        return None
    corners = points[hull.vertices]
    directions = _directions(points, hull)
    found = []
    if "box" in kinds:
        found.append(_box(corners, directions))
    if "cylinder" in kinds:
        found.append(min((_cylinder(corners, axis) for axis in directions), key=lambda made: made[1]))
    if "sphere" in kinds:
        found.append(_sphere(corners))
    piece, enclosed = min(found, key=lambda made: made[1])
    return Primitive(piece=piece, volume=enclosed, error=enclosed / volume - 1 if volume > 0 else float("inf"))


def _directions(points: Array, hull) -> list[Array]:
    """Unit vectors: the part's axes, the normals of the hull's largest faces, its principal axes."""
    areas = np.linalg.norm(
        np.cross(points[hull.simplices[:, 1]] - points[hull.simplices[:, 0]], points[hull.simplices[:, 2]] - points[hull.simplices[:, 0]]),
        axis=1,
    )
    normals = hull.equations[:, :3]
    normals = normals * np.where(normals[np.arange(len(normals)), np.argmax(np.abs(normals), axis=1)] > 0, 1.0, -1.0)[:, None]
    _, first, inverse = np.unique(np.round(normals, 4), axis=0, return_index=True, return_inverse=True)
    total = np.bincount(inverse.ravel(), areas, len(first))
    faces = [normals[first[i]] for i in np.argsort(-total)[:DIRECTIONS]]
    middles = points[hull.simplices].mean(axis=1)
    offsets = middles - np.average(middles, axis=0, weights=areas)
    principal = np.linalg.eigh(np.einsum("f,fi,fj->ij", areas, offsets, offsets))[1].T
    return [*np.eye(3), *faces, *principal]


def _box(corners: Array, directions: list[Array]) -> tuple[Piece, float]:
    frames = [np.eye(3)]
    for z, other in itertools.product(directions[3 : 3 + DIRECTIONS], directions):
        x = other - (other @ z) * z
        length = math.sqrt(x @ x)
        if length > 0.99:  # across already
            x = x / length
            y = (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0])
            frames.append(np.array([x, y, z]))
    along = corners @ np.concatenate(frames).T
    volumes = np.ptp(along, axis=0).reshape(-1, 3).prod(axis=1)
    best = 0 if volumes[0] <= PREFERRED * volumes.min() else int(np.argmin(volumes))
    frame, along = frames[best], along[:, 3 * best : 3 * best + 3]
    low, high = along.min(axis=0), along.max(axis=0)
    pose = Pose(position=_vector((low + high) / 2 @ frame), rotation=quaternion(frame.T))
    return Piece(kind="box", pose=pose, size=tuple(map(float, high - low))), float(volumes[best])


def _cylinder(corners: Array, axis: Array) -> tuple[Piece, float]:
    frame = frame_along(axis)
    along = corners @ frame.T
    low, high = float(along[:, 2].min()), float(along[:, 2].max())
    center = _circle_center(along[:, :2])
    radius = float(np.linalg.norm(along[:, :2] - center, axis=1).max())
    position = np.array([*center, (low + high) / 2]) @ frame
    piece = Piece(kind="cylinder", pose=Pose(position=_vector(position), rotation=quaternion(frame.T)), size=(radius, high - low))
    return piece, float(np.pi * radius**2 * (high - low))


def _sphere(corners: Array) -> tuple[Piece, float]:
    center = _circle_center(corners)
    radius = float(np.linalg.norm(corners - center, axis=1).max())
    return Piece(kind="sphere", pose=Pose(position=_vector(center)), size=(radius,)), 4 / 3 * np.pi * radius**3


def _circle_center(points: Array) -> Array:
    """Centre of the circle or sphere, |p|^2 = 2 c.p + k, through points, by least squares."""
    middle = points.mean(axis=0)
    offsets = points - middle
    matrix = np.column_stack([2 * offsets, np.ones(len(offsets))])
    solution = np.linalg.lstsq(matrix, (offsets**2).sum(axis=1), rcond=None)[0]
    return middle + solution[:-1]


def _vector(values: Array) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
