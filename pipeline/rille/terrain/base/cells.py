"""The values of a DEM that a scene rests on: in memory where they are few, otherwise read from the file block by block."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.terrain.base.blocks import Blocks
from rille.terrain.base.lattice import Lattice, Range, Stored
from rille.terrain.raster import Raster

Array = NDArray[np.float64]

MOST_RESIDENT = 16_000_000  # values, 128 MB
BLOCK = 1024  # values across


class HeightsMissing(InputRefused):
    """A DEM lacks heights that a scene needs and does not ask to be filled. count : how many."""

    def __init__(self, path: Path, count: int, first: NDArray[np.intp]) -> None:
        """Of a file; first : row and column."""
        self.count = count
        super().__init__(
            f"'{path}' has {count} heights missing, the first at row {first[0]}, column {first[1]}; set fill_holes = true in [base] to "
            "interpolate them (the others stay as they are), or give [base] a size and a center without them"
        )


def cells(raster: Raster, rows: Range, cols: Range, *, halo: int, fill: bool) -> tuple[Lattice, Stored | None]:
    """The values of a part of a DEM, and marks: 1 where one was missing and is interpolated, 0 elsewhere; None if none was missing.

    Parameters
    ----------
    rows, cols : first and last + 1 of the part that must be known. halo : values around it that are answered, too, missing or not.
    fill : interpolate missing values.

    Raises
    ------
    HeightsMissing : for missing values that are not to be filled.
    InputRefused : if they lie in a part too large to be filled in memory; for marks of missing values that are not declared.
    """
    wide_rows, wide_cols = ((max(a - halo, 0), min(b + halo, n)) for (a, b), n in zip((rows, cols), raster.shape, strict=True))
    if (rows[1] - rows[0]) * (cols[1] - cols[0]) > MOST_RESIDENT:
        _refuse_holes(raster, rows, cols, fill)
        return Blocks(rows=wide_rows, cols=wide_cols, size=BLOCK, load=raster.read), None
    values = raster.read(wide_rows, wide_cols)
    marks = raster.lost_marks()
    marks.look(values)
    marks.refuse()
    inner = slice(rows[0] - wide_rows[0], rows[1] - wide_rows[0]), slice(cols[0] - wide_cols[0], cols[1] - wide_cols[0])
    holes = np.isnan(values[inner])
    if not holes.any():
        return Stored(values, wide_rows[0], wide_cols[0]), None
    if not fill:
        raise HeightsMissing(raster.path, int(holes.sum()), np.argwhere(holes)[0] + (rows[0], cols[0]))
    return Stored(filled(values, raster.path), wide_rows[0], wide_cols[0]), Stored(holes.astype(np.float64), rows[0], cols[0])


def filled(values: Array, path: Path) -> Array:
    """Values with the missing ones (NaN) interpolated from around: a plane through all, and on it by inverse distance (GDALFillNodata), so
    that a hole in a slope is a slope.

    Raises
    ------
    InputRefused : if there is no value at all.
    """
    holes = np.isnan(values)
    if holes.all():
        raise InputRefused(f"'{path}' has no height at all in the region; choose another region")
    from rasterio.fill import fillnodata

    plane = _plane(values, ~holes)
    guess = fillnodata(  # GDAL fills in float32
        np.where(holes, 0.0, values - plane), mask=(~holes).astype(np.uint8), max_search_distance=float(np.hypot(*values.shape))
    )
    return np.where(holes, guess + plane, values)


def _plane(values: Array, known: NDArray[np.bool_]) -> Array:
    """The plane through the known values, by least squares, at all of them."""
    rows, cols = np.nonzero(known)
    middle = rows.mean(), cols.mean()
    terms = np.column_stack([np.ones(len(rows)), rows - middle[0], cols - middle[1]])
    level, down, right = np.linalg.lstsq(terms, values[known], rcond=None)[0]
    row, col = np.ogrid[: values.shape[0], : values.shape[1]]
    return level + down * (row - middle[0]) + right * (col - middle[1])


def _refuse_holes(raster: Raster, rows: Range, cols: Range, fill: bool) -> None:
    """Look through a large part in strips."""
    count, first, row, marks = 0, None, rows[0], raster.lost_marks()
    for heights in raster.strips(rows, cols):
        marks.look(heights)
        holes = np.isnan(heights)
        if first is None and holes.any():
            first = np.argwhere(holes)[0] + (row, cols[0])
        count += int(holes.sum())
        row += len(heights)
    marks.refuse()
    if first is None:
        return
    if not fill:
        raise HeightsMissing(raster.path, count, first)
    raise InputRefused(
        f"'{raster.path}' has {count} heights missing in a region of more than {MOST_RESIDENT} heights, too many to fill them here; "
        "fill them in the file (gdal_fillnodata) or choose a smaller region"
    )
