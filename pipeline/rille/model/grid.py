"""Bilinear interpolation on a grid of heights: the solver's own, so that pictures, exports and wheels agree."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bilinear(
    heights: Array, corner: tuple[float, float], posting: tuple[float, float], x: Array | float, y: Array | float, *, clamp: bool = False
) -> Array:
    """Height at (x, y).

    z = (1-fy) ((1-fx) z00 + fx z01) + fy ((1-fx) z10 + fx z11), fx and fy the fractions of a cell.

    Parameters
    ----------
    heights : [m], (n_rows, n_cols), row 0 north.
    corner : x and y of value (0, 0) [m]. posting : distances of columns and rows [m].
    x, y : [m], broadcast against each other.
    clamp : points outside take the height of the border; otherwise they are NaN.
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    n_rows, n_cols = heights.shape
    column = (x - corner[0]) / posting[0]
    row = (corner[1] - y) / posting[1]
    if clamp:
        column, row = np.clip(column, 0, n_cols - 1), np.clip(row, 0, n_rows - 1)
    inside = (column >= 0) & (row >= 0) & (column <= n_cols - 1) & (row <= n_rows - 1)
    j = np.clip(np.nan_to_num(column), 0, n_cols - 2).astype(int)
    i = np.clip(np.nan_to_num(row), 0, n_rows - 2).astype(int)
    fx, fy = column - j, row - i
    north = (1 - fx) * heights[i, j] + fx * heights[i, j + 1]
    south = (1 - fx) * heights[i + 1, j] + fx * heights[i + 1, j + 1]
    return np.where(inside, (1 - fy) * north + fy * south, np.nan)
