"""The ground as a picture: a cropped, decimated grid with sunlight, cast shadows and soils in its colours."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.grid import bilinear
from rille.model.polygon import soil_codes, soil_names

Array = NDArray[np.float64]

STRIP = 256  # rows read at once from heights that lie in a file

REGOLITH = np.array([0.62, 0.60, 0.57])
PATCH_TINTS = (np.array([0.64, 0.57, 0.48]), np.array([0.71, 0.70, 0.68]), np.array([0.49, 0.49, 0.50]))


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


def strided(values: Any, rows: tuple[int, int], columns: tuple[int, int], step: int = 1) -> NDArray[Any]:
    """Every ``step``-th value of rows[0] <= i < rows[1] and columns[0] <= j < columns[1] of a layer of a terrain.

    Layers that lie in a file are read in strips of rows, so that memory stays bounded.
    """
    (r0, r1), (c0, c1) = rows, columns
    if isinstance(values, np.ndarray):
        return values[r0:r1:step, c0:c1:step]
    return np.concatenate([values[a : min(a + STRIP, r1), c0:c1][(r0 - a) % step :: step, ::step] for a in range(r0, r1, STRIP)])


def crop(terrain: Terrain, center: Array, reach: float, most: int = 700) -> Patch:
    """Ground within ``reach`` [m] of ``center`` (x, y), at most ``most`` points a side (bilinear, finer than the grid near it if small).

    Where there is no height, the lowest around stands in for it.
    """
    n_rows, n_cols = terrain.heights.shape
    east = terrain.x_west + (n_cols - 1) * terrain.posting_x
    south = terrain.y_north - (n_rows - 1) * terrain.posting_y
    x0, x1 = max(terrain.x_west, center[0] - reach), min(east, center[0] + reach)
    y0, y1 = max(south, center[1] - reach), min(terrain.y_north, center[1] + reach)
    count = (int(np.clip((x1 - x0) / terrain.posting_x * 2, 2, most)), int(np.clip((y1 - y0) / terrain.posting_y * 2, 2, most)))
    x, y = np.linspace(x0, x1, count[0]), np.linspace(y1, y0, count[1])
    c0, c1 = int((x0 - terrain.x_west) / terrain.posting_x), int(np.ceil((x1 - terrain.x_west) / terrain.posting_x)) + 1
    r0, r1 = int((terrain.y_north - y1) / terrain.posting_y), int(np.ceil((terrain.y_north - y0) / terrain.posting_y)) + 1
    c0, r0, c1, r1 = min(max(c0, 0), n_cols - 2), min(max(r0, 0), n_rows - 2), min(c1, n_cols), min(r1, n_rows)
    step = max(1, min((r1 - r0) // most, (c1 - c0) // most))  # more values than points are passed over
    heights = strided(terrain.heights, (r0, max(r1, r0 + 2)), (c0, max(c1, c0 + 2)), step)
    hole = np.isnan(heights)
    if hole.any():
        heights = np.where(hole, 0.0 if hole.all() else np.nanmin(heights), heights)
    corner = (terrain.x_west + c0 * terrain.posting_x, terrain.y_north - r0 * terrain.posting_y)
    z = bilinear(heights, corner, (step * terrain.posting_x, step * terrain.posting_y), x[None, :], y[:, None], clamp=True)
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


def albedo(terrain: Terrain, x: Array, y: Array) -> Array:
    """Colour 0..1 (n_rows, n_cols, 3) of regolith and of other soils on a grid of ascending x (n_cols,) and descending y (n_rows,) [m]."""
    names = soil_names(terrain.soil, terrain.patches)
    tints = np.array([REGOLITH, *(PATCH_TINTS[k % len(PATCH_TINTS)] for k in range(len(names) - 1))])
    return tints[soil_codes(terrain.soil, terrain.patches, x, y)]


def painted(tint: Array, light: Array) -> NDArray[np.uint8]:
    """Colour (n, 3) of points of a grid: tint (n_rows, n_cols, 3) under light (n_rows, n_cols), with the grain of dust."""
    grain = 1 + 0.06 * np.random.default_rng(1).standard_normal(light.shape)
    shown = (0.10 + 1.45 * light) * grain
    return (255 * np.clip(tint * shown[..., None], 0, 1) ** 0.8).astype(np.uint8).reshape(-1, 3)


def colors(patch: Patch, terrain: Terrain, sun: Array) -> NDArray[np.uint8]:
    """Colour (n_rows * n_cols, 3) of every point: regolith or soil tint, grain, light and shadow."""
    return painted(albedo(terrain, patch.x, patch.y), sunlight(patch, sun))
