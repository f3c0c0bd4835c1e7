"""Soil map: GeoTIFF of one byte per point, with colours and names."""

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from rille.model import InputRefused, Terrain
from rille.model.polygon import soil_codes, soil_names
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.gdal_raster import TILED, open_to_write, profile_of
from rille.terrain.delivery.strips import Progress, strips

NO_VALUE = 255
# Colour-blind safe (Okabe & Ito 2008), then repeated.
COLORS = ((187, 187, 187), (230, 159, 0), (86, 180, 233), (0, 158, 115), (240, 228, 66), (0, 114, 178), (213, 94, 0), (204, 121, 167))


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Soil of every point as uint8 GeoTIFF: 0 the ground's, then those of patches; 255 where there is no height.

    Names stand in the tags ``soil_0``, ... and, as GDAL's category names, in ``NAME.tif.aux.xml``; colours in the file's table.

    Raises
    ------
    InputRefused : for more than 255 soils, or if it cannot be written.
    """
    names = soil_names(terrain.soil, terrain.patches)
    if len(names) > NO_VALUE:
        raise InputRefused(f"terrain '{terrain.name}' has {len(names)} soils, but a soil map has at most {NO_VALUE}; merge some")
    n_rows, n_cols = terrain.heights.shape
    x = terrain.x_west + np.arange(n_cols, dtype=np.float64) * terrain.posting_x
    y = terrain.y_north - np.arange(n_rows, dtype=np.float64) * terrain.posting_y
    with appearing(path) as folder:
        profile = profile_of(terrain, **TILED) | {"dtype": "uint8", "nodata": NO_VALUE}
        with open_to_write(folder / path.name, profile) as (raster, put):
            raster.write_colormap(1, {k: (*COLORS[k % len(COLORS)], 255) for k in range(len(names))})
            raster.update_tags(1, **{f"soil_{k}": name for k, name in enumerate(names)})
            raster.set_band_description(1, "soil, at the centre of each cell")
            for row0, block in strips(terrain, f"writing {path.name}", progress):
                codes = soil_codes(terrain.soil, terrain.patches, x, y[row0 : row0 + len(block)])
                put(row0, np.where(np.isnan(block), NO_VALUE, codes))
        categories = "".join(f"<Category>{escape(name)}</Category>" for name in names)
        (folder / f"{path.name}.aux.xml").write_text(
            f'<PAMDataset><PAMRasterBand band="1"><CategoryNames>{categories}</CategoryNames></PAMRasterBand></PAMDataset>\n'
        )
