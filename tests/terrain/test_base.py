"""Bases of a scene: planes, fractals of any size, measured DEMs. Windows give the bytes of the whole, everywhere."""

import math
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest
import rasterio
import rasterio.shutil
from rasterio.transform import Affine

from rille.model import InputRefused
from rille.model.grid import bilinear
from rille.terrain import raster as raster_module
from rille.terrain import read_dem
from rille.terrain.base import BaseSheet, make_base
from rille.terrain.base import cells as cells_module
from rille.terrain.base import means as means_module
from rille.terrain.base.fractal import MOST_DIRECT, fractal, fractal_lattice
from rille.terrain.base.spectrum import power_spectrum
from rille.terrain.extraction import extract_from_scene
from rille.terrain.grid import Grid, Window


def silent(what, fraction):
    """No progress."""


def base_of(**keys):
    """A base from the keys of [base]."""
    return make_base(BaseSheet(**keys), Path("scene.toml"), silent)


def raster_file(path, heights, posting=(2.0, 2.0), corner=(1000.0, 9000.0), crs="EPSG:32633", driver="GTiff", tags=None, **more):
    """A DEM file; corner : north-west corner of the north-western cell."""
    heights = heights if heights.ndim == 3 else heights[None]
    options = {"driver": driver, "count": heights.shape[0], "dtype": heights.dtype, "crs": crs, **more}
    transform = Affine(posting[0], 0, corner[0], 0, -posting[1], corner[1])
    with rasterio.open(path, "w", height=heights.shape[1], width=heights.shape[2], transform=transform, **options) as raster:
        raster.write(heights)
        for name, value in (tags or {}).items():
            setattr(raster, name, (value,) * heights.shape[0])
    return path


def hills(n_rows=60, n_cols=80, seed=0):
    """Rough ground without symmetry."""
    return fractal((n_rows, n_cols), 2.0, 0.8, math.radians(8), seed) + 700.0


def turned(base, half=6.0, posting=0.37, heading=0.6, n=23):
    """A turned grid of n x n + 4 values around the middle of a ground's grid."""
    g = base.grid
    x, y = g.x_west + (g.n_cols - 1) * g.posting_x / 2, g.y_north - (g.n_rows - 1) * g.posting_y / 2
    return Grid(
        n_rows=n, n_cols=n + 4, posting_x=posting, posting_y=posting, x_west=-half, y_north=half, origin=(x + 1.3, y - 0.7), heading=heading
    )


GROUNDS = {
    "plane": {"kind": "plane", "slope": "7 deg", "direction": "30 deg", "size": [40, 30], "posting": 0.5},
    "fractal": {"kind": "fractal", "size": [40, 30], "posting": 0.5, "seed": 2},
    "large fractal": {"kind": "fractal", "size": [1200, 1000], "posting": 0.5, "seed": 2},
    "dem": {"kind": "dem", "size": [80, 60], "posting": 0.5},
    "own points": {"kind": "dem"},
    "means": {"kind": "dem", "size": [80, 60], "posting": 0.5, "values": "means"},
    "detail": {"kind": "dem", "size": [80, 60], "posting": 0.5, "detail": {}},
}


def ground(tmp_path, keys):
    """One of GROUNDS, its DEM written."""
    file = {"file": str(raster_file(tmp_path / "hills.tif", hills()))} if keys["kind"] == "dem" else {}
    return base_of(**file, **keys)


@pytest.mark.parametrize("keys", GROUNDS.values(), ids=GROUNDS)
def test_a_window_has_the_bytes_of_the_whole(tmp_path, keys):
    """Scene's own grid, a turned one and one of another posting: any window of each, and points one by one."""
    made = ground(tmp_path, keys)
    own = made.grid
    finer = Grid(n_rows=40, n_cols=50, posting_x=0.2, posting_y=0.3, x_west=own.x_west + 5.1, y_north=own.y_north - 6.3)
    for grid in (own, turned(made), finer):
        part = Window(row0=grid.n_rows // 3, row1=grid.n_rows // 3 + 17, col0=5, col1=grid.n_cols - 3)
        around = Window(row0=part.row0 - 3, row1=part.row1 + 2, col0=1, col1=grid.n_cols - 1)
        window, wider = made.base.window(grid, part), made.base.window(grid, around)
        assert window.shape == part.shape
        assert np.isfinite(window).all()
        assert window.tobytes() == wider[3 : 3 + window.shape[0], 4 : 4 + window.shape[1]].tobytes()
        again = ground(tmp_path, keys)
        assert window.tobytes() == again.base.window(grid, part).tobytes()
        # points: the same surface; the last bits of x and y of a point that is turned there and back may differ
        assert made.base.at(*grid.points(part)) == pytest.approx(window, abs=1e-9)


@pytest.mark.parametrize("name", ["fractal", "large fractal", "dem", "own points"])
def test_between_its_points_the_ground_is_the_solvers_bilinear_surface(tmp_path, name):
    made = ground(tmp_path, GROUNDS[name])
    values, grid = made.base.window(made.grid, made.grid.whole), made.grid
    x, y = turned(made).points(turned(made).whole)
    surface = made.base.at(x, y)
    if name == "dem":  # its lattice is the file's, not the scene's
        lattice = ground(tmp_path, GROUNDS["own points"])
        values, grid = lattice.base.window(lattice.grid, lattice.grid.whole), lattice.grid
        values = values + lattice.map_origin[2] - made.map_origin[2]
    assert surface == pytest.approx(bilinear(values, (grid.x_west, grid.y_north), (grid.posting_x, grid.posting_y), x, y), abs=1e-9)


def test_a_plane_is_known_everywhere():
    made = base_of(kind="plane", slope="7 deg", direction="30 deg", size=[4, 4], posting=1)
    x, y = np.array([3.0, 500.0]), np.array([-2.0, 40.0])
    assert made.base.at(x, y) == pytest.approx(np.tan(np.radians(7)) * (np.cos(np.pi / 6) * x + np.sin(np.pi / 6) * y), rel=1e-14)


@pytest.mark.parametrize("name", ["fractal", "dem", "means", "detail"])
def test_nothing_is_known_outside(tmp_path, name):
    made = ground(tmp_path, GROUNDS[name])
    assert np.isnan(made.base.at(np.array([0.0, 1e4, 0.0]), np.array([1e4, 0.0, -1e4]))).all()
    g = made.grid
    wider = Grid(n_rows=5, n_cols=5, posting_x=g.posting_x, posting_y=g.posting_y, x_west=g.x_west - 40, y_north=g.y_north)
    assert np.isnan(made.base.window(wider, wider.whole)).all()


def test_the_digest_changes_with_the_heights(tmp_path):
    same = [ground(tmp_path, keys).base.digest for keys in GROUNDS.values()]
    assert same == [ground(tmp_path, keys).base.digest for keys in GROUNDS.values()]
    other = {**GROUNDS["fractal"], "seed": 3}, {**GROUNDS["detail"], "detail": {"strength": 0.5}}, {**GROUNDS["dem"], "values": "means"}
    digests = [*same, *(ground(tmp_path, keys).base.digest for keys in other)]
    raster_file(tmp_path / "moved.tif", hills() + 0.01)
    digests.append(base_of(file=str(tmp_path / "moved.tif"), **GROUNDS["dem"]).base.digest)
    assert len(set(digests)) == len(digests) - 1  # "means" is among GROUNDS


# --- fractals ------------------------------------------------------------------------------------------------------------------------


def test_the_digest_changes_with_files_that_a_dem_refers_to(tmp_path):
    """A virtual raster holds no heights itself: other heights in the file that it names are another ground."""
    raster_file(tmp_path / "heights.tif", hills())
    rasterio.shutil.copy(tmp_path / "heights.tif", tmp_path / "dem.vrt", driver="VRT")
    virtual = (tmp_path / "dem.vrt").read_bytes()
    first = base_of(kind="dem", file=str(tmp_path / "dem.vrt")).base.digest
    assert base_of(kind="dem", file=str(tmp_path / "dem.vrt")).base.digest == first
    raster_file(tmp_path / "heights.tif", hills() + 0.25)
    assert (tmp_path / "dem.vrt").read_bytes() == virtual
    assert base_of(kind="dem", file=str(tmp_path / "dem.vrt")).base.digest != first


@pytest.mark.parametrize("hurst", [0.2, 0.5, 0.8, 0.95])
def test_fractals_have_the_hurst_exponent_they_were_asked_for(hurst):
    """Mean square differences grow as L^(2 H) over lags of 1 to 32 postings, within 5 %: means of 12 grounds of 400 x 600, since one of
    them scatters by 0.03 where H is large and few long waves carry the power."""
    lags = 2 ** np.arange(6)
    fields = [fractal((400, 600), 0.5, hurst, math.radians(4), seed) for seed in range(12)]
    squares = np.mean([deviogram(field / deviogram(field, [1])[0], lags) ** 2 for field in fields], axis=0)
    assert np.polyfit(np.log(lags), np.log(squares), 1)[0] / 2 == pytest.approx(hurst, rel=0.05)


def deviogram(field, lags):
    """RMS height difference [m] at lags of whole postings, along rows and columns."""
    return np.array(
        [math.sqrt((np.mean((field[lag:] - field[:-lag]) ** 2) + np.mean((field[:, lag:] - field[:, :-lag]) ** 2)) / 2) for lag in lags]
    )


@pytest.mark.parametrize("hurst", [0.5, 0.8, 0.95])
def test_large_fractals_have_the_hurst_exponent_and_slope_they_were_asked_for(hurst):
    """H within 5 % over lags of 2 to 64 postings, within 10 % from 64 to 256, across the joints of levels at 32 to 64 and at 256 to 512
    postings. One ground of 2560 x 2560 scatters by 0.015 and 0.05 (its long waves are few), so two are averaged.
    The median slope is set by a sample of a million neighbours: 1 %."""
    near, far, slopes = [], [], []
    for seed in range(2):
        lattice = fractal_lattice((2560, 2560), 0.5, hurst, math.radians(4), seed)
        field = lattice.outer(np.arange(2560), np.arange(2560))
        lags = 2 ** np.arange(9)
        deviation = np.log(deviogram(field, lags))
        near.append(np.polyfit(np.log(lags[1:7]), deviation[1:7], 1)[0])
        far.append(np.polyfit(np.log(lags[6:]), deviation[6:], 1)[0])
        slopes.append(np.median(np.abs(np.concatenate([np.diff(field, axis=0).ravel(), np.diff(field, axis=1).ravel()]))) / 0.5)
    assert np.mean(near) == pytest.approx(hurst, rel=0.05)
    assert np.mean(far) == pytest.approx(hurst, rel=0.1)
    assert np.mean(slopes) == pytest.approx(math.tan(math.radians(4)), rel=0.01)


def test_the_spectrum_of_a_large_fractal_has_neither_bump_nor_gap():
    """Mean of 4 grounds against f^-3.6, waves of 8 to 128 postings, across the joint at 32 to 64: 30 modes and more in a ring of each, and
    the estimate of a ring scatters by 1.4 / sqrt(120) = 13 %; 25 % allows for twice that. (Shorter waves are raised by folding, as
    sampled ground is.)"""
    fields = [fractal_lattice((2560, 2560), 1.0, 0.8, 0.05, seed).outer(np.arange(1024), np.arange(1024)) for seed in range(4)]
    spectra = [power_spectrum(field, (1.0, 1.0)) for field in fields]
    wave = 1 / spectra[0].frequency
    ratio = np.mean([s.density * s.frequency**3.6 for s in spectra], axis=0)
    part = (wave > 8) & (wave < 128)
    assert spectra[0].count[part].min() >= 30
    assert part.sum() >= 15
    ratio = ratio[part] / np.exp(np.mean(np.log(ratio[part])))
    assert ratio == pytest.approx(np.ones(part.sum()), abs=0.25)


def test_large_fractals_do_not_repeat():
    """Fields have periods of 1024 and 1215 postings; at either distance, the ground must not know itself: its short waves (differences of
    neighbours) correlate by one half there by construction, not by one, and nowhere else."""
    lattice = fractal_lattice((3000, 3000), 1.0, 0.8, 0.05, 1)
    here = np.diff(lattice.outer(np.arange(100, 400), np.arange(100, 400)), axis=1).ravel()
    for shift, most in ((1024, 0.6), (1215, 0.6), (700, 0.1), (2048, 0.6), (2239, 0.1)):
        there = np.diff(lattice.outer(np.arange(100, 400), np.arange(100 + shift, 400 + shift)), axis=1).ravel()
        assert abs(np.corrcoef(here, there)[0, 1]) < most, shift


def test_large_fractals_need_little_memory():
    """10 001 x 10 001 heights are 800 MB; making the ground and a tile of it takes less than 300 MB."""
    assert MOST_DIRECT < 10_001**2
    tracemalloc.start()
    try:
        made = base_of(kind="fractal", size=[1000, 1000], posting=0.1)
        tile = made.base.window(made.grid, Window(row0=5000, row1=5512, col0=9000, col1=9512))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert tile.shape == (512, 512)
    assert peak < 300e6


# --- measured DEMs -------------------------------------------------------------------------------------------------------------------


def test_a_dem_keeps_its_numbers(tmp_path):
    heights = hills()
    file = raster_file(tmp_path / "d.tif", heights, posting=(2.0, 5.0))
    made = base_of(kind="dem", file=str(file))
    assert np.array_equal(made.base.window(made.grid, made.grid.whole), heights - made.map_origin[2])
    assert (made.grid.posting_x, made.grid.posting_y) == (2.0, 5.0)
    part = base_of(kind="dem", file=str(file), size=[40, 50], center=[10, -20])
    column, row = round((part.grid.x_west - made.grid.x_west) / 2), round((made.grid.y_north - part.grid.y_north) / 5)
    assert np.array_equal(
        part.base.window(part.grid, part.grid.whole) + part.map_origin[2],
        (heights - part.map_origin[2])[row : row + 11, column : column + 21] + part.map_origin[2],
    )
    assert part.sources[0].file == "d.tif"


@pytest.mark.parametrize("clip", ["moon_aristarchus_imp_5m", "moon_mons_herodotus_54m", "mars_gale_1m"])
def test_a_surface_of_means_has_the_means_of_the_file(rille_data, clip):
    """Averaged with 16 x 16 Gauss-Legendre points in each cell (exact for its piecewise polynomials, cut at the middle of a cell), the
    surface gives back every value: rounding of heights of 4000 m, 1e-9 m."""
    file = rille_data / f"data/dem/{clip}.tif"
    made = base_of(kind="dem", file=str(file), values="means")
    grid, (points, weights) = made.grid, np.polynomial.legendre.leggauss(3)
    offsets, weights = np.concatenate([points - 1, points + 1]) / 4, np.concatenate([weights, weights]) / 4
    i, j = np.meshgrid(np.arange(40, 90), np.arange(30, 110), indexing="ij")
    means = np.zeros(i.shape)
    for dy, wy in zip(offsets, weights, strict=True):
        for dx, wx in zip(offsets, weights, strict=True):
            means += wx * wy * made.base.at(grid.x_west + (j + dx) * grid.posting_x, grid.y_north - (i + dy) * grid.posting_y)
    with rasterio.open(file) as raster:
        original = raster.read(1)[40:90, 30:110].astype(float)
    assert means + made.map_origin[2] == pytest.approx(original, abs=1e-9)


def test_large_dems_are_read_in_blocks(tmp_path, monkeypatch):
    """Read and splined block by block instead of at once: the same bytes of points, and means to what the border of a block has
    not forgotten (1e-9 of the relief)."""
    file = str(raster_file(tmp_path / "d.tif", hills(150, 170)))
    keys = [{}, {"posting": 0.7, "size": [200, 150]}, {"values": "means", "posting": 0.7, "size": [200, 150]}]
    whole = [made.base.window(made.grid, made.grid.whole) for made in (base_of(kind="dem", file=file, **k) for k in keys)]
    monkeypatch.setattr(cells_module, "MOST_RESIDENT", 100)
    monkeypatch.setattr(cells_module, "BLOCK", 32)
    monkeypatch.setattr(means_module, "MOST_AT_ONCE", 100)
    monkeypatch.setattr(means_module, "BLOCK", 32)
    for k, heights in zip(keys, whole, strict=True):
        made = base_of(kind="dem", file=file, **k)
        blocks = made.base.window(made.grid, made.grid.whole)
        if k.get("values"):
            assert blocks == pytest.approx(heights, abs=1e-7)
        else:
            assert blocks.tobytes() == heights.tobytes()
        x, y = made.grid.points(made.grid.whole)
        assert made.base.at(x, y) == pytest.approx(blocks, abs=1e-9)


def test_holes_matter_only_where_the_scene_is(tmp_path):
    heights = hills()
    heights[10:12, 30] = -9999.0
    file = str(raster_file(tmp_path / "d.tif", heights, nodata=-9999.0))
    with pytest.raises(InputRefused, match="2 heights missing, the first at row 10, column 30"):
        base_of(kind="dem", file=file)
    for values in ("points", "means"):
        away = base_of(kind="dem", file=file, size=[40, 30], center=[0, -30], values=values)
        assert away.holes is None
        assert np.isfinite(away.base.window(away.grid, away.grid.whole)).all()
        filled = base_of(kind="dem", file=file, fill_holes=True, values=values)
        marked = filled.holes(filled.grid, filled.grid.whole)
        assert np.argwhere(marked).tolist() == [[10, 30], [11, 30]]
        height = filled.base.window(filled.grid, filled.grid.whole)[marked] + filled.map_origin[2]
        if values == "points":
            others = (filled.base.window(filled.grid, filled.grid.whole) + filled.map_origin[2])[~marked]
            assert others == pytest.approx(heights[~marked], abs=1e-12)  # the known ones are not touched
        around = heights[8:14, 28:33]
        assert around[around > 0].min() - 1 < height.min() <= height.max() < around.max() + 1
        # of a finer grid, all that rests on the filled ones is marked
        fine = Grid(n_rows=41, n_cols=41, posting_x=0.5, posting_y=0.5, x_west=filled.grid.x_west + 50, y_north=filled.grid.y_north - 10)
        part = filled.holes(fine, fine.whole)
        assert part.sum() == 7 * 11  # 3.0 m x 5.0 m around two points, without its border


def test_a_region_beside_the_holes_of_a_dem_is_cut_as_the_refusal_advises(tmp_path, monkeypatch):
    """The scene's own grid has holes; filled, it keeps its other heights, and the region is as if there were none."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
    heights = hills()
    heights[10:12, 30] = np.nan
    raster_file(tmp_path / "d.tif", heights)
    scene = tmp_path / "scene.toml"
    text = 'name = "it"\nsoil = "lunar_sourcebook"\n[base]\nkind = "dem"\nfile = "d.tif"\n'
    scene.write_text(text)
    with pytest.raises(InputRefused, match=r"set fill_holes = true in \[base\] to interpolate them \(the others stay as they are\)"):
        extract_from_scene(scene, box=(-60.0, -50.0, 0.0, -20.0))
    scene.write_text(text + "fill_holes = true\n")
    piece = extract_from_scene(scene, box=(-60.0, -50.0, 0.0, -20.0))
    row, column = round((58.0 - piece.y_north) / 2), round((piece.x_west + 78.0) / 2)
    known = heights[row : row + piece.heights.shape[0], column : column + piece.heights.shape[1]]
    assert np.abs(piece.heights + piece.map_origin[2] - known).max() < 1e-12
    assert piece.filled is None or not piece.filled.any()


def test_scale_offset_nodata_and_marks_are_honoured(tmp_path):
    stored = np.arange(30, dtype=np.int16).reshape(5, 6)
    stored[0, 0] = -32768
    file = raster_file(tmp_path / "scaled.tif", stored, nodata=-32768, tags={"scales": 0.5, "offsets": -100.0, "units": "m"})
    made = base_of(kind="dem", file=str(file), fill_holes=True)
    heights = made.base.window(made.grid, made.grid.whole) + made.map_origin[2]
    assert np.array_equal(heights.ravel()[1:], stored.ravel()[1:] * 0.5 - 100.0)
    lost = hills().astype(np.float32)
    lost[3, 4] = -3.4e38  # a mark whose tag was lost
    with pytest.raises(InputRefused, match="1 heights missing, the first at row 3, column 4"):
        base_of(kind="dem", file=str(raster_file(tmp_path / "lost.tif", lost)))


@pytest.mark.parametrize("mark", [-9999.0, -32768.0, -32767.0, -99999.0])
@pytest.mark.parametrize("large", [False, True])
def test_marks_that_lost_their_tag_are_refused(tmp_path, monkeypatch, mark, large):
    """As pits kilometres deep they would be built without a word. Told: which value, in how many cells, how far below, what to do."""
    if large:
        monkeypatch.setattr(cells_module, "MOST_RESIDENT", 100)
        monkeypatch.setattr(raster_module, "STRIP", 700)
    heights = hills().astype(np.float32)
    heights[20:24, 30:35] = mark
    file = raster_file(tmp_path / "lost.tif", heights)
    words = rf"20 heights of exactly {mark:g} m, \d+ m below all others .*gdal_edit -a_nodata {mark:g}"
    with pytest.raises(InputRefused, match=words):
        base_of(kind="dem", file=str(file))
    with pytest.raises(InputRefused, match=words):
        read_dem(file)
    away = {"size": [20, 20], "center": [-40, 40]}
    assert base_of(kind="dem", file=str(file), **away).holes is None  # only where the scene is
    declared = raster_file(tmp_path / "declared.tif", heights, nodata=mark)
    with pytest.raises(InputRefused, match="20 heights missing"):
        base_of(kind="dem", file=str(declared))


@pytest.mark.parametrize(("low", "high"), [(-10900, -8000), (-9999, -5000), (-14000, 9000), (-9999, -9990)])
def test_true_heights_are_no_marks(tmp_path, low, high):
    """Deep ground that holds -9999 m among its neighbours, or as its lowest point, is ground."""
    heights = np.sort(np.append(np.linspace(low, high, 41), -9999.0))
    heights = np.broadcast_to(heights, (30, len(heights))).astype(np.float32).copy()
    assert (heights == -9999).any()
    assert np.array_equal(read_dem(raster_file(tmp_path / "deep.tif", heights)).heights, heights)


def test_marks_are_found_where_values_are_scaled(tmp_path):
    """Decimetres above a level: the mark is that of the stored value, and so is what is to be declared."""
    stored = (10 * (hills() - 700)).astype(np.int16)
    stored[5, 5] = -9999
    file = raster_file(tmp_path / "scaled.tif", stored, tags={"scales": 0.1, "offsets": 700.0, "units": "m"})
    with pytest.raises(InputRefused, match=r"1 height of exactly -299.9 m.*-a_nodata -9999"):
        read_dem(file)


def test_a_file_that_ends_early_is_called_so(tmp_path):
    file = raster_file(tmp_path / "a.asc", hills().astype(np.float32), driver="AAIGrid")
    text = file.read_text()
    file.write_text(text[: len(text) // 2])
    with pytest.raises(InputRefused, match="cannot be read as a raster: it ends early"):
        read_dem(file)


def test_a_band_is_chosen(tmp_path):
    bands = np.stack([hills(seed=1), hills(seed=2)])
    file = str(raster_file(tmp_path / "two.tif", bands))
    first, second = (base_of(kind="dem", file=file, **k) for k in ({}, {"band": 2}))
    assert "band 1 of 2" in first.source
    assert first.notes == ("'two.tif' has 2 bands, band 1 taken; choose with `band`",)
    assert base_of(kind="dem", file=file, band=1).notes == second.notes == ()
    for made, heights in ((first, bands[0]), (second, bands[1])):
        assert np.array_equal(made.base.window(made.grid, made.grid.whole), heights - made.map_origin[2])


@pytest.mark.parametrize(
    ("driver", "suffix"), [("COG", "tif"), ("AAIGrid", "asc"), ("PDS4", "xml"), ("ISIS3", "cub"), ("ENVI", "img"), ("netCDF", "nc")]
)
def test_formats_of_gdal_are_read(tmp_path, driver, suffix):
    """float32 heights arrive to the last bit (ASCII: as printed)."""
    heights = hills().astype(np.float32)
    raster_file(tmp_path / "source.tif", heights, crs="+proj=eqc +R=1737400 +units=m")
    path = tmp_path / f"d.{suffix}"
    with rasterio.open(tmp_path / "source.tif") as source:
        rasterio.shutil.copy(source, path, driver=driver)
    made = base_of(kind="dem", file=str(path))
    got = made.base.window(made.grid, made.grid.whole) + made.map_origin[2]
    assert got == pytest.approx(heights.astype(float), abs=1e-4 if driver == "AAIGrid" else 0)


def test_dems_that_cannot_be_used_are_refused_in_one_sentence(tmp_path):
    heights = hills(8, 9)
    write = lambda name, values=heights, **more: str(raster_file(tmp_path / f"{name}.tif", values, **more))  # noqa: E731
    (tmp_path / "text.tif").write_text("no raster")
    cases = [
        ({"file": "none.tif"}, "there is no DEM"),
        ({"file": str(tmp_path / "text.tif")}, "cannot be read as a raster"),
        ({"file": write("noproj", crs=None)}, "no projection"),
        ({"file": write("degrees", crs="EPSG:4326")}, "degrees"),
        ({"file": write("feet", crs="EPSG:2263")}, "US survey foot, not in metres"),
        ({"file": write("unit", tags={"units": "ft"})}, "heights of"),
        ({"file": write("vertical", crs="EPSG:26918+6360")}, "heights of"),
        ({"file": write("south", posting=(1.0, -1.0))}, "north-up"),
        ({"file": write("empty", np.full((8, 9), np.nan)), "fill_holes": True}, "no height at all"),
        ({"file": write("small", heights[:1])}, "at least 2 x 2"),
        ({"file": write("ok"), "band": 2}, "no band 2"),
        ({"file": write("ok"), "size": [100, 100]}, "beyond the DEM"),
        ({"file": write("ok"), "size": [4, 4], "center": [8, 0], "posting": 0.5}, "beyond the DEM"),
        ({"file": write("ok"), "origin": [1e18, 0]}, "nearer origin"),
        ({"file": write("complex", heights.astype("complex64"))}, "complex numbers"),
        ({}, "needs `file`"),
    ]
    for keys, words in cases:
        with pytest.raises(InputRefused) as refusal:
            base_of(kind="dem", **keys)
        assert words in str(refusal.value), keys
        assert "\n" not in str(refusal.value)


def test_holes_of_a_large_region_are_not_filled(tmp_path, monkeypatch):
    heights = hills()
    heights[40, 7] = np.nan
    file = str(raster_file(tmp_path / "d.tif", heights))
    monkeypatch.setattr(cells_module, "MOST_RESIDENT", 100)
    monkeypatch.setattr(cells_module, "BLOCK", 32)
    with pytest.raises(InputRefused, match="the first at row 40, column 7"):
        base_of(kind="dem", file=file)
    with pytest.raises(InputRefused, match="gdal_fillnodata"):
        base_of(kind="dem", file=file, fill_holes=True)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"kind": "flat"}, "needs `size` and `posting`"),
        ({"kind": "fractal", "size": [10, 10], "posting": 1, "median_slope": "90 deg"}, "median_slope"),
        ({"kind": "fractal", "size": [10, 10], "posting": 1, "detail": {}}, "[base.detail]"),
        ({"kind": "flat", "size": [10, 10], "posting": 0}, "at least one cell"),
        ({"kind": "flat", "size": [1e6, 1e6], "posting": 1}, "larger posting"),
        ({"kind": "flat", "size": [10, 10], "posting": 1, "center": [1e15, 0]}, "nearer origin"),
        ({"kind": "plane", "size": [10, 10], "posting": 1, "slope": "90 deg"}, "-89 and 89 deg"),
    ],
)
def test_synthetic_bases_are_refused_in_one_sentence(keys, words):
    with pytest.raises(InputRefused) as refusal:
        base_of(**keys)
    assert words in str(refusal.value)


def test_a_raster_without_place_is_refused_without_a_warning(tmp_path):
    """GDAL warns of a raster that says nowhere where it lies; the refusal says it, and nothing else is printed."""
    file = raster_file(tmp_path / "nowhere.tif", hills(8, 9))
    with rasterio.open(file, "r+") as raster:
        raster.transform = Affine(0, 0, 0, 0, 0, 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputRefused, match="north-up"):
            base_of(kind="dem", file=str(file))
