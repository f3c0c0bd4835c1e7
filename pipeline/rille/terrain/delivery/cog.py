"""Cloud-optimised GeoTIFF: the GeoTIFF with overviews, laid out for reading in parts over a network."""

from pathlib import Path

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.gdal_raster import CACHE, TILED, check, hushed, profile_of, sums_of, write_heights
from rille.terrain.delivery.strips import Progress


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Heights as COG (OGC 21-026); overviews hold every second, fourth, ... value, nothing is averaged.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    import rasterio
    from rasterio.shutil import copy

    with appearing(path) as folder:
        plain = folder / f"{path.name}.plain"
        write_heights(terrain, plain, profile_of(terrain, **TILED) | {"compress": "none"}, progress)
        with rasterio.Env(GDAL_CACHEMAX=CACHE), hushed():
            copy(
                plain,
                folder / path.name,
                driver="COG",
                compress="deflate",
                level=1,
                predictor="yes",
                overview_resampling="nearest",
                num_threads=2,
                bigtiff="if_safer",
            )
        check(folder / path.name, sums_of(plain))
        plain.unlink()
