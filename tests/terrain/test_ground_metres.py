"""A metre of a map is a metre on the ground, or the ground is refused: scales of Mercator and equirectangular maps in closed form."""

import numpy as np
import pytest
import rasterio
from rasterio.crs import CRS
from rasterio.transform import Affine

from rille.model import InputRefused
from rille.terrain import build

MOON = "+proj={} +R=1737400 +units=m +no_defs"
MERCATOR_60 = 8_399_738.0  # [m] EPSG:3857 at 60 degrees north: R ln tan(pi/4 + phi/2)


def ground(tmp_path, crs, corner):
    """A flat DEM of 20 x 20 m, built into a terrain."""
    path = tmp_path / "d.tif"
    options = {"driver": "GTiff", "count": 1, "dtype": "float32", "crs": CRS.from_user_input(crs)}
    with rasterio.open(path, "w", height=21, width=21, transform=Affine(1, 0, corner[0], 0, -1, corner[1]), **options) as raster:
        raster.write(np.zeros((21, 21), np.float32), 1)
    scene = tmp_path / "s.toml"
    scene.write_text(f'name = "s"\nsoil = "lunar_sourcebook"\n[base]\nkind = "dem"\nfile = "{path}"\n')
    return build(scene)


@pytest.mark.parametrize(
    ("crs", "corner", "meridian", "parallel"),
    [
        ("EPSG:3857", (1e6, MERCATOR_60), "2 times", "2 times"),  # k = 1/cos(60 deg), Snyder 1987 ch. 7
        (MOON.format("eqc"), (0.0, np.radians(45) * 1737400), "1 times", "1.41 times"),  # h = 1, k = 1/cos(45 deg), ch. 12
    ],
)
def test_maps_that_stretch_are_refused_with_their_scale(tmp_path, crs, corner, meridian, parallel):
    with pytest.raises(InputRefused) as refusal:
        ground(tmp_path, crs, corner)
    assert f"{meridian} too long along the meridian and {parallel} along the parallel" in str(refusal.value)
    assert "gdalwarp -t_srs '+proj=stere" in str(refusal.value)


@pytest.mark.parametrize(
    ("crs", "corner"),
    [
        ("EPSG:32633", (8e5, 5e6)),  # UTM: at most 0.1 % in its zone
        ("EPSG:3857", (0.0, 0.0)),
        (MOON.format("eqc"), (0.0, np.radians(10) * 1737400)),  # 1.5 %
        (MOON.format("stere +lat_0=-90"), (1e5, 1e5)),  # 140 km from the pole: 0.2 %
    ],
)
def test_maps_that_are_true_there_are_taken(tmp_path, crs, corner):
    assert ground(tmp_path, crs, corner).heights.shape == (21, 21)


def test_what_the_refusal_advises_is_true_there(tmp_path):
    with pytest.raises(InputRefused) as refusal:
        ground(tmp_path, "EPSG:3857", (1e6, MERCATOR_60))
    advice = str(refusal.value).partition("'+")[2].partition("'")[0]
    assert ground(tmp_path, "+" + advice, (0.0, 0.0)).heights.shape == (21, 21)
