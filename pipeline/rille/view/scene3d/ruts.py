"""Ruts pressed into a drawn grid as wheels pass: at every point under a wheel the ground less the sinkage, and darker."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
DARKER = 0.72


class Pressed:
    """points (rows * columns, 3) and colours (n, 3) of a grid, as wheels have left them."""

    def __init__(self, points: Array, colors: Array, grid: dict[str, Any]) -> None:
        self.points, self.colors = np.array(points), np.array(colors)
        self._fresh = np.array(colors)
        self._grid = grid
        self._done = 0  # stored times that were pressed

    def press(self, tracks: Array, last: int, widths: Sequence[float]) -> None:
        """Press all stored times up to ``last``. tracks (wheels, n, 11): columns as of a state."""
        for k in range(self._done, last + 1):
            for track, width in zip(tracks, widths, strict=True):
                self._stamp(track, k, width)
        self._done = max(self._done, last + 1)

    def _stamp(self, track: Array, k: int, width: float) -> None:
        sinkage = track[k, 6]
        if not sinkage > 0:
            return
        grid = self._grid
        step = track[k, :2] - track[max(0, k - 1), :2]
        length = np.hypot(*step)
        along = step / length if length > 1e-6 else np.array([1.0, 0.0])
        left = np.array([-along[1], along[0]])
        posting = min(grid["posting_x"], grid["posting_y"])
        across = np.linspace(-width / 2, width / 2, max(2, round(2 * width / posting)))
        behind = np.arange(0, max(length, posting / 4), posting / 2)
        places = track[k, :2] + (across[:, None, None] * left - behind[None, :, None] * along).reshape(-1, 2)
        columns = np.round((places[:, 0] - grid["x_west"]) / grid["posting_x"]).astype(int)
        rows = np.round((grid["y_north"] - places[:, 1]) / grid["posting_y"]).astype(int)
        on = (columns >= 0) & (columns < grid["columns"]) & (rows >= 0) & (rows < grid["rows"])
        index = np.unique(rows[on] * grid["columns"] + columns[on])
        self.points[index, 2] = np.minimum(self.points[index, 2], track[k, 3] - sinkage)
        self.colors[index] = (DARKER * self._fresh[index]).astype(np.uint8)
