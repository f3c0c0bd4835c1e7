"""Where heights stand: a regular grid in its own frame, and windows of it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.quantity import to_si

Array = NDArray[np.float64]

FARTHEST = 1e9  # [m] from the origin; beyond it, distances below a micrometre are lost


def cosine_sine(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle [rad], exactly 0 and +-1 for quarter turns, so that what is turned by one lands on the same points."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return (0.0 if abs(cosine) < 1e-15 else cosine), (0.0 if abs(sine) < 1e-15 else sine)


def place_of(value: float | int | str, what: str) -> float:
    """A coordinate [m] of a scene; ``what`` names it.

    Raises
    ------
    InputRefused : if it is no length, or so far away that the distance of neighbouring heights would be lost beside it.
    """
    place = to_si(value, "length", what)
    if abs(place) > FARTHEST:
        raise InputRefused(f"{what} is {place:g} m; it must lie between -{FARTHEST:g} and {FARTHEST:g} m: measure it from a nearer origin")
    return place


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Rows row0 <= i < row1 and columns col0 <= j < col1 of a grid."""

    row0: int
    row1: int
    col0: int
    col1: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return max(self.row1 - self.row0, 0), max(self.col1 - self.col0, 0)

    @property
    def slices(self) -> tuple[slice, slice]:
        """To index a grid's heights."""
        return slice(self.row0, self.row1), slice(self.col0, self.col1)

    @property
    def empty(self) -> bool:
        """True if it holds no value."""
        return self.row1 <= self.row0 or self.col1 <= self.col0

    def meet(self, other: "Window") -> "Window":
        """What both have in common (perhaps empty)."""
        return Window(
            row0=max(self.row0, other.row0),
            row1=min(self.row1, other.row1),
            col0=max(self.col0, other.col0),
            col1=min(self.col1, other.col1),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """A regular grid of points; row 0 is the northernmost; n values bound n - 1 cells.

    The value of row i, column j stands at x = x_west + j posting_x, y = y_north - i posting_y [m] in the grid's frame G, whose
    origin is ``origin`` [m] in the scene's frame W and which is turned against it by ``heading`` [rad, from x towards y]:
    p_W = origin + R(heading) p_G. The grid of a scene has G = W; an extracted region may be turned.
    """

    n_rows: int
    n_cols: int
    posting_x: float
    posting_y: float
    x_west: float
    y_north: float
    origin: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.n_rows, self.n_cols

    @property
    def whole(self) -> Window:
        """The window that holds everything."""
        return Window(row0=0, row1=self.n_rows, col0=0, col1=self.n_cols)

    @property
    def aligned(self) -> bool:
        """True if its frame is the scene's."""
        return self.heading == 0.0 and self.origin == (0.0, 0.0)

    def axes(self, window: Window) -> tuple[Array, Array]:
        """x (n_cols,) and y (n_rows,) [m] of a window's values in the grid's frame, y descending."""
        x = np.arange(window.col0, window.col1, dtype=np.float64) * self.posting_x + self.x_west
        y = self.y_north - np.arange(window.row0, window.row1, dtype=np.float64) * self.posting_y
        return x, y

    def points(self, window: Window) -> tuple[Array, Array]:
        """x and y [m] in W of a window's values, each of the window's shape."""
        x, y = self.axes(window)
        return self.to_scene(*np.broadcast_arrays(x[None, :], y[:, None]))

    def to_scene(self, x: Array, y: Array) -> tuple[Array, Array]:
        """From the grid's frame to W [m]."""
        if self.aligned:
            return np.asarray(x, np.float64), np.asarray(y, np.float64)
        cosine, sine = cosine_sine(self.heading)
        return self.origin[0] + cosine * x - sine * y, self.origin[1] + sine * x + cosine * y

    def from_scene(self, x: Array | float, y: Array | float) -> tuple[Array, Array]:
        """From W to the grid's frame [m]."""
        x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
        if self.aligned:
            return x, y
        cosine, sine = cosine_sine(self.heading)
        dx, dy = x - self.origin[0], y - self.origin[1]
        return cosine * dx + sine * dy, cosine * dy - sine * dx

    def index(self, x: Array | float, y: Array | float) -> tuple[Array, Array]:
        """Fractional column and row of points (x, y) [m] in W."""
        gx, gy = self.from_scene(x, y)
        return (gx - self.x_west) / self.posting_x, (self.y_north - gy) / self.posting_y

    def around(self, x: float, y: float, half_x: float, half_y: float, heading: float) -> Window:
        """Window of the values inside a box of half lengths [m], centred at (x, y) in W and turned by ``heading`` against W; clipped."""
        turn = heading - self.heading
        cosine, sine = abs(math.cos(turn)), abs(math.sin(turn))
        reach_x, reach_y = half_x * cosine + half_y * sine, half_x * sine + half_y * cosine
        column, row = (float(v) for v in self.index(x, y))
        return Window(
            row0=int(np.clip(math.ceil(row - reach_y / self.posting_y), 0, self.n_rows)),
            row1=int(np.clip(math.floor(row + reach_y / self.posting_y) + 1, 0, self.n_rows)),
            col0=int(np.clip(math.ceil(column - reach_x / self.posting_x), 0, self.n_cols)),
            col1=int(np.clip(math.floor(column + reach_x / self.posting_x) + 1, 0, self.n_cols)),
        )

    def tiles(self, size: int) -> list[Window]:
        """Windows of at most ``size`` x ``size`` values that cover the grid once."""
        return [
            Window(row0=i, row1=min(i + size, self.n_rows), col0=j, col1=min(j + size, self.n_cols))
            for i in range(0, self.n_rows, size)
            for j in range(0, self.n_cols, size)
        ]
