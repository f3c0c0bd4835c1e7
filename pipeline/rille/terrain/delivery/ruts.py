"""Ruts of a run as a layer on the map of their terrain."""

from dataclasses import replace
from pathlib import Path

from rille.model import Ruts, Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.gdal_raster import TILED, open_to_write, profile_of


def write_ruts(ruts: Ruts, terrain: Terrain, path: Path) -> None:
    """Write the depth of ruts [m] as a GeoTIFF in the map coordinates of their terrain, turned where that is; 0 = untouched.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    place = replace(terrain, heights=ruts.sinkage, posting_x=ruts.posting, posting_y=ruts.posting, x_west=ruts.x_west, y_north=ruts.y_north)
    path = Path(path)
    with appearing(path) as folder:
        profile = profile_of(place, **TILED, predictor=3) | {"nodata": 0.0}
        with open_to_write(folder / path.name, profile) as (raster, put):
            raster.set_band_description(1, "depth [m] below the undisturbed terrain, at the centre of each cell")
            put(0, ruts.sinkage)
