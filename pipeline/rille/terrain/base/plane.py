"""Flat and inclined planes."""

import hashlib
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.terrain.grid import Grid, Window

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """z = tan(slope) (cos(direction) x + sin(direction) y); slope, direction [rad], direction from x towards y. Known everywhere."""

    slope: float = 0.0
    direction: float = 0.0

    @property
    def digest(self) -> str:
        """Changes when its heights change."""
        return hashlib.sha256(f"plane {self.slope!r} {self.direction!r}".encode()).hexdigest()

    def window(self, grid: Grid, window: Window) -> Array:
        """Heights [m] at a window of a grid."""
        if not self.slope:
            return np.zeros(window.shape)
        if grid.aligned:
            x, y = grid.axes(window)
            return self._heights(x[None, :], y[:, None])
        return self._heights(*grid.points(window))

    def at(self, x: Array, y: Array) -> Array:
        """Heights [m] at points in W."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        return self._heights(x, y)

    def _heights(self, x: Array, y: Array) -> Array:
        return math.tan(self.slope) * (math.cos(self.direction) * x + math.sin(self.direction) * y)
