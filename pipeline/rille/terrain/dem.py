"""Digital elevation models in and out.

GDAL's rasters are cells; a height in a cell is taken as the height at the cell's centre. A raster of n columns therefore becomes n
heights, n - 1 cells apart, whose outermost points lie half a cell inside the raster's border.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Ruts, Terrain
from rille.model.grid import bilinear

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


def read_dem(path: Path) -> Dem:
    """Read the first band of a north-up raster.

    Raises
    ------
    InputRefused : for a missing file, no raster, no projection, a projection that is not in metres, or a rotated raster.
    """
    import rasterio
    from rasterio.errors import RasterioError

    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no DEM '{path}'")
    try:
        with rasterio.open(path) as raster:
            heights = raster.read(1, masked=True).astype(np.float64).filled(np.nan)
            transform, crs = raster.transform, raster.crs
    except RasterioError as error:
        raise InputRefused(f"'{path}' cannot be read as a raster: {error}") from None
    if min(heights.shape) < 2:
        raise InputRefused(f"'{path}' has {heights.shape[0]} x {heights.shape[1]} heights; at least 2 x 2 are needed")
    if crs is None:
        raise InputRefused(f"'{path}' has no projection, so its scale is unknown; assign one (gdal_edit -a_srs)")
    if not crs.is_projected:
        raise InputRefused(f"'{path}' is in degrees, not in metres; project it first (gdalwarp -t_srs)")
    factor = crs.linear_units_factor[1]
    if abs(factor - 1) > 1e-9:
        raise InputRefused(f"'{path}' is in {crs.linear_units_factor[0]}, not in metres; project it first (gdalwarp -t_srs)")
    if transform.b != 0 or transform.d != 0 or transform.a <= 0 or transform.e >= 0:
        raise InputRefused(f"'{path}' is not north-up (rotated or flipped); warp it first (gdalwarp)")
    return Dem(
        heights=heights,
        posting_x=float(transform.a),
        posting_y=float(-transform.e),
        x_west=float(transform.c + transform.a / 2),
        y_north=float(transform.f + transform.e / 2),
        crs=crs.to_wkt(),
    )


def write_geotiff(terrain: Terrain, path: Path) -> None:
    """Write the heights as a tiled float64 GeoTIFF in map coordinates; the file appears complete or not at all.

    Heights are map heights: z in W plus the height of W's origin.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    corner = (terrain.x_west - terrain.posting_x / 2, terrain.y_north + terrain.posting_y / 2)
    _write(terrain.heights + terrain.map_origin[2], corner, (terrain.posting_x, terrain.posting_y), terrain, path, float("nan"))


def write_ruts(ruts: Ruts, terrain: Terrain, path: Path) -> None:
    """Write the depth of ruts [m] as a GeoTIFF in the map coordinates of their terrain; 0 = untouched.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    corner = (ruts.x_west - ruts.posting / 2, ruts.y_north + ruts.posting / 2)
    _write(ruts.sinkage, corner, (ruts.posting, ruts.posting), terrain, path, 0.0)


def _write(values: Array, corner: tuple[float, float], posting: tuple[float, float], terrain: Terrain, path: Path, nodata: float) -> None:
    """corner: north-west corner of the north-western cell [m] in W."""
    import rasterio
    from rasterio.errors import RasterioError
    from rasterio.transform import Affine

    path = Path(path)
    east, north, _ = terrain.map_origin
    part = path.with_name(path.name + ".part")
    try:
        with rasterio.open(
            part,
            "w",
            driver="GTiff",
            height=values.shape[0],
            width=values.shape[1],
            count=1,
            dtype="float64",
            crs=terrain.crs
            or 'ENGCRS["rille local",EDATUM["start of the scene"],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]]',
            transform=Affine(posting[0], 0, east + corner[0], 0, -posting[1], north + corner[1]),
            nodata=nodata,
            tiled=True,
            compress="deflate",
            predictor=3,
        ) as raster:
            raster.write(values, 1)
        part.replace(path)
    except (RasterioError, OSError) as error:
        part.unlink(missing_ok=True)
        raise InputRefused(f"'{path}' could not be written: {error}") from None


def height_at(terrain: Terrain, x: Array | float, y: Array | float) -> Array:
    """Bilinear height [m] at (x, y) [m] in W; NaN outside."""
    return bilinear(terrain.heights, (terrain.x_west, terrain.y_north), (terrain.posting_x, terrain.posting_y), x, y)


def relative_to_data(path: Path) -> str:
    """A path as it is shown in a source: relative to ``RILLE_DATA`` where it lies in it."""
    data = os.environ.get("RILLE_DATA")
    if data and Path(path).resolve().is_relative_to(Path(data).resolve()):
        return str(Path(path).resolve().relative_to(Path(data).resolve()))
    return str(path)
