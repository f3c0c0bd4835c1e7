"""GeoTIFF: float64 map heights, tiled, turned where the terrain is."""

from pathlib import Path

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.gdal_raster import TILED, profile_of, write_heights
from rille.terrain.delivery.strips import Progress


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Heights as GeoTIFF (OGC 19-008r4), no value = NaN, without loss.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    path = Path(path)
    with appearing(path) as folder:
        write_heights(terrain, folder / path.name, profile_of(terrain, **TILED, predictor=3), progress)
