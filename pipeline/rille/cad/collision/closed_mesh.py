"""Closed bodies (manifold3d) from B-reps and triangles: what collision shapes are cut from.

Cavities that no surface connects with the outside are filled: nothing can get in there to collide.
"""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.collision.symmetry import half_diagonal, without_triangles
from rille.cad.geometry import solids, tessellate, volume_properties
from rille.model import Mesh

Array = NDArray[np.float64]

WELD = 2e-6  # of the size: corners this near are one
SMALL_HOLES = 0.02  # of the surface: holes that are filled
FLAT = 1e-9  # of the size cubed: what encloses less has no volume


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid:
    """A part as triangles.

    vertices : all corners [m], shape (n, 3). triangles : shape (m, 3). bodies : closed, connected bodies (manifold3d.Manifold) without
    cavities; empty where the triangles close nowhere. volume : of the part, exact for a B-rep [m^3]. cavities : volume filled [m^3].
    open_shells : corners of every connected surface that encloses nothing, shape (k, 3) each. size : half the diagonal [m].
    """

    vertices: Array
    triangles: NDArray[np.int64]
    bodies: tuple[Any, ...]
    volume: float
    cavities: float
    open_shells: tuple[Array, ...]
    size: float


def solid_of(part: Any, tolerance: float | None) -> Solid | None:
    """Solid of a TopoDS_Shape or a :class:`rille.model.Mesh`, a B-rep within ``tolerance`` [m] (default 1/1000 of its size).

    None if it has no triangle.
    """
    if isinstance(part, Mesh):
        return _solid([_welded(part.vertices.astype(float), part.triangles)], None)
    size = half_diagonal(part)
    if not size > 0:
        return None
    reach = tolerance or 1e-3 * size
    part = without_triangles(part)  # once for all of it: solids that share a face keep one tessellation
    meshes = [tessellate(solid, reach) for solid in solids(part)] or [tessellate(part, reach)]
    volume = volume_properties(part).volume
    return _solid([_welded(m.vertices.astype(float), m.triangles) for m in meshes if m is not None], volume if volume > 0 else None)


def _solid(meshes: list[tuple[Array, NDArray[np.int64]]], exact: float | None) -> Solid | None:
    meshes = [mesh for mesh in meshes if len(mesh[1])]
    if not meshes:
        return None
    everything = np.concatenate([vertices for vertices, _ in meshes])
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    size = float(np.linalg.norm(np.ptp(everything, axis=0))) / 2
    shells = [(vertices, shell) for vertices, triangles in meshes for shell in _shells(triangles)]
    made = [_closed(vertices, shell, FLAT * size**3) for vertices, shell in shells]
    loose = [vertices[np.unique(shell)] for (vertices, shell), body in zip(shells, made, strict=True) if body is None]
    closed = [body for body in made if body is not None]
    # Faces of a mesh may all point inwards: the largest shell is a body, and what is turned the other way is a cavity.
    outwards = np.sign(max((volume for _, volume in closed), key=abs, default=1.0))
    bodies = [body for body, volume in closed if volume * outwards > 0]
    cavities = sum(abs(volume) for _, volume in closed if volume * outwards < 0)
    enclosed = sum(abs(volume) for _, volume in closed if volume * outwards > 0)
    return Solid(
        vertices=everything,
        triangles=np.concatenate([triangles + start for (_, triangles), start in zip(meshes, starts, strict=False)]),
        bodies=tuple(bodies),
        volume=exact if exact is not None else enclosed - cavities,
        cavities=cavities,
        open_shells=tuple(loose),
        size=size,
    )


def _welded(vertices: Array, triangles: NDArray[Any]) -> tuple[Array, NDArray[np.int64]]:
    """Corners that coincide made one, triangles without area left out."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    used, triangles = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], triangles.reshape(-1, 3)
    near = cKDTree(vertices).query_pairs(WELD * float(np.linalg.norm(np.ptp(vertices, axis=0))), output_type="ndarray")
    count = len(vertices)
    graph = coo_matrix((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(count, count))
    kinds, label = connected_components(graph, directed=False)
    first = np.full(kinds, count)
    np.minimum.at(first, label, np.arange(count))
    triangles = label[triangles].astype(np.int64)
    a, b, c = triangles.T
    return vertices[first], triangles[(a != b) & (b != c) & (c != a)]


def _shells(triangles: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Triangles grouped by what they are connected with over corners."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    count = int(triangles.max()) + 1
    _, label = connected_components(coo_matrix((np.ones(len(start)), (start, end)), shape=(count, count)), directed=False)
    of = label[triangles[:, 0]]
    return [triangles[of == k] for k in np.unique(of)]


def _closed(vertices: Array, triangles: NDArray[np.int64], least: float) -> tuple[Any, float] | None:
    """A closed body and its signed volume (negative: a cavity), or None if the triangles do not close.

    Small holes, which tessellation leaves where edges of a B-rep do not quite meet, are filled.
    """
    used, triangles = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], triangles.reshape(-1, 3)
    filled = _filled(vertices, triangles)
    for points, faces in [(vertices, triangles), *([filled] if filled is not None else [])]:
        corners = (points - points[0])[faces]
        volume = float(np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()) / 6
        body = None if abs(volume) <= least else _manifold(points, faces if volume > 0 else faces[:, ::-1])
        if body is not None:
            return body, volume
    return None


def _manifold(vertices: Array, triangles: NDArray[np.int64]) -> Any | None:
    from manifold3d import Error, Manifold, Mesh64

    mesh = Mesh64(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.uint64))
    body = Manifold(mesh)
    if body.status() != Error.NoError and mesh.merge():
        body = Manifold(mesh)
    return None if body.status() != Error.NoError or body.is_empty() else body


def _filled(vertices: Array, triangles: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]] | None:
    """The triangles with their holes closed by fans; None if there is no hole, or if holes are more than a small part of the surface."""
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    count = len(vertices)
    free = ~np.isin(start * count + end, end * count + start)
    after: dict[int, list[int]] = {}
    for a, b in zip(start[free].tolist(), end[free].tolist(), strict=True):
        after.setdefault(a, []).append(b)
    points, fans = list(vertices), []
    while after:
        loop = [next(iter(after))]
        while loop[-1] in after:
            ends = after[loop[-1]]
            loop.append(ends.pop())
            if not ends:
                del after[loop[-2]]
            if loop[-1] == loop[0]:
                break
        if loop[-1] != loop[0]:
            return None
        points.append(vertices[loop[:-1]].mean(axis=0))
        fans += [(len(points) - 1, b, a) for a, b in itertools.pairwise(loop)]
    if not fans:
        return None
    cloud, faces = np.array(points), np.array(fans)
    if _area(cloud[faces]) > SMALL_HOLES * _area(vertices[triangles]):
        return None
    return cloud, np.concatenate([triangles, faces])


def _area(corners: Array) -> float:
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()) / 2
