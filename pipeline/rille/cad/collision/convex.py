"""Convex hulls of points, and hulls of few vertices around them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDS = 12  # of pushing facets outwards


def hull_of(points: Array) -> Any | None:
    """scipy.spatial.ConvexHull of points, shape (n, 3); None if they lie in a plane (or are fewer than 4)."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 4:
        return None
    try:
        return ConvexHull(points)
    except QhullError:
        return None


def few_vertices(points: Array, most: int, tolerance: float) -> Array | None:
    """At most ``most`` points whose hull holds the given ones within ``tolerance`` [m], shape (k, 3); None for points in a plane.

    A hull of few vertices stands out a little and never in. Two are made and the smaller is returned: one of facets of the full hull,
    clipped (flat bodies with round edges), and one of its corners, pushed outwards (round bodies).
    """
    full = hull_of(points)
    if full is None:
        return None
    corners = points[full.vertices]
    if len(corners) <= most:
        return corners
    made = [_pushed(_farthest(corners, most, tolerance), corners, tolerance), *_clipped(full, corners, most, tolerance)]
    return min((vertices for vertices in made if len(vertices) <= most), key=_volume)


def _volume(vertices: Array) -> float:
    hull = hull_of(vertices)
    return np.inf if hull is None else float(hull.volume)


def _farthest(corners: Array, most: int, tolerance: float) -> Array:
    """Corners chosen one by one, always the one that stands farthest out of the hull of those before."""
    chosen = _spread(corners, most)
    hull = hull_of(corners[chosen])
    while hull is not None and len(chosen) < most:
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        worst = int(np.argmax(outside))
        if outside[worst] <= 0.5 * tolerance:
            break
        chosen.append(worst)
        hull = hull_of(corners[chosen])
    return corners[chosen]


def _clipped(full: Any, corners: Array, most: int, tolerance: float) -> list[Array]:
    """Vertices of the body that a few planes of the full hull bound: always the one that cuts off the tip which stands out most.

    Empty where even a box has more vertices than allowed.
    """
    from scipy.spatial import HalfspaceIntersection

    middle = corners.mean(axis=0)
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    planes = np.column_stack([normals, -(corners @ normals.T).max(axis=0)])
    best: list[Array] = []
    while True:
        tips = _unique(HalfspaceIntersection(planes, middle).intersections, 1e-3 * tolerance)
        if len(tips) > most:
            return best
        best = [tips]
        outside = tips @ full.equations[:, :3].T + full.equations[:, 3]
        tip, facet = np.unravel_index(int(np.argmax(outside)), outside.shape)
        if outside[tip, facet] <= 0.5 * tolerance:
            return best
        planes = np.concatenate([planes, full.equations[None, facet]])


def _unique(points: Array, near: float) -> Array:
    """Points without those that repeat another."""
    _, first = np.unique(np.round(points / near), axis=0, return_index=True)
    return points[first]


def _spread(corners: Array, most: int) -> list[int]:
    """The extremes along 13 directions: a start that is no plane."""
    directions = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)], float)
    along = (corners - corners.mean(axis=0)) @ directions.T
    extremes = list(dict.fromkeys([*map(int, along.argmax(axis=0)), *map(int, along.argmin(axis=0))]))
    return extremes[: max(most, 4)]


def _pushed(vertices: Array, corners: Array, tolerance: float) -> Array:
    """Vertices moved outwards until no corner stands out of their hull by more than the tolerance."""
    vertices = vertices.copy()
    for _ in range(ROUNDS):
        hull = hull_of(vertices)
        if hull is None:
            break
        stands_out = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=0)
        if stands_out.max() <= 0.5 * tolerance:
            break
        moves = np.zeros_like(vertices)
        for facet in np.argsort(-stands_out):
            if stands_out[facet] <= 0:
                break
            normal = hull.equations[facet, :3]
            for i in hull.simplices[facet]:
                moves[i] += max(stands_out[facet] - normal @ moves[i], 0.0) * normal
        vertices += moves
    hull = hull_of(vertices)
    return vertices if hull is None else vertices[hull.vertices]


def outside_by(points: Array, hulls: list[Array]) -> Array:
    """How far each point, shape (n, 3), stands outside of the nearest of some convex hulls (their vertices) [m]; 0 inside, shape (n,)."""
    least = np.full(len(points), np.inf)
    for vertices in hulls:
        hull = hull_of(vertices)
        if hull is None:
            continue
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        gap = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0), axis=1)
        near = np.flatnonzero((gap < least) & (least > 0))
        if len(near):
            stands_out = (points[near] @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
            least[near] = np.minimum(least[near], np.maximum(np.maximum(stands_out, gap[near]), 0))
    return least
