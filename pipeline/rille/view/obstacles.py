"""Convex solids as meshes to be drawn: obstacles, collision shapes."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.solid_mesh import facets, hull_points, stated_obstacles
from rille.view.drawing import Item

__all__ = ["ROCK_GRAY", "facet_item", "facets", "hull_points", "obstacle_items", "stated_obstacles"]

Array = NDArray[np.float64]

ROCK_GRAY = "#6f6a64"


def facet_item(corners: Array, color: str, opacity: float = 1.0) -> Item:
    """Facets (m, 3, 3) as a mesh."""
    return Item(vertices=corners.reshape(-1, 3), triangles=np.arange(3 * len(corners)).reshape(-1, 3), color=color, opacity=opacity)


def obstacle_items(terrain: Terrain, center: Array | None = None, reach: float = np.inf) -> list[Item]:
    """The stated obstacles of a terrain, within ``reach`` [m] of ``center`` (x, y), as one mesh; none if there is none."""
    chosen = stated_obstacles(terrain)
    if center is not None:
        chosen = [o for o in chosen if np.linalg.norm(np.array(o.pose.position[:2]) - center) < reach]
    return [facet_item(np.concatenate([facets(obstacle) for obstacle in chosen]), ROCK_GRAY)] if chosen else []
