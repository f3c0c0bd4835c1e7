"""Scenes and DEMs: in, out, real clips, and refusals."""

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from rille.model import InputRefused
from rille.terrain import build, height_at, read_dem, soils
from rille.terrain.base.fractal import fractal
from rille.terrain.delivery import deliver, plan

FLAT = 'name = "s"\nsoil = "lunar_sourcebook"\n[base]\nkind = "flat"\nsize = ["12 m", "8 m"]\nposting = "0.5 m"\n'


def scene(tmp_path, text):
    """Build a scene from text."""
    file = tmp_path / "scene.toml"
    file.write_text(text)
    return build(file)


def geotiff(path, heights, posting=(1.0, 1.0), corner=(100.0, 900.0), crs="EPSG:32633", **more):
    """A small DEM."""
    transform = Affine(posting[0], 0, corner[0], 0, -posting[1], corner[1])
    options = {"driver": "GTiff", "count": 1, "dtype": "float64", "transform": transform, "crs": crs, **more}
    with rasterio.open(path, "w", height=heights.shape[0], width=heights.shape[1], **options) as raster:
        raster.write(heights, 1)
    return path


def test_n_values_bound_n_minus_1_cells(tmp_path):
    terrain = scene(tmp_path, FLAT)
    assert terrain.heights.shape == (17, 25)
    assert (terrain.x_west, terrain.y_north) == (-6.0, 4.0)


def test_a_plane_rises_to_where_it_says(tmp_path):
    terrain = scene(tmp_path, FLAT.replace("flat", "plane") + 'slope = "10 deg"\ndirection = "90 deg"\n')
    rise = np.tan(np.radians(10))
    assert height_at(terrain, 1.3, 2.7) == pytest.approx(2.7 * rise, abs=1e-12)  # towards +y, a bilinear plane is exact


@pytest.mark.parametrize("hurst", [0.3, 0.8])
def test_fractal_ground_has_the_slope_it_was_asked_for(tmp_path, hurst):
    """The median slope between neighbours is set exactly; rounding of 240 x 160 heights leaves 1e-12."""
    terrain = scene(tmp_path, FLAT.replace("flat", "fractal") + f'hurst = {hurst}\nmedian_slope = "4 deg"\n')
    steps = np.concatenate([np.diff(terrain.heights, axis=0).ravel(), np.diff(terrain.heights, axis=1).ravel()])
    assert np.median(np.abs(steps)) / 0.5 == pytest.approx(np.tan(np.radians(4)), rel=1e-12)


def test_equal_seeds_give_equal_ground():
    first, again, other = (fractal((40, 60), 0.1, 0.8, 0.05, seed=s) for s in (1, 1, 2))
    assert first.tobytes() == again.tobytes()
    assert not np.allclose(first, other)


def test_a_geotiff_comes_back_as_it_went_out(tmp_path):
    """Map coordinates, heights and postings survive the way out and in to the last bit of float64."""
    terrain = scene(tmp_path, FLAT.replace("flat", "fractal"))
    deliver(terrain, plan([tmp_path / "out.tif"]))
    with rasterio.open(tmp_path / "out.tif") as raster:
        assert np.array_equal(raster.read(1), terrain.heights)
        assert raster.xy(0, 0) == (terrain.x_west, terrain.y_north)
    assert not (tmp_path / "out.tif.part").exists()


def test_a_dem_is_read_at_its_own_points(tmp_path):
    heights = np.arange(12.0).reshape(3, 4)
    dem = read_dem(geotiff(tmp_path / "d.tif", heights, posting=(2.0, 5.0)))
    assert np.array_equal(dem.heights, heights)
    assert (dem.x_west, dem.y_north, dem.posting_x, dem.posting_y) == (101.0, 897.5, 2.0, 5.0)


@pytest.mark.parametrize("clip", ["moon_aristarchus_imp_5m", "moon_mons_herodotus_54m", "mars_gale_1m"])
def test_real_clips_keep_their_heights(rille_data, tmp_path, clip):
    """Uncut and not resampled, every pixel of a real DEM arrives unmodified, but for the height of the origin."""
    file = rille_data / f"data/dem/{clip}.tif"
    text = f'name = "real"\nsoil = "lunar_sourcebook"\n[base]\nkind = "dem"\nfile = "{file}"\nfill_holes = true\n'
    terrain = scene(tmp_path, text)
    with rasterio.open(file) as raster:
        original = raster.read(1, masked=True).astype(float)
    valid = ~np.ma.getmaskarray(original)
    assert terrain.heights.shape == original.shape
    # a whole number is subtracted, so float32 heights of thousands of metres keep every bit
    assert np.array_equal(terrain.heights[valid] + terrain.map_origin[2], original.data[valid])
    assert "Moon" in terrain.crs or "Mars" in terrain.crs


def test_soils_of_the_library_are_physical():
    for soil in soils().values():
        assert soil.source
        assert 0.3 < soil.sinkage_exponent < 2.5
        assert soil.frictional_modulus > 0
        assert np.radians(10) < soil.friction_angle < np.radians(50)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (FLAT.replace("posting", "postin"), "did you mean 'posting'"),
        (FLAT.replace("lunar_sourcebook", "lunar_sorcebook"), "did you mean 'lunar_sourcebook'"),
        (FLAT.replace("flat", "dem"), "needs `file`"),
        (FLAT.replace('"0.5 m"', '"0.5 s"'), "0.5 s"),
        (FLAT.replace('"0.5 m"', "0"), "at least one cell"),
        (FLAT.replace('"0.5 m"', '"0.1 mm"'), "larger posting"),
        (FLAT + '[[landform]]\nname = "c"\nlandform = "creter"\nx = 0\ny = 0\n', "did you mean 'crater'"),
        (FLAT + '[[soil_patch]]\nname = "p"\nsoil = "mud"\npolygon = [[0, 0], [1, 0], [0, 1]]\n', "mud"),
        (FLAT + '[[soil_patch]]\nname = "p"\nsoil = "lete_sand"\npolygon = [[0, 0], [1, 0]]\n', "polygon"),
        (FLAT + '[[soil_patch]]\nname = "p"\nsoil = "lete_sand"\npolygon = [[0, 0], [2, 2], [2, 0], [0, 2]]\n', "crosses itself"),
        (FLAT + '[[soil_patch]]\nname = "p"\nsoil = "lete_sand"\npolygon = [[0, 0, 0], [1, 0], [0, 1]]\n', "polygon"),
        (FLAT + '[[landform]]\nname = "c"\nlandform = "crater"\nx = 1e308\ny = 0\ndrivers = { diameter = 2 }\n', "nearer origin"),
        (FLAT.replace("flat", "fractal") + "hurst = 1.5\n", "hurst"),
    ],
)
def test_scenes_are_refused_in_one_sentence(tmp_path, text, words):
    with pytest.raises(InputRefused) as refusal:
        scene(tmp_path, text)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_dems_are_refused_in_one_sentence(tmp_path):
    heights = np.zeros((4, 5))
    holes = heights.copy()
    holes[1, 2] = np.nan
    base = 'name = "s"\nsoil = "lunar_sourcebook"\n[base]\nkind = "dem"\nfile = "{}"\n'
    (tmp_path / "text.tif").write_text("no raster")
    cases = {
        tmp_path / "none.tif": "there is no DEM",
        tmp_path / "text.tif": "cannot be read as a raster",
        geotiff(tmp_path / "noproj.tif", heights, crs=None): "no projection",
        geotiff(tmp_path / "degrees.tif", heights, crs="EPSG:4326"): "degrees",
        geotiff(tmp_path / "feet.tif", heights, crs="EPSG:2263"): "not in metres",
        geotiff(tmp_path / "holes.tif", holes, nodata=np.nan): "row 1, column 2",
        geotiff(tmp_path / "south.tif", heights, posting=(1.0, -1.0)): "north-up",
    }
    for file, words in cases.items():
        with pytest.raises(InputRefused) as refusal:
            scene(tmp_path, base.format(file))
        assert words in str(refusal.value), file
    with pytest.raises(InputRefused, match="beyond the DEM"):
        scene(tmp_path, base.format(geotiff(tmp_path / "ok.tif", heights)) + "size = [100, 100]\n")
    filled = scene(tmp_path, base.format(tmp_path / "holes.tif") + "fill_holes = true\n")
    assert np.isfinite(filled.heights).all()


@pytest.mark.parametrize("turned", [False, True])
def test_soil_lies_on_top_where_the_younger_landform_does(tmp_path, turned):
    """Whatever the order in the file: as with heights, the younger one is the last."""
    forms = [
        f'[[landform]]\nname = "{name}"\nlandform = "cone"\nx = 0\ny = 0\nage = "{age} Myr"\nsoil = "{soil}"\n'
        'drivers = { diameter = "6 m", angle = "20 deg" }\n'
        for name, age, soil in (("young", 1, "lunar_soft"), ("old", 300, "lete_sand"))
    ]
    text = '[base]\nkind = "flat"\nsize = ["20 m", "20 m"]\nposting = "0.5 m"\n' + "".join(forms[::-1] if turned else forms)
    path = tmp_path / "aged.toml"
    path.write_text(f'name = "s"\nsoil = "lunar_sourcebook"\n{text}')
    assert [patch.name for patch in build(path).patches] == ["old", "young"]
