"""Closed solids (Manifold, Lalish 2023) of triangle meshes, for exact unions, intersections, volumes and gaps."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rille.model import Mesh

if TYPE_CHECKING:
    from manifold3d import Manifold

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]

MOST_TRIANGLES = 200_000
"""Where finding the distance of two surfaces is given up for the best that is known."""


def closed_solid(vertices: Array, triangles: Triangles, tolerance: float) -> "Manifold | None":
    """The solid within a mesh; None if the mesh does not close within its tolerance [m].

    Meshes of CAD faces share no vertices; they are welded, first exactly, then within growing distances up to the tolerance; at last
    small holes are filled.
    """
    from manifold3d import Error, Manifold, Mesh64, OpType

    extent = float(np.ptp(vertices, axis=0).max()) if len(vertices) else 0.0
    for distance in (0.0, 1e-6 * extent, 0.3 * tolerance):
        points, corners = _welded(vertices, triangles, distance)
        if len(corners) < 4:
            continue
        for sense in (corners, corners[:, ::-1]):
            mesh = Mesh64(points, np.ascontiguousarray(sense).astype(np.uint64), tolerance=distance)
            mesh.merge()
            solid = Manifold(mesh)
            if solid.status() != Error.NoError or solid.is_empty() or solid.volume() > 0:
                break
        if solid.status() != Error.NoError or solid.is_empty():
            continue
        shells = solid.decompose()
        if len(shells) > 1 and all(shell.volume() > 0 for shell in shells):
            solid = Manifold.batch_boolean(shells, OpType.Add)  # solids of one part that overlap count once
        if solid.volume() > 1e-9 * extent**3:
            return solid
    return _mended(vertices, triangles, tolerance)


def _mended(vertices: Array, triangles: Triangles, tolerance: float) -> "Manifold | None":
    """The solid when small holes are filled; None if more than that is missing."""
    from manifold3d import Manifold, OpType

    from rille.cad.collision.closed_mesh import solid_of

    part = solid_of(Mesh(vertices=vertices.astype(np.float32), triangles=triangles.astype(np.int32), tolerance=tolerance), None)
    if part is None or not part.bodies or part.open_shells:
        return None
    return Manifold.batch_boolean(list(part.bodies), OpType.Add)


def hull_solid(vertices: Array) -> "Manifold | None":
    """Convex hull as a solid; None for a flat cloud."""
    from manifold3d import Manifold

    solid = Manifold.hull_points(np.ascontiguousarray(vertices))
    return None if solid.is_empty() or solid.volume() <= 0 else solid


def solid_gap(a: "Manifold", b: "Manifold", reach: float) -> float:
    """Distance between two solids [m], at most ``reach``; 0 where they overlap.

    Only what lies within reach of the other's bounding box is looked at.
    """
    from manifold3d import Manifold

    boxes = np.array([a.bounding_box(), b.bounding_box()])
    low, high = boxes[:, :3].max(axis=0) - reach, boxes[:, 3:].min(axis=0) + reach
    if (low >= high).any():
        return reach
    room = Manifold.cube((high - low).tolist()).translate(low.tolist())
    near_a, near_b = a ^ room, b ^ room
    return reach if near_a.is_empty() or near_b.is_empty() else float(near_a.min_gap(near_b, reach))


def surface_gap(a: tuple[Array, Triangles], b: tuple[Array, Triangles], reach: float, enough: float = 0.0) -> float:
    """Distance between two open surfaces [m], at most ``reach``: never below the true one, and within 2 % of it.

    Triangles that can hold the nearest points are split until they are small (branch and bound: distance of two middles less both radii).
    The first distance up to ``enough`` is taken.
    """
    from scipy.spatial import KDTree

    low = np.maximum(a[0].min(axis=0), b[0].min(axis=0)) - reach
    high = np.minimum(a[0].max(axis=0), b[0].max(axis=0)) + reach
    sides = [_near(vertices[triangles], low, high) for vertices, triangles in (a, b)]
    found = reach
    while all(len(side) for side in sides):
        middles = [side.mean(axis=1) for side in sides]
        radii = [np.linalg.norm(side - middle[:, None], axis=2).max(axis=1) for side, middle in zip(sides, middles, strict=True)]
        apart = [KDTree(middles[1 - k]).query(middles[k])[0] for k in (0, 1)]
        found = min(found, float(apart[0].min()))
        largest = [float(r.max()) for r in radii]
        if found <= enough or sum(largest) <= max(0.02 * found, 1e-6) or sum(map(len, sides)) > MOST_TRIANGLES:
            break
        kept = [apart[k] - radii[k] - largest[1 - k] <= found for k in (0, 1)]
        sides = [_split(sides[k][kept[k]], radii[k][kept[k]] > 0.5 * max(largest)) for k in (0, 1)]
    return found


def _near(corners: Array, low: Array, high: Array) -> Array:
    """Triangles (k, 3, 3) that a box may hold a part of."""
    return corners[((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)]


def _welded(points: Array, corners: Triangles, distance: float) -> tuple[Array, Triangles]:
    vertices, place = np.unique(points, axis=0, return_inverse=True)
    place = place.reshape(-1)
    if distance > 0:
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import KDTree

        pairs = KDTree(vertices).query_pairs(distance, output_type="ndarray")
        graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(vertices),) * 2)
        _, group = connected_components(graph, directed=False)
        _, first = np.unique(group, return_index=True)
        vertices, place = vertices[first], group[place]
    triangles = place[corners]
    proper = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2]) & (triangles[:, 2] != triangles[:, 0])
    return np.ascontiguousarray(vertices), triangles[proper]


def _split(corners: Array, chosen: NDArray[np.bool_]) -> Array:
    """Triangles (k, 3, 3), the chosen ones cut into four at the middles of their edges."""
    a, b, c = np.moveaxis(corners[chosen], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    quarters = [np.stack(corner, axis=1) for corner in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate([corners[~chosen], *quarters])
