"""A base refuses what its kind does not heed, and a hole in a slope is filled as a slope."""

from pathlib import Path

import numpy as np
import pytest

from rille.model import InputRefused
from rille.terrain.base import BaseSheet, make_base
from rille.terrain.base.cells import filled
from rille.view.terrain_pictures.slope import _class


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"kind": "flat", "slope": "30 deg"}, "slope"),
        ({"kind": "plane", "slope": "5 deg", "hurst": 0.7}, "hurst"),
        ({"kind": "fractal", "file": "moon.tif"}, "file"),
        ({"kind": "dem", "file": "moon.tif", "median_slope": "3 deg"}, "median_slope"),
    ],
)
def test_what_a_kind_does_not_heed_is_refused(keys, key):
    sheet = BaseSheet(**keys, **({} if keys["kind"] == "dem" else {"size": [10, 10], "posting": 1}))
    with pytest.raises(InputRefused, match=f"does not heed `{key}`"):
        make_base(sheet, Path("scene.toml"), lambda what, fraction: None)


def test_a_hole_in_a_plane_is_a_plane():
    """To the single precision in which GDAL fills what is left above the plane, which is nothing."""
    row, col = np.mgrid[:20, :30]
    plane = 1700.0 + 0.22 * row - 0.1 * col
    holed = plane.copy()
    holed[8:13, 10:13] = np.nan
    assert np.abs(filled(holed, Path("plane.tif")) - plane).max() < 1e-6


def test_a_slope_at_the_edge_of_a_class_has_one_colour():
    """A plane of 10 degrees, as rounding leaves it, that of slopes and that of heights of 3 m at 25 cm in single precision."""
    assert set(_class(10.0 + np.array([-1e-12, 0.0, 1e-12])).tolist()) == {2}
    height = (np.arange(80) * 0.25 * np.tan(np.radians(10.0)) - 1.75).astype(np.float32).astype(float)
    degrees = np.degrees(np.arctan((height[2:] - height[:-2]) / 0.5)).astype(np.float32)
    assert np.abs(degrees - 10.0).max() > 1e-6
    assert set(_class(degrees).tolist()) == {2}
