"""Convex solids as meshes: obstacles, collision shapes."""

import numpy as np
from numpy.typing import NDArray

from rille.model import CollisionShape, Obstacle, Terrain
from rille.model.rotation import matrix_of
from rille.view.drawing import Item

Array = NDArray[np.float64]

ROCK_GRAY = "#6f6a64"


def hull_points(obstacle: Obstacle | CollisionShape) -> Array:
    """Points (n, 3) [m], in the frame it is posed in, whose convex hull is the solid; round shapes in 24 segments."""
    if obstacle.kind == "hull":
        assert obstacle.vertices is not None
        points = obstacle.vertices
    elif obstacle.kind == "box":
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        points = signs * np.array(obstacle.size) / 2
    else:
        around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        if obstacle.kind == "cylinder":
            ring = np.column_stack([np.cos(around), np.sin(around)]) * obstacle.size[0]
            points = np.concatenate([np.column_stack([ring, np.full(24, s * obstacle.size[1] / 2)]) for s in (-1, 1)])
        else:
            polar = np.linspace(0, np.pi, 13)
            directions = [np.column_stack([np.sin(p) * np.cos(around), np.sin(p) * np.sin(around), np.full(24, np.cos(p))]) for p in polar]
            points = obstacle.size[0] * np.unique(np.round(np.concatenate(directions), 9), axis=0)
    return points @ matrix_of(np.array(obstacle.pose.rotation)).T + np.array(obstacle.pose.position)


def facets(solid: Obstacle | CollisionShape) -> Array:
    """Triangles (m, 3, 3) [m] of a convex solid, counter-clockwise from outside; each has its own corners, so that edges stay edges."""
    from scipy.spatial import ConvexHull

    points = hull_points(solid)
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flip = (outward * hull.equations[:, :3]).sum(axis=1) < 0
    corners[flip] = corners[flip][:, ::-1]
    return corners


def facet_item(corners: Array, color: str, opacity: float = 1.0) -> Item:
    """Facets (m, 3, 3) as a mesh."""
    return Item(vertices=corners.reshape(-1, 3), triangles=np.arange(3 * len(corners)).reshape(-1, 3), color=color, opacity=opacity)


def stated_obstacles(terrain: Terrain) -> list[Obstacle]:
    """Obstacles but for the collision bodies ("rocks_17") of a population's rocks, which the ground itself shows."""
    populations = {population.name for population in terrain.populations}
    return [o for o in terrain.obstacles if not (o.name.rpartition("_")[2].isdigit() and o.name.rpartition("_")[0] in populations)]


def obstacle_items(terrain: Terrain, center: Array | None = None, reach: float = np.inf) -> list[Item]:
    """The stated obstacles of a terrain, within ``reach`` [m] of ``center`` (x, y), as one mesh; none if there is none."""
    chosen = stated_obstacles(terrain)
    if center is not None:
        chosen = [o for o in chosen if np.linalg.norm(np.array(o.pose.position[:2]) - center) < reach]
    return [facet_item(np.concatenate([facets(obstacle) for obstacle in chosen]), ROCK_GRAY)] if chosen else []
