"""The ground as a picture: a cropped, decimated grid with sunlight, cast shadows and soils in its colours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.grid import bilinear

Array = NDArray[np.float64]

REGOLITH = np.array([0.62, 0.60, 0.57])
PATCH_TINTS = (np.array([0.64, 0.57, 0.48]), np.array([0.52, 0.57, 0.62]), np.array([0.56, 0.60, 0.52]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A piece of ground. x (n_cols,), y (n_rows,) descending, z (n_rows, n_cols) [m]."""

    x: Array
    y: Array
    z: Array

    @property
    def posting(self) -> tuple[float, float]:
        """Distances of columns and rows [m]."""
        return float(self.x[1] - self.x[0]), float(self.y[0] - self.y[1])

    def height(self, x: Array, y: Array) -> Array:
        """Bilinear height [m], clamped to the border."""
        return bilinear(self.z, (float(self.x[0]), float(self.y[0])), self.posting, x, y, clamp=True)


def crop(terrain: Terrain, center: Array, reach: float, most: int = 700) -> Patch:
    """Ground within ``reach`` [m] of ``center`` (x, y), at most ``most`` points a side (bilinear, finer than the grid near it if small)."""
    n_rows, n_cols = terrain.heights.shape
    east = terrain.x_west + (n_cols - 1) * terrain.posting_x
    south = terrain.y_north - (n_rows - 1) * terrain.posting_y
    x0, x1 = max(terrain.x_west, center[0] - reach), min(east, center[0] + reach)
    y0, y1 = max(south, center[1] - reach), min(terrain.y_north, center[1] + reach)
    count = (int(np.clip((x1 - x0) / terrain.posting_x * 2, 2, most)), int(np.clip((y1 - y0) / terrain.posting_y * 2, 2, most)))
    x, y = np.linspace(x0, x1, count[0]), np.linspace(y1, y0, count[1])
    filled = np.where(np.isnan(terrain.heights), np.nanmin(terrain.heights), terrain.heights)
    posting = (terrain.posting_x, terrain.posting_y)
    z = bilinear(filled, (terrain.x_west, terrain.y_north), posting, x[None, :], y[:, None], clamp=True)
    return Patch(x=x, y=y, z=z)


def sunlight(patch: Patch, sun: Array) -> Array:
    """Lit fraction (n_rows, n_cols) under parallel light from the unit vector ``sun``: Lambert's cosine and cast shadows.

    Shadows by marching towards the sun: a point is dark where the ground on the way rises above the ray.
    """
    px, py = patch.posting
    gy, gx = np.gradient(patch.z, -py, px)
    normal = np.stack([-gx, -gy, np.ones_like(gx)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    light = np.clip(normal @ sun, 0, 1)
    level = np.hypot(sun[0], sun[1])
    x, y = np.meshgrid(patch.x, patch.y)
    shade = np.ones_like(light)
    highest = patch.z.max()
    step = max(px, py)
    distance = step
    while patch.z.min() + distance * sun[2] / level < highest and distance < 30:
        above = patch.height(x + distance * sun[0] / level, y + distance * sun[1] / level) - (patch.z + distance * sun[2] / level)
        shade = np.minimum(shade, np.clip(1 - above / (0.02 + 0.03 * distance), 0, 1))
        distance = distance * 1.15 + step / 2
    return light * shade


def colors(patch: Patch, terrain: Terrain, sun: Array) -> NDArray[np.uint8]:
    """Colour (n_rows * n_cols, 3) of every point: regolith or soil tint, grain, light and shadow."""
    from matplotlib.path import Path as Outline

    x, y = np.meshgrid(patch.x, patch.y)
    albedo = np.broadcast_to(REGOLITH, (*patch.z.shape, 3)).copy()
    tints = {name: PATCH_TINTS[k % len(PATCH_TINTS)] for k, name in enumerate(dict.fromkeys(p.soil for p in terrain.patches))}
    for region in terrain.patches:
        inside = Outline(np.array(region.polygon)).contains_points(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
        albedo[inside] = tints[region.soil]
    grain = 1 + 0.06 * np.random.default_rng(1).standard_normal(patch.z.shape)
    lit = 0.10 + 1.45 * sunlight(patch, sun)
    return (255 * np.clip(albedo * (lit * grain)[..., None], 0, 1) ** 0.8).astype(np.uint8).reshape(-1, 3)
