"""A smooth surface whose means over cells are given.

A cubic B-spline s(u) = sum_k c_k B3(u - k), u in cells, has the mean sum_k c_k B4(i - k) over cell i, because B4 is B3 averaged over a
cell. So if the c are the coefficients of the quartic spline that interpolates the means, the cubic spline has these means exactly
(de Boor 1978, histosplines). Along two axes alike. At the border of the file cells are mirrored.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.terrain.base.blocks import Blocks
from rille.terrain.base.lattice import CHUNK, Indices, Lattice, Lazy, Range, Stored, close_by, within
from rille.terrain.base.spline import cubic_weights, weighted
from rille.terrain.grid import Grid, Window

Array = NDArray[np.float64]

HALO = 20  # cells after which coefficients have forgotten what lies beyond: 0.36^20 = 1e-9
REACH = 2  # cells from a point to the last coefficient that it rests on
MOST_AT_ONCE = 4_000_000  # cells
BLOCK = 512  # cells across, of what is larger


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanSurface:
    """The cubic spline of ``coefficients``, whose (0, 0) belongs to the cell centred at ``corner`` [m] in W; cells measure ``posting`` [m].

    known : rows and columns, first and last + 1, between whose centres it is defined. zero : taken from all heights [m].
    digest : of all this.
    """

    coefficients: Lattice
    corner: tuple[float, float]
    posting: tuple[float, float]
    known: tuple[Range, Range]
    digest: str
    zero: float = 0.0

    def window(self, grid: Grid, window: Window) -> Array:
        """Heights [m] at a window of a grid."""
        if grid.heading != 0.0:
            return self.at(*grid.points(window))
        x, y = grid.axes(window)
        column, across = within((x + grid.origin[0] - self.corner[0]) / self.posting[0], self.known[1])
        row, down = within((self.corner[1] - y - grid.origin[1]) / self.posting[1], self.known[0])
        heights = np.full(window.shape, np.nan)
        if across.any() and down.any():
            heights[np.ix_(down, across)] = self._between(row[down], column[across])
        return heights

    def at(self, x: Array, y: Array) -> Array:
        """Heights [m] at points in W."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        column, across = within((x.ravel() - self.corner[0]) / self.posting[0], self.known[1])
        row, down = within((self.corner[1] - y.ravel()) / self.posting[1], self.known[0])
        heights = np.full(column.shape, np.nan)
        inside = np.flatnonzero(across & down)
        for start in range(0, inside.size, CHUNK):
            part = inside[start : start + CHUNK]
            heights[part] = self._points(row[part], column[part])
        return heights.reshape(x.shape)

    def _between(self, row: Array, column: Array) -> Array:
        """Heights at all pairs of fractional rows and columns."""
        (i, down), (j, over) = _support(row), _support(column)
        rows, cols = (np.unique(v[:, None] + np.arange(4)) for v in (i, j))
        values = self.coefficients.outer(rows, cols)
        first = np.searchsorted(cols, j)
        along = weighted([values[:, first + k] for k in range(4)], list(over))
        first = np.searchsorted(rows, i)
        return weighted([along[first + k] for k in range(4)], list(down[:, :, None])) - self.zero

    def _points(self, row: Array, column: Array) -> Array:
        (i, down), (j, over) = _support(row), _support(column)
        value = close_by(self.coefficients, i, j, 4).pairs
        along = [weighted([value(i + k, j + m) for m in range(4)], list(over)) for k in range(4)]
        return weighted(along, list(down)) - self.zero


def coefficient_lattice(means: Callable[[Range, Range], Array], shape: tuple[int, int], known: tuple[Range, Range]) -> Lattice:
    """Coefficients for a surface with given means over cells: at once where the known part is small, otherwise block by block.

    Parameters
    ----------
    means : (rows, cols) -> means [m] of these cells, of which there are ``shape``. known : rows and columns where a surface is wanted.
    """
    (r0, r1), (c0, c1) = known
    rows, cols = (r0 - REACH, r1 + REACH), (c0 - REACH, c1 + REACH)
    if (r1 - r0) * (c1 - c0) <= MOST_AT_ONCE:
        return Lazy(rows=rows, cols=cols, make=lambda: Stored(_coefficients(means, shape, rows, cols), rows[0], cols[0]))
    return Blocks(rows=rows, cols=cols, size=BLOCK, load=lambda r, c: _coefficients(means, shape, r, c))


def _coefficients(means: Callable[[Range, Range], Array], shape: tuple[int, int], rows: Range, cols: Range) -> Array:
    """Coefficients of rows and cols, which may lie beyond the file by less than ``HALO``."""
    from scipy.ndimage import spline_filter

    (i0, i1), (j0, j1) = ((max(a - HALO, 0), min(b + HALO, n)) for (a, b), n in zip((rows, cols), shape, strict=True))
    values = np.asarray(spline_filter(means((i0, i1), (j0, j1)), order=4, mode="reflect"))
    pads = [(max(first - a, 0), max(b - last, 0)) for (a, b), (first, last) in zip((rows, cols), ((i0, i1), (j0, j1)), strict=True)]
    values = np.pad(values, pads, mode="symmetric")
    top, left = (a - (first - pad[0]) for (a, _), first, pad in zip((rows, cols), (i0, j0), pads, strict=True))
    return values[top : top + rows[1] - rows[0], left : left + cols[1] - cols[0]]


def _support(index: Array) -> tuple[Indices, Array]:
    """First of the four cells that a point at a fractional index rests on, and their weights (4, n)."""
    cell = np.floor(index).astype(np.intp)
    return cell - 1, cubic_weights(index - cell)
