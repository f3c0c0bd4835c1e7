"""From heights to pixels: decimation window by window, light, contours, colours. numpy and Pillow only."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from rille.model import InputRefused, Terrain
from rille.view.ground import strided

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

MOST_SAMPLES = 2400  # a side; more are decimated before they are drawn


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """Heights as read for a picture.

    z : [m] above ``level``, float32, (n_rows, n_cols), row 0 north; 0 where there is none. hole, filled : masks, None if empty.
    x_west, y_north : of value (0, 0); step_x, step_y : distances of values [m].
    """

    z: Floats
    level: float
    hole: NDArray[np.bool_] | None
    filled: NDArray[np.bool_] | None
    x_west: float
    y_north: float
    step_x: float
    step_y: float

    @property
    def width(self) -> float:
        """From the first to the last column [m]."""
        return (self.z.shape[1] - 1) * self.step_x

    @property
    def height(self) -> float:
        """From the first to the last row [m]."""
        return (self.z.shape[0] - 1) * self.step_y

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest value [m]."""
        z = self.z if self.hole is None else self.z[~self.hole]
        return self.level + float(z.min()), self.level + float(z.max())

    def gradient(self) -> tuple[Floats, Floats]:
        """dz/dx and dz/dy [-] towards east and north by central differences over two steps; holes have none (0)."""
        north, east = (np.asarray(part) for part in np.gradient(self.z))
        east /= self.step_x
        north /= -self.step_y
        if self.hole is not None:
            near = self.near_hole()
            east[near], north[near] = 0.0, 0.0
        return east, north

    def near_hole(self) -> NDArray[np.bool_]:
        """Samples without height, and those beside one."""
        if self.hole is None:
            return np.zeros(self.z.shape, bool)
        wide = np.pad(self.hole, 1)
        return self.hole | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]


def sample(terrain: Terrain, most: int = MOST_SAMPLES) -> Samples:
    """Every k-th height of a terrain, k the least that gives at most ``most`` a side; heights in files are read in strips.

    Raises
    ------
    InputRefused : if the terrain has no height at all.
    """
    n_rows, n_cols = terrain.heights.shape
    k = max(1, math.ceil(max(n_rows, n_cols) / most))
    heights = strided(terrain.heights, (0, n_rows), (0, n_cols), k)
    hole = np.isnan(heights)
    any_hole = bool(hole.any())
    if any_hole and hole.all():
        raise InputRefused(f"terrain '{terrain.name}' has no height at all, so there is nothing to draw")
    level = float(np.nanmean(heights) if any_hole else heights.mean())
    z = (heights - level).astype(np.float32)
    if any_hole:
        z[hole] = 0.0
    filled = None if terrain.filled is None else strided(terrain.filled, (0, n_rows), (0, n_cols), k).astype(bool)
    return Samples(
        z=z,
        level=level,
        hole=hole if any_hole else None,
        filled=filled if filled is not None and filled.any() else None,
        x_west=terrain.x_west,
        y_north=terrain.y_north,
        step_x=k * terrain.posting_x,
        step_y=k * terrain.posting_y,
    )


@dataclass(frozen=True)
class Raster:
    """Samples drawn into ``size`` = (columns, rows) pixels, whose outer edges are the outermost samples. North is up."""

    samples: Samples
    size: tuple[int, int]

    @cached_property
    def z(self) -> Floats:
        """Height [m] above ``samples.level`` of every pixel: bilinear between samples, mean where pixels are larger."""
        return self.scaled(self.samples.z)

    @cached_property
    def hole(self) -> NDArray[np.bool_] | None:
        """Pixels without height."""
        return None if self.samples.hole is None else self.scaled(self.samples.hole.astype(np.float32)) > 0.5

    @cached_property
    def filled(self) -> NDArray[np.bool_] | None:
        """Pixels whose height was interpolated across a hole of the base."""
        return None if self.samples.filled is None else self.scaled(self.samples.filled.astype(np.float32)) > 0.5

    def scaled(self, values: Floats) -> Floats:
        """Values (n_rows, n_cols) at the samples, as pixels."""
        n_rows, n_cols = values.shape
        box = (0.5, 0.5, n_cols - 0.5, n_rows - 0.5)
        return np.asarray(Image.fromarray(values).resize(self.size, Image.Resampling.BILINEAR, box=box))

    def light(self) -> Floats:
        """Light 0..1 on every pixel from the north-west, 32 deg high; level ground has :data:`LEVEL_LIGHT`.

        Lambert's cosine of normals interpolated between the samples. Slopes are enlarged for the light by a round factor, so that
        gentle ground shows: the 95th percentile of slope becomes at most 29 deg.
        """
        east, north = self.samples.gradient()
        steep = np.sqrt(np.quantile((east[::3, ::3] ** 2 + north[::3, ::3] ** 2), 0.95)) + 1e-6
        factor = np.float32(next((f for f in (6, 4, 3, 2, 1.5) if f * steep < 0.55), 1.0))
        gx, gy = self.scaled(east) * factor, self.scaled(north) * factor
        length = np.sqrt(1 + gx * gx + gy * gy)
        cosine = np.float32(math.cos(SUN_HEIGHT) * math.sqrt(0.5))
        lit = (cosine * (gx - gy) + np.float32(math.sin(SUN_HEIGHT))) / length
        return np.clip(lit, 0.0, 1.0).astype(np.float32, copy=False)

    def contours(self, interval: float, width: float) -> Floats:
        """Opacity 0..1 of lines at all multiples of ``interval`` [m], ``width`` pixels wide, anti-aliased: the distance of a pixel from
        the nearest level is its difference of height over the local gradient. Where ground is nearly level there is no line."""
        north, east = np.gradient(self.z)
        gradient = np.sqrt(east * east + north * north)
        levels = (self.z + np.float32(self.samples.level)) / np.float32(interval)
        away = np.abs(levels - np.rint(levels)) * np.float32(interval)
        opacity = np.float32(width / 2 + 0.5) - away / np.maximum(gradient, np.float32(1e-9))
        np.clip(opacity, 0.0, 1.0, out=opacity)
        opacity[gradient < interval / 400] = 0.0
        if self.hole is not None:
            opacity[self.hole] = 0.0
        return opacity


SUN_HEIGHT = math.radians(32.0)
LEVEL_LIGHT = math.sin(SUN_HEIGHT)


def ramp(anchors: tuple[str, ...], count: int = 256) -> Bytes:
    """Colours (count, 3) that run linearly through ``#rrggbb`` anchors."""
    corners = np.array([rgb(a) for a in anchors], float)
    at = np.linspace(0, len(corners) - 1, count)
    return np.stack([np.interp(at, np.arange(len(corners)), corners[:, k]) for k in range(3)], axis=1).round().astype(np.uint8)


def rgb(color: str) -> tuple[int, int, int]:
    """``#rrggbb`` as numbers."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def _light_table() -> NDArray[np.uint16]:
    """Multipliers (256, 3) in 1/128 of a colour by light: level ground keeps it, slopes to the sun grow lighter, shadows cool and dark."""
    light = np.linspace(0, 1, 256)[:, None]
    dark = np.clip(1 - light / LEVEL_LIGHT, 0, 1)
    bright = np.clip((light - LEVEL_LIGHT) / (1 - LEVEL_LIGHT), 0, 1)
    shadow = np.array([0.20, 0.24, 0.33])
    return np.round(128 * ((1 - dark) + dark * shadow + 0.26 * bright)).astype(np.uint16)


def lit(tint: Bytes, light: Floats, strength: float = 1.0) -> Bytes:
    """Colours (..., 3) under light (...); strength 0 leaves them as they are."""
    table = _light_table()
    if strength < 1:
        table = np.round(128 + strength * (table.astype(float) - 128)).astype(np.uint16)
    product = tint * table[(light * 255).astype(np.uint8)]
    product >>= 7
    return np.minimum(product, 255, out=product).astype(np.uint8)


def blend(pixels: Bytes, color: str, opacity: Floats) -> None:
    """Lay a colour with opacity 0..1 (rows, columns) over pixels, in place."""
    touched = np.nonzero(opacity > 0.004)
    part = pixels[touched].astype(np.float32)
    part += (np.array(rgb(color), np.float32) - part) * opacity[touched][:, None]
    pixels[touched] = part.astype(np.uint8)


def hatch(pixels: Bytes, mask: NDArray[np.bool_], color: str, ground: str | None = None, spacing: int = 8) -> None:
    """Diagonal lines in a mask, in place; on a plain ground if one is given."""
    rows, columns = np.nonzero(mask)
    if ground is not None:
        pixels[rows, columns] = rgb(ground)
    stripe = (rows + columns) % spacing < 2
    pixels[rows[stripe], columns[stripe]] = rgb(color)


def contour_interval(low: float, high: float) -> float:
    """Distance of contours [m], 1, 2 or 5 times a power of ten, so that 9 to 22 of them lie between two heights."""
    return nice(max(high - low, 1e-3) / 22)


def nice(value: float) -> float:
    """The least of 1, 2, 5 times a power of ten that is not below ``value``."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(m * power for m in (1, 2, 5, 10) if m * power >= value * (1 - 1e-9))
