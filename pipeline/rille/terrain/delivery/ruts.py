"""Ruts of a run as a layer on the map of their terrain."""

from dataclasses import replace
from pathlib import Path

from rille.model import InputRefused, Ruts, Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.formats import FORMATS
from rille.terrain.delivery.gdal_raster import TILED, open_to_write, profile_of


def require_geotiff(path: Path) -> None:
    """Refuse a name that does not end as a GeoTIFF does: programs go by it.

    Raises
    ------
    InputRefused : with a name that would do.
    """
    endings = FORMATS["geotiff"].endings
    if path.suffix.lower() not in endings:
        raise InputRefused(f"'{path}' does not end in {' or '.join(endings)}, and ruts are a GeoTIFF; name it for example {path.stem}.tif")


def write_ruts(ruts: Ruts, terrain: Terrain, path: Path) -> None:
    """Write the depth of ruts [m] as a GeoTIFF in the map coordinates of their terrain, turned where that is; 0 = untouched.

    Raises
    ------
    InputRefused : for a name that is none of a GeoTIFF, or if the file cannot be written.
    """
    require_geotiff(Path(path))
    place = replace(terrain, heights=ruts.sinkage, posting_x=ruts.posting, posting_y=ruts.posting, x_west=ruts.x_west, y_north=ruts.y_north)
    path = Path(path)
    with appearing(path) as folder:
        profile = profile_of(place, **TILED, predictor=3) | {"nodata": 0.0}
        with open_to_write(folder / path.name, profile) as (raster, put):
            raster.set_band_description(1, "depth [m] below the undisturbed terrain, at the centre of each cell")
            put(0, ruts.sinkage)
