"""PDS4: an XML label and a raw image of float64, the archive format of NASA's planetary data."""

import re
from pathlib import Path

from rille.model import InputRefused, Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.gdal_raster import profile_of, write_heights
from rille.terrain.delivery.strips import Progress

NO_VALUE = -1.0e6  # [m]; PDS4 has no NaN


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Label ``path`` and image beside it (same name, ``.img``), map heights, no value = -1e6; written by GDAL's PDS4 driver.

    Raises
    ------
    InputRefused : for a terrain without projection or turned on the map, which PDS4 cannot express, or if it cannot be written.
    """
    if not terrain.crs:
        raise InputRefused(f"terrain '{terrain.name}' has no map projection, which a PDS4 label must name; deliver a GeoTIFF instead")
    if terrain.map_heading != 0.0:
        raise InputRefused(
            f"terrain '{terrain.name}' is turned by {terrain.map_heading:g} rad on the map, which PDS4 cannot express; deliver a GeoTIFF, "
            "or extract it with heading 0"
        )
    name = re.sub(r"[^a-z0-9._-]+", "_", terrain.name.lower())
    variables = {
        "var_logical_identifier": f"urn:rille:terrain:data:{name}",
        "var_title": f"Digital elevation model {terrain.name}",
        "var_investigation_area_name": "rille terrain",
        "var_investigation_area_lid_reference": "urn:rille:terrain:context:investigation",
        "var_observing_system_name": "rille",
        "var_target_type": "Satellite" if "moon" in terrain.crs.lower() else "Planet",
    }
    with appearing(path) as folder:
        profile = profile_of(terrain, driver="PDS4", image_extension="img", **variables)
        write_heights(terrain, folder / path.name, profile | {"nodata": NO_VALUE}, progress, NO_VALUE)
        for stray in folder.glob("*.aux.xml"):
            stray.unlink()
