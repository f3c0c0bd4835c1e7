"""Convex solids (obstacles, collision shapes) as triangles."""

import numpy as np
from numpy.typing import NDArray

from rille.model.rotation import matrix_of
from rille.model.rover import CollisionShape
from rille.model.terrain import Obstacle, Terrain

Array = NDArray[np.float64]


def stated_obstacles(terrain: Terrain) -> list[Obstacle]:
    """Obstacles but for the collision bodies ("rocks_17") of a population's rocks, which the ground itself shows."""
    populations = {population.name for population in terrain.populations}
    return [o for o in terrain.obstacles if not (o.name.rpartition("_")[2].isdigit() and o.name.rpartition("_")[0] in populations)]


def own_points(solid: Obstacle | CollisionShape) -> Array:
    """Points (n, 3) [m] from its centre, in its own axes, whose convex hull is the solid; round shapes in 24 segments."""
    if solid.kind == "hull":
        assert solid.vertices is not None
        return np.asarray(solid.vertices, np.float64)
    if solid.kind == "box":
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        return signs * np.array(solid.size) / 2
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    if solid.kind == "cylinder":
        ring = np.column_stack([np.cos(around), np.sin(around)]) * solid.size[0]
        return np.concatenate([np.column_stack([ring, np.full(24, s * solid.size[1] / 2)]) for s in (-1, 1)])
    polar = np.linspace(0, np.pi, 13)
    directions = [np.column_stack([np.sin(p) * np.cos(around), np.sin(p) * np.sin(around), np.full(24, np.cos(p))]) for p in polar]
    return np.asarray(solid.size[0] * np.unique(np.round(np.concatenate(directions), 9), axis=0), np.float64)


def hull_points(solid: Obstacle | CollisionShape) -> Array:
    """The same points in the frame that the solid is posed in."""
    return own_points(solid) @ matrix_of(np.array(solid.pose.rotation)).T + np.array(solid.pose.position)


def hull_triangles(points: Array) -> NDArray[np.int64]:
    """Triangles (m, 3) of the convex hull of points (n, 3): numbers of points, counter-clockwise from outside."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    triangles = np.array(hull.simplices, np.int64)
    corners = points[triangles]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inverted = (outward * hull.equations[:, :3]).sum(axis=1) < 0
    triangles[inverted] = triangles[inverted][:, ::-1]
    return triangles


def facets(solid: Obstacle | CollisionShape) -> Array:
    """Triangles (m, 3, 3) [m] of a convex solid where it is posed; each has its own corners, so that edges stay edges."""
    points = hull_points(solid)
    return points[hull_triangles(points)]
