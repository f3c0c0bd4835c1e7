"""Points inside polygons and soils on a grid: the solver's own rule, so that maps and wheels agree."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.terrain import SoilPatch

Array = NDArray[np.float64]


def inside_polygon(corners: Sequence[tuple[float, float]] | Array, x: Array, y: Array) -> NDArray[np.bool_]:
    """Which points of a grid lie inside a polygon, by the even-odd rule (Shimrat 1962, Algorithm 112).

    A point is inside if an odd number of edges a-b with (a_y > y) != (b_y > y) cross its row at x_c > x,
    x_c = (b_x - a_x) (y - a_y) / (b_y - a_y) + a_x, evaluated as the solver does.

    Parameters
    ----------
    corners : (n >= 3, 2) [m], closed by itself.
    x : columns (n_cols,) [m], ascending. y : rows (n_rows,) [m].

    Returns
    -------
    (n_rows, n_cols) of bool.
    """
    a = np.asarray(corners, np.float64)
    b = np.roll(a, 1, axis=0)
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    edge, row = np.nonzero((a[:, 1, None] > y) != (b[:, 1, None] > y))
    a, b = a[edge], b[edge]
    crossing = (b[:, 0] - a[:, 0]) * (y[row] - a[:, 1]) / (b[:, 1] - a[:, 1]) + a[:, 0]
    first = np.searchsorted(x, crossing, side="left")  # columns before it lie west of the crossing
    width = x.size + 1
    count = np.bincount(row * width + first, minlength=y.size * width).reshape(y.size, width)
    return (np.cumsum(count[:, :0:-1], axis=1)[:, ::-1] & 1).astype(bool)


def is_simple(corners: Sequence[tuple[float, float]] | Array) -> bool:
    """True if a polygon of corners (n >= 3, 2) [m] does not cross itself and has an area."""
    import shapely

    shape = shapely.Polygon(corners)
    return bool(shape.is_valid) and shape.area > 0


def soil_names(soil: str, patches: Sequence[SoilPatch]) -> tuple[str, ...]:
    """Soils of a terrain in the order of their codes: that of the ground first, then those of patches."""
    return tuple(dict.fromkeys([soil, *(patch.soil for patch in patches)]))


def soil_codes(soil: str, patches: Sequence[SoilPatch], x: Array, y: Array) -> NDArray[np.int32]:
    """Soil of every point of a grid, as an index into ``soil_names``; later patches lie on earlier ones.

    x : columns (n_cols,) [m], ascending. y : rows (n_rows,) [m], descending. Returns (n_rows, n_cols).
    """
    names = soil_names(soil, patches)
    codes = np.zeros((len(y), len(x)), np.int32)
    for patch in patches:
        corners = np.asarray(patch.polygon, np.float64)
        (west, south), (east, north) = corners.min(axis=0), corners.max(axis=0)
        c0, c1 = np.searchsorted(x, west, side="left"), np.searchsorted(x, east, side="right")
        r0, r1 = np.searchsorted(-y, -north, side="left"), np.searchsorted(-y, -south, side="right")
        if c0 < c1 and r0 < r1:
            codes[r0:r1, c0:c1][inside_polygon(corners, x[c0:c1], y[r0:r1])] = names.index(patch.soil)
    return codes
