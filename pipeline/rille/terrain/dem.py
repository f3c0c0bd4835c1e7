"""Digital elevation models read; :mod:`rille.terrain.raster` says how cells become points, :mod:`rille.terrain.delivery` writes."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.grid import bilinear
from rille.model.sheet import data_folder
from rille.terrain.raster import open_raster

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Dem:
    """A DEM in map coordinates.

    heights : [m], (n_rows, n_cols), row 0 north, NaN = no value. x_west, y_north : map coordinates of value (0, 0) [m].
    crs : WKT of the projection.
    """

    heights: Array
    posting_x: float
    posting_y: float
    x_west: float
    y_north: float
    crs: str


def read_dem(path: Path, band: int = 1) -> Dem:
    """Read one band of a north-up raster.

    Raises
    ------
    InputRefused : for what :func:`rille.terrain.raster.open_raster` refuses, and marks for "no value" that are not declared.
    """
    raster = open_raster(path, band)
    n_rows, n_cols = raster.shape
    heights = raster.read((0, n_rows), (0, n_cols))
    marks = raster.lost_marks()
    marks.look(heights)
    marks.refuse()
    return Dem(
        heights=heights,
        posting_x=raster.posting[0],
        posting_y=raster.posting[1],
        x_west=raster.corner[0],
        y_north=raster.corner[1],
        crs=raster.crs,
    )


def height_at(terrain: Terrain, x: Array | float, y: Array | float) -> Array:
    """Bilinear height [m] at (x, y) [m] in W; NaN outside."""
    return bilinear(terrain.heights, (terrain.x_west, terrain.y_north), (terrain.posting_x, terrain.posting_y), x, y)


def relative_to_data(path: Path) -> str:
    """A path as it is shown in a source: relative to the folder of the real data where it lies in it."""
    whole, data = Path(path).resolve(), data_folder()
    return str(whole.relative_to(data)) if whole.is_relative_to(data) else str(path)
