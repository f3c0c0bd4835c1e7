"""What a scene stands on: a base that can be asked for heights anywhere, and where it lies."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, SourceFile
from rille.terrain.grid import Grid, Window

Array = NDArray[np.float64]
Holes = Callable[[Grid, Window], NDArray[np.bool_]]
Progress = Callable[[str, float], None]

MOST_HEIGHTS = 4_000_000_000  # 32 GB of float64


class Base(Protocol):
    """Heights of the ground before landforms: a pure function, so that windows give the same bytes as the whole."""

    @property
    def digest(self) -> str:
        """Changes when its heights change."""
        ...

    def window(self, grid: Grid, window: Window) -> Array:
        """Heights [m] in W at a window of any grid, of the window's shape; NaN outside what it knows."""
        ...

    def at(self, x: Array, y: Array) -> Array:
        """Heights [m] at points (x, y) [m] in W, of their shape; NaN outside what it knows."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """A base and its place.

    grid : the scene's own grid. crs : WKT of the projection, "" for synthetic ground. map_origin : easting, northing, height [m] of W's
    origin. source : in words. sources : files read. holes : (grid, window) -> True where the base had no value and one was interpolated;
    None: nowhere. notes : sentences worth telling the user.
    """

    base: Base
    grid: Grid
    crs: str = ""
    map_origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    source: str
    sources: tuple[SourceFile, ...] = ()
    holes: Holes | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Sum:
    """Bases laid upon each other; NaN where one of them is unknown."""

    parts: tuple[Base, ...]
    digest: str

    def window(self, grid: Grid, window: Window) -> Array:
        """Heights [m] at a window of a grid."""
        heights = self.parts[0].window(grid, window)
        for part in self.parts[1:]:
            heights += part.window(grid, window)
        return heights

    def at(self, x: Array, y: Array) -> Array:
        """Heights [m] at points in W."""
        heights = self.parts[0].at(x, y)
        for part in self.parts[1:]:
            heights = heights + part.at(x, y)
        return heights


def grid_shape(width: float, height: float, posting_x: float, posting_y: float) -> tuple[int, int]:
    """Rows and columns of a grid of width x height [m].

    Raises
    ------
    InputRefused : if it holds less than one cell or more than ``MOST_HEIGHTS`` values.
    """
    if posting_x <= 0 or posting_y <= 0 or width < posting_x or height < posting_y:
        raise InputRefused(f"the base measures {width:g} m x {height:g} m at a posting of {posting_x:g} m; it must hold at least one cell")
    shape = round(height / posting_y) + 1, round(width / posting_x) + 1
    if shape[0] * shape[1] > MOST_HEIGHTS:
        raise InputRefused(
            f"the base would have {shape[0]} x {shape[1]} heights, more than {MOST_HEIGHTS:.0e}; take a larger posting or a smaller size"
        )
    return shape
