"""Ground that is the bilinear surface of heights on a lattice, as the solver interpolates them (``rille.model.grid.bilinear``)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.terrain.grid import Grid, Window

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Range = tuple[int, int]

SNAP = 1e-6  # fractions of a cell below which a point counts as a lattice point, or as inside
CHUNK = 1 << 18  # points evaluated at once where they follow no lattice
DENSE = 40  # lattice points per point up to which evaluating all of them is quicker than evaluating four for each
MOST_CLOSE = 8_000_000  # lattice points, 64 MB


class Lattice(Protocol):
    """Heights on the points of a regular lattice, southward rows, eastward columns; indices must lie within ``rows`` and ``cols``."""

    @property
    def rows(self) -> Range:
        """First row and last + 1."""
        ...

    @property
    def cols(self) -> Range:
        """First column and last + 1."""
        ...

    def outer(self, rows: Indices, cols: Indices) -> Array:
        """Values at all pairs of ascending rows (n,) and columns (m,): (n, m)."""
        ...

    def pairs(self, rows: Indices, cols: Indices) -> Array:
        """Values at points (rows[k], cols[k]): (k,)."""
        ...


@dataclass(frozen=True, slots=True)
class Stored:
    """A lattice in memory. values : [m], (n_rows, n_cols). row0, col0 : indices of values[0, 0]."""

    values: Array
    row0: int = 0
    col0: int = 0

    @property
    def rows(self) -> Range:
        """First row and last + 1."""
        return self.row0, self.row0 + self.values.shape[0]

    @property
    def cols(self) -> Range:
        """First column and last + 1."""
        return self.col0, self.col0 + self.values.shape[1]

    def outer(self, rows: Indices, cols: Indices) -> Array:
        """Values at all pairs of ascending rows and columns."""
        i, j = rows - self.row0, cols - self.col0
        if contiguous(i) and contiguous(j):
            return self.values[i[0] : i[-1] + 1, j[0] : j[-1] + 1].copy()
        return self.values[np.ix_(i, j)]

    def pairs(self, rows: Indices, cols: Indices) -> Array:
        """Values at points."""
        return self.values[rows - self.row0, cols - self.col0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lazy:
    """A lattice that is made when the first of its values is asked for: much of what is done with a scene needs none."""

    rows: Range
    cols: Range
    make: Callable[[], Lattice]
    _made: list[Lattice] = field(default_factory=list, repr=False, compare=False)
    _lock: Lock = field(default_factory=Lock, repr=False, compare=False)

    def outer(self, rows: Indices, cols: Indices) -> Array:
        """Values at all pairs of ascending rows and columns."""
        return self._lattice().outer(rows, cols)

    def pairs(self, rows: Indices, cols: Indices) -> Array:
        """Values at points."""
        return self._lattice().pairs(rows, cols)

    def _lattice(self) -> Lattice:
        with self._lock:
            if not self._made:
                self._made.append(self.make())
            return self._made[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """The bilinear surface of a lattice whose value (0, 0) stands at ``corner`` [m] in W, at distances ``posting`` (x, y) [m].

    zero : taken from all heights [m]. digest : of the lattice, its place and zero.
    """

    lattice: Lattice
    corner: tuple[float, float]
    posting: tuple[float, float]
    digest: str
    zero: float = 0.0

    def window(self, grid: Grid, window: Window) -> Array:
        """Heights [m] at a window of a grid; the lattice's own values where the grid's points are lattice points."""
        if grid.heading != 0.0:
            return self.at(*grid.points(window))
        x, y = grid.axes(window)
        column, row = self.index(x + grid.origin[0], y + grid.origin[1])
        column, across = within(column, self.lattice.cols)
        row, down = within(row, self.lattice.rows)
        if not across.any() or not down.any():
            return np.full(window.shape, np.nan)
        if (grid.posting_x, grid.posting_y) == self.posting and on_points(column[across]) and on_points(row[down]):
            values = self.lattice.outer(np.rint(row[down]).astype(np.intp), np.rint(column[across]).astype(np.intp))
        else:
            values = self._between(row[down], column[across])
        values -= self.zero
        if across.all() and down.all():
            return values
        heights = np.full(window.shape, np.nan)
        heights[np.ix_(down, across)] = values
        return heights

    def at(self, x: Array, y: Array) -> Array:
        """Heights [m] at points in W."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        flat_x, flat_y = x.ravel(), y.ravel()
        heights = np.empty(flat_x.shape)
        for start in range(0, flat_x.size, CHUNK):
            part = slice(start, start + CHUNK)
            heights[part] = self._points(flat_x[part], flat_y[part])
        return heights.reshape(x.shape)

    def index(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Fractional columns and rows of coordinates [m] in W."""
        return (x - self.corner[0]) / self.posting[0], (self.corner[1] - y) / self.posting[1]

    def _between(self, row: Array, column: Array) -> Array:
        """Bilinear heights at all pairs of fractional rows and columns: first along rows, then between them, as ``bilinear`` does."""
        i, j = cells_of(row, self.lattice.rows), cells_of(column, self.lattice.cols)
        rows, cols = np.unique(np.concatenate([i, i + 1])), np.unique(np.concatenate([j, j + 1]))
        values = self.lattice.outer(rows, cols)
        fx, fy = (column - j)[None, :], (row - i)[:, None]
        along = (1 - fx) * values[:, np.searchsorted(cols, j)] + fx * values[:, np.searchsorted(cols, j + 1)]
        return (1 - fy) * along[np.searchsorted(rows, i)] + fy * along[np.searchsorted(rows, i + 1)]

    def _points(self, x: Array, y: Array) -> Array:
        column, row = self.index(x, y)
        column, across = within(column, self.lattice.cols)
        row, down = within(row, self.lattice.rows)
        heights = np.full(x.shape, np.nan)
        inside = across & down
        column, row = column[inside], row[inside]
        i, j = cells_of(row, self.lattice.rows), cells_of(column, self.lattice.cols)
        fx, fy = column - j, row - i
        value = close_by(self.lattice, i, j, 2).pairs
        north = (1 - fx) * value(i, j) + fx * value(i, j + 1)
        south = (1 - fx) * value(i + 1, j) + fx * value(i + 1, j + 1)
        heights[inside] = (1 - fy) * north + fy * south - self.zero
        return heights


def close_by(lattice: Lattice, rows: Indices, cols: Indices, width: int) -> Lattice:
    """The same values for rows .. rows + width - 1 and the like columns, evaluated at once where points lie densely: the quicker way."""
    if rows.size == 0:
        return lattice
    (i0, i1), (j0, j1) = ((int(v.min()), int(v.max()) + width) for v in (rows, cols))
    if (i1 - i0) * (j1 - j0) > min(DENSE * rows.size, MOST_CLOSE):
        return lattice
    return Stored(lattice.outer(np.arange(i0, i1), np.arange(j0, j1)), i0, j0)


def within(index: Array, known: Range) -> tuple[Array, NDArray[np.bool_]]:
    """Fractional indices moved into the known range where they miss it by rounding only, and which of them lie there."""
    first, last = known[0], known[1] - 1
    inside = (index >= first - SNAP) & (index <= last + SNAP)
    return np.clip(index, first, last), inside


def cells_of(index: Array, known: Range) -> Indices:
    """Whole part of fractional indices >= 0; the last point belongs to the last cell."""
    return np.minimum(index.astype(np.intp), known[1] - 2)


def on_points(index: Array) -> bool:
    """True if all fractional indices are whole but for rounding."""
    return bool(np.all(np.abs(index - np.rint(index)) < SNAP))


def contiguous(indices: Indices) -> bool:
    """True if ascending indices follow each other without a gap."""
    return int(indices[-1]) - int(indices[0]) + 1 == indices.size
