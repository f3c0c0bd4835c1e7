"""Triangles seen from above: the highest surface at every point of a grid."""

import numpy as np
from numpy.typing import NDArray

from rille.terrain.grid import Grid

Array = NDArray[np.float64]

MARGIN = 1e-9  # of a posting: points on a common edge belong to both triangles, so that none is missed
MOST = 4_000_000  # points evaluated at once


def rasterise(vertices: Array, triangles: NDArray[np.integer], grid: Grid) -> Array:
    """Heights [m] of the highest triangle over each point of a grid, (n_rows, n_cols); NaN where there is none.

    Every point is evaluated exactly in the plane of each triangle above it (barycentric interpolation), row by row: a row cuts a
    triangle in a span. Triangles that stand upright have no area in plan and are seen by their neighbours' edges.

    Parameters
    ----------
    vertices : (n, 3) [m] in the grid's frame. triangles : (m, 3) indices of vertices.
    """
    corners = np.asarray(vertices, np.float64)[np.asarray(triangles)]  # (m, 3, 3)
    column = (corners[:, :, 0] - grid.x_west) / grid.posting_x
    row = (grid.y_north - corners[:, :, 1]) / grid.posting_y
    points = np.stack([column, row, corners[:, :, 2]], axis=2)
    first, second = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    area = first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]
    size = np.maximum(np.abs(first[:, :2]).max(axis=1), np.abs(second[:, :2]).max(axis=1))
    seen = np.abs(area) > 1e-12 * np.maximum(size, MARGIN) ** 2
    points, first, second, area = points[seen], first[seen], second[seen], area[seen]
    slope_column = (first[:, 2] * second[:, 1] - second[:, 2] * first[:, 1]) / area
    slope_row = (second[:, 2] * first[:, 0] - first[:, 2] * second[:, 0]) / area
    low, high = points[:, :, 2].min(axis=1), points[:, :, 2].max(axis=1)

    heights = np.full(grid.n_rows * grid.n_cols, -np.inf)
    top = np.maximum(np.ceil(points[:, :, 1].min(axis=1) - MARGIN), 0).astype(np.int64)
    bottom = np.minimum(np.floor(points[:, :, 1].max(axis=1) + MARGIN), grid.n_rows - 1).astype(np.int64)
    for some in _portions(np.maximum(bottom - top + 1, 0)):
        which, rows = _spread(top[some], bottom[some])
        which = some[which]
        left, right = _span(points[which], rows)
        start = np.maximum(np.ceil(left - MARGIN), 0).astype(np.int64)
        end = np.minimum(np.floor(right + MARGIN), grid.n_cols - 1).astype(np.int64)
        for part in _portions(np.maximum(end - start + 1, 0)):
            span, columns = _spread(start[part], end[part])
            t, r = which[part][span], rows[part][span]
            z = points[t, 0, 2] + slope_column[t] * (columns - points[t, 0, 0]) + slope_row[t] * (r - points[t, 0, 1])
            np.maximum.at(heights, r * grid.n_cols + columns, np.clip(z, low[t], high[t]))
    return np.where(np.isneginf(heights), np.nan, heights).reshape(grid.shape)


def _span(corners: Array, rows: NDArray[np.int64]) -> tuple[Array, Array]:
    """Where rows (n,) cut triangles (n, 3, 3): least and largest column."""
    left, right = np.full(len(rows), np.inf), np.full(len(rows), -np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        start, end = corners[:, a], corners[:, b]
        low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
        met = (rows >= low - MARGIN) & (rows <= high + MARGIN)
        fall = end[:, 1] - start[:, 1]
        level = np.abs(fall) <= MARGIN
        share = np.clip((rows - start[:, 1]) / np.where(level, 1.0, fall), 0.0, 1.0)
        cut = start[:, 0] + share * (end[:, 0] - start[:, 0])
        least = np.where(level, np.minimum(start[:, 0], end[:, 0]), cut)
        most = np.where(level, np.maximum(start[:, 0], end[:, 0]), cut)
        left = np.where(met, np.minimum(left, least), left)
        right = np.where(met, np.maximum(right, most), right)
    empty = left > right
    return np.where(empty, 1.0, left), np.where(empty, 0.0, right)


def _spread(start: NDArray[np.int64], end: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Every integer of the ranges start..end, with the number of its range."""
    counts = np.maximum(end - start + 1, 0)
    which = np.repeat(np.arange(len(start)), counts)
    offset = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    return which, start[which] + offset


def _portions(counts: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Indices of what counts at all, in portions of about ``MOST``."""
    some = np.flatnonzero(counts)
    if len(some) == 0:
        return []
    ends = np.cumsum(counts[some])
    return np.split(some, np.flatnonzero(np.diff(ends // MOST)) + 1)
