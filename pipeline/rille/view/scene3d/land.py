"""Ground and obstacles as nodes of a scene: a fine grid where the machine is, a coarse one around it."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.view.ground import Patch, colors, crop
from rille.view.obstacles import ROCK_GRAY, facets, stated_obstacles
from rille.view.scene3d.glb import Glb, linear, rgb

Array = NDArray[np.float64]
SUN = (-0.55, 0.45, 0.70)  # direction towards it; baked into the ground's colours
FINE, COARSE = 400, 220  # points along a side
MARGIN = 4.0  # [m] of fine ground beyond the path
AROUND = 6.0  # side of the coarse ground in sides of the fine one
LEAST_COARSE = 60.0  # [m]
SINK = 0.02  # of the coarse ground below the fine one where they meet, in postings


def add_ground(glb: Glb, terrain: Terrain, center: Array, reach: float, origin: Array) -> None:
    """Add fine ground within ``reach`` [m] of ``center`` (x, y), coarse ground around it and the stated obstacles."""
    sun = np.array(SUN) / np.linalg.norm(SUN)
    fine = finer(crop(terrain, center, reach, FINE))
    _add(glb, fine, terrain, sun, origin, "terrain")
    wide = crop(terrain, center, max(AROUND * reach, LEAST_COARSE), COARSE)
    if wide.x[0] < fine.x[0] or wide.x[-1] > fine.x[-1] or wide.y[0] > fine.y[0] or wide.y[-1] < fine.y[-1]:
        _add(glb, wide, terrain, sun, origin, "surroundings", hole=fine)
    rocks = [facets(obstacle) for obstacle in stated_obstacles(terrain)]
    if rocks:
        corners = np.concatenate(rocks) - origin
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        triangles = np.arange(3 * len(corners)).reshape(-1, 3)
        mesh = glb.mesh(corners.reshape(-1, 3), triangles, normals=np.repeat(normals, 3, axis=0), material=glb.material(rgb(ROCK_GRAY)))
        glb.node("obstacles", mesh=mesh, extras={"rille": "obstacles", "name": "obstacles"}, top=True)


def finer(patch: Patch) -> Patch:
    """The same ground on ``FINE`` points a side, bilinear, so that ruts have room between the terrain's own points."""
    x, y = np.linspace(patch.x[0], patch.x[-1], FINE), np.linspace(patch.y[0], patch.y[-1], FINE)
    return Patch(x=x, y=y, z=patch.height(x[None, :], y[:, None]))


def _add(glb: Glb, patch: Patch, terrain: Terrain, sun: Array, origin: Array, kind: str, hole: Patch | None = None) -> None:
    rows, columns = patch.z.shape
    x, y = np.meshgrid(patch.x - origin[0], patch.y - origin[1])
    z = patch.z - origin[2]
    k = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.stack([k, k + columns, k + columns + 1, k + 1], axis=1)
    if hole is not None:  # only what lies outside the fine ground, and a rim below it
        inside = (
            (patch.x[None, :] > hole.x[0])
            & (patch.x[None, :] < hole.x[-1])
            & (patch.y[:, None] < hole.y[0])
            & (patch.y[:, None] > hole.y[-1])
        )
        quads = quads[~inside.ravel()[quads].all(axis=1)]
        z = z - np.where(inside, SINK * max(patch.posting), 0.0)
    triangles = np.concatenate([quads[:, [0, 1, 3]], quads[:, [3, 1, 2]]])
    shown = linear(colors(patch, terrain, sun) / 255.0)
    mesh = glb.mesh(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), triangles, colors=shown, material=glb.material(np.ones(3)))
    extras = {"rille": kind, "name": terrain.name}
    if hole is None:
        px, py = patch.posting
        extras |= {
            **{"rows": rows, "columns": columns, "posting_x": px, "posting_y": py},
            **{"x_west": float(patch.x[0] - origin[0]), "y_north": float(patch.y[0] - origin[1])},
        }
    glb.node(terrain.name, mesh=mesh, extras=extras, top=True)
