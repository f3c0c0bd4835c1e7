"""Rasters on the map, as GDAL writes them: values at the centres of cells, map heights, turned if the terrain is."""

import errno
import math
import os
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.terrain.delivery.strips import Progress, strips

LOCAL = 'ENGCRS["rille local",EDATUM["origin of the scene"],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]]'


def transform_of(terrain: Terrain) -> Any:
    """Affine from (column, row) of cell corners to (east, north) [m]; the centre of cell (j, i) is the point of column j, row i.

    With phi the heading of W on the map and (x, y) = (x_west + j p_x, y_north - i p_y): E = E0 + cos phi x - sin phi y,
    N = N0 + sin phi x + cos phi y.
    """
    from rasterio.transform import Affine

    c, s = math.cos(terrain.map_heading), math.sin(terrain.map_heading)
    a, b = c * terrain.posting_x, s * terrain.posting_y
    d, e = s * terrain.posting_x, -c * terrain.posting_y
    east, north, _ = terrain.map_origin
    east += c * terrain.x_west - s * terrain.y_north
    north += s * terrain.x_west + c * terrain.y_north
    return Affine(a, b, east - (a + b) / 2, d, e, north - (d + e) / 2)


def profile_of(terrain: Terrain, **more: Any) -> dict[str, Any]:
    """Arguments for ``rasterio.open`` in mode "w"."""
    n_rows, n_cols = terrain.heights.shape
    return {
        "height": n_rows,
        "width": n_cols,
        "count": 1,
        "dtype": "float64",
        "crs": terrain.crs or LOCAL,
        "transform": transform_of(terrain),
        "nodata": float("nan"),
        **more,
    }


TILED = {
    "driver": "GTiff",
    "tiled": True,
    "blockxsize": 512,
    "blockysize": 512,
    "compress": "deflate",
    "zlevel": 1,  # 6 takes a third longer and saves 1 %
    "num_threads": 2,
    "bigtiff": "if_safer",
}


CACHE = 1 << 27  # [bytes] of GDAL; its own choice is a share of all memory


def write_heights(terrain: Terrain, path: Path, profile: dict[str, Any], progress: Progress | None, nodata: float | None = None) -> None:
    """Map heights [m] (z in W plus that of its origin) into a raster of this profile, strip by strip, read back and compared."""

    def rows(what: str) -> Iterator[tuple[int, NDArray[Any]]]:
        for row0, block in strips(terrain, what, progress):
            values = block + terrain.map_origin[2]
            yield row0, values if nodata is None else np.where(np.isnan(values), nodata, values)

    with open_to_write(path, profile) as (raster, put):
        raster.set_band_description(1, "height [m], at the centre of each cell")
        raster.update_tags(1, units="m")
        for row0, values in rows(f"writing {path.name}"):
            put(row0, values)


@contextmanager
def open_to_write(path: Path, profile: dict[str, Any]) -> Iterator[tuple[Any, Callable[[int, NDArray[Any]], None]]]:
    """A raster to write: yields it, and ``put(first row, full rows)`` for its only band. At the end it is read back and compared, since
    GDAL does not always report a full disk when it closes a file.

    Raises
    ------
    OSError : if the file does not hold what was put.
    """
    import rasterio
    from rasterio.windows import Window

    sums: list[tuple[int, int, int]] = []
    with rasterio.Env(GDAL_CACHEMAX=CACHE):
        with hushed():
            raster = rasterio.open(path, "w", **profile)

        def put(row0: int, values: NDArray[Any]) -> None:
            values = np.ascontiguousarray(values, profile["dtype"])
            with hushed():
                raster.write(values, 1, window=Window(0, row0, values.shape[1], values.shape[0]))  # type: ignore[call-arg]
            sums.append((row0, len(values), zlib.crc32(values.data)))

        try:
            yield raster, put
        finally:
            with hushed():
                raster.close()
    check(path, sums)


@contextmanager
def hushed() -> Iterator[None]:
    """Keep libtiff's own lines off stderr: a full disk is one sentence, which we say."""
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with Path(os.devnull).open("wb") as nothing:
            os.dup2(nothing.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def check(path: Path, sums: Iterable[tuple[int, int, int]]) -> None:
    """Compare rows of a raster with the (first row, count, CRC-32) that they should have.

    Raises
    ------
    OSError : if they differ or cannot be read.
    """
    import rasterio
    from rasterio.errors import RasterioError
    from rasterio.windows import Window

    try:
        with rasterio.Env(GDAL_CACHEMAX=CACHE), rasterio.open(path) as raster:
            for row0, count, expected in sums:
                values = raster.read(1, window=Window(0, row0, raster.width, count))  # type: ignore[call-arg]
                if zlib.crc32(np.ascontiguousarray(values).data) != expected:
                    raise OSError(errno.EIO, "it does not hold what was written; is the disk full?")
    except RasterioError:
        raise OSError(errno.EIO, "it is incomplete; is the disk full?") from None


def sums_of(path: Path, rows: int = 512) -> Iterator[tuple[int, int, int]]:
    """(first row, count, CRC-32) of a raster's rows, for :func:`check`."""
    import rasterio
    from rasterio.windows import Window

    with rasterio.open(path) as raster:
        for row0 in range(0, raster.height, rows):
            count = min(rows, raster.height - row0)
            values = raster.read(1, window=Window(0, row0, raster.width, count))  # type: ignore[call-arg]
            yield row0, count, zlib.crc32(np.ascontiguousarray(values).data)
