"""Ruts pressed into a drawn grid as wheels pass: the ground lies lower by the wheel's sinkage, is darker, and bears the colour of slip."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model.grid import bilinear
from rille.view.scene3d.tracks import WHEEL

Array = NDArray[Any]
DARKER = 0.84
TINT = 0.5  # share of the colour of slip in that of a rut
LEAP = 1.0  # [m] between stored times: the machine was put elsewhere, nothing was driven over
SINKAGE, SLIP = 4 + WHEEL.index("sinkage"), 4 + WHEEL.index("slip_ratio")  # columns of a wheel's state
STOPS = (-1.0, -0.4, 0.0, 0.15, 0.4, 0.7, 1.0)  # slip ratios and their colours, those of the page (web/colours.js)
COLOURS = ((47, 111, 224), (111, 168, 245), (185, 189, 184), (232, 210, 122), (240, 147, 62), (226, 81, 46), (179, 18, 58))


def slip_color(slip: Array | float) -> Array:
    """Colour (..., 3) 0..255 of slip ratios: skidding blue, rolling grey, spinning orange to red."""
    return np.stack([np.interp(slip, STOPS, channel) for channel in zip(*COLOURS, strict=True)], axis=-1)


class Pressed:
    """points (rows * columns, 3) [m] and colours (n, 3) 0..255 of a grid, as wheels have left them. grid : extras of the terrain's node."""

    def __init__(self, points: Array, colors: Array, grid: dict[str, Any]) -> None:
        self.points, self.colors = np.array(points), np.array(colors)
        self._level, self._fresh = np.array(points[:, 2]), np.array(colors)
        self._cover = np.zeros(len(points))  # share of a point's cell that a wheel has covered
        self._grid = grid
        self._done = 0  # stored times that were pressed

    def press(self, tracks: Array, last: int, widths: Sequence[float]) -> bool:
        """Press all stored times up to ``last``; whether anything changed. tracks (wheels, n, 11): columns as of a state."""
        changed = False
        for k in range(self._done, last + 1):
            for track, width in zip(tracks, widths, strict=True):
                changed = self._stamp(track, k, width) or changed
        self._done = max(self._done, last + 1)
        return changed

    def height(self, x: Array, y: Array) -> Array:
        """Height [m] of the ground with its ruts; beyond the grid that of its border."""
        grid = self._grid
        z = self.points[:, 2].reshape(grid["rows"], grid["columns"])
        return bilinear(z, (grid["x_west"], grid["y_north"]), (grid["posting_x"], grid["posting_y"]), x, y, clamp=True)

    def _stamp(self, track: Array, k: int, width: float) -> bool:
        """Press what a wheel covered since the stored time before; a point at the edge as far as its cell is covered."""
        sinkage, here, before = track[k, SINKAGE], track[k, :2], track[max(0, k - 1), :2]
        if not sinkage > 0:
            return False
        if not np.hypot(*(here - before)) < LEAP:
            before = here
        length = float(np.hypot(*(here - before)))
        along = (here - before) / length if length > 1e-6 else np.array([1.0, 0.0])
        grid = self._grid
        px, py = grid["posting_x"], grid["posting_y"]
        low, high = np.minimum(here, before) - width / 2 - (px, py), np.maximum(here, before) + width / 2 + (px, py)
        columns = np.arange(max(0, int((low[0] - grid["x_west"]) / px)), min(grid["columns"], int((high[0] - grid["x_west"]) / px) + 2))
        rows = np.arange(max(0, int((grid["y_north"] - high[1]) / py)), min(grid["rows"], int((grid["y_north"] - low[1]) / py) + 2))
        if not len(columns) or not len(rows):
            return False
        index = (rows[:, None] * grid["columns"] + columns).ravel()
        away = self.points[index, :2] - before
        forward, aside = away @ along, np.abs(away @ (-along[1], along[0]))
        posting = max(px, py)
        cover = np.clip(0.5 + (width / 2 - aside) / posting, 0, 1)
        cover *= np.clip(1.0 - np.maximum(-forward, forward - length) / posting, 0, 1)
        index, cover = index[cover > 0], cover[cover > 0]
        self.points[index, 2] = np.minimum(self.points[index, 2], self._level[index] - cover * sinkage)
        latest = cover >= self._cover[index]
        index, cover = index[latest], cover[latest]
        self._cover[index] = cover
        rut = DARKER * ((1 - TINT) * self._fresh[index] + TINT * slip_color(track[k, SLIP]))
        self.colors[index] = ((1 - cover[:, None]) * self._fresh[index] + cover[:, None] * rut).astype(np.uint8)
        return True
