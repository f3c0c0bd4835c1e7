"""Detail below the resolution of a measured base: spectra, laws, and what the base's own heights become."""

import math
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine
from scipy.ndimage import gaussian_filter

from rille.model import InputRefused
from rille.terrain.base import BaseSheet, make_base
from rille.terrain.base import means as means_module
from rille.terrain.base.detail import CellMeans
from rille.terrain.base.fractal import fractal_lattice
from rille.terrain.base.lattice import Stored
from rille.terrain.base.spectrum import fit_law, power_spectrum
from rille.terrain.grid import Window
from rille.terrain.raster import open_raster
from terrain_forms import spectral

CLIP = "data/dem/moon_aristarchus_imp_5m.tif"


def silent(what, fraction):
    """No progress."""


def base_of(file, **keys):
    """A measured base from the keys of [base]."""
    return make_base(BaseSheet(kind="dem", file=str(file), **keys), Path("scene.toml"), silent)


def dem(path, heights, posting):
    """A DEM file."""
    transform = Affine(posting, 0, 500.0, 0, -posting, 4000.0)
    options = {"driver": "GTiff", "count": 1, "dtype": "float64", "crs": "EPSG:32633", "transform": transform}
    with rasterio.open(path, "w", height=heights.shape[0], width=heights.shape[1], **options) as raster:
        raster.write(heights, 1)
    return path


def whole(made):
    """All heights on the scene's grid."""
    return made.base.window(made.grid, made.grid.whole)


def cell_means(made, rows, cols, raster):
    """Means over cells of a raster of the bilinear surface of the scene's grid, as the solver feels it: exact integrals [m]."""
    east, north, zero = made.map_origin
    p = made.grid.posting_x
    start = (
        (made.grid.y_north + north - raster.corner[1]) / p,
        (raster.corner[0] - made.grid.x_west - east) / p,
    )
    ratio = raster.posting[1] / p, raster.posting[0] / p
    return CellMeans(lattice=Stored(whole(made)), start=start, ratio=ratio)(rows, cols) + zero


def inner_cells(made, raster):
    """Cells of a raster that lie in the scene's grid as a whole: (rows, cols), first and last + 1."""
    east, north, _ = made.map_origin
    g = made.grid
    west = (g.x_west + east - raster.corner[0]) / raster.posting[0]
    top = (raster.corner[1] - g.y_north - north) / raster.posting[1]
    right, bottom = (
        west + (g.n_cols - 1) * g.posting_x / raster.posting[0],
        top + (g.n_rows - 1) * g.posting_y / raster.posting[1],
    )
    return (math.ceil(top + 0.5), math.floor(bottom - 0.5) + 1), (math.ceil(west + 0.5), math.floor(right - 0.5) + 1)


def law_of(raster):
    """The law of a whole raster of means."""
    heights = raster.read((0, raster.shape[0]), (0, raster.shape[1]))
    return fit_law(power_spectrum(heights, raster.posting, means=True), 2 * raster.posting[0])


# --- spectrum and law ----------------------------------------------------------------------------------------------------------------


def test_the_spectrum_of_white_noise_is_its_variance_times_a_cell():
    """Density sigma^2 dx dy at all frequencies; rings of 1000 modes and more scatter by 1.4 / sqrt(1000) = 5 %."""
    noise = np.random.default_rng(1).normal(0, 3.0, (300, 400))
    spectrum = power_spectrum(noise + np.arange(400) * 0.7, (2.0, 3.0))
    part = spectrum.count > 1000
    assert part.sum() >= 4
    assert spectrum.density[part] == pytest.approx(np.full(part.sum(), 9.0 * 6.0), rel=0.12)


@pytest.mark.parametrize("blur", [0.0, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("hurst", [0.6, 0.8, 0.95])
def test_law_and_resolution_are_recovered_from_blurred_ground(hurst, blur):
    """A Gaussian blur of sigma halves the power of the wave 2 pi sigma / sqrt(ln 2) = 7.55 sigma: recovered within 25 % (rings: 19 %).
    256 x 256 values leave 1.5 to 6 octaves of resolved waves: with their chance and the pull to what is usual (H = 0.85), H comes
    within 0.2; from less than two octaves, nearly the usual is returned. A mosaic seam of a third of the relief across the middle does
    not matter: its modes are not used."""
    for seed in range(3):
        ground = spectral((256, 256), 1.0, hurst, 0.05, seed)
        ground = gaussian_filter(ground, blur) if blur else ground
        law = fit_law(power_spectrum(ground, (1.0, 1.0)), 2.0)
        assert law.resolution == pytest.approx(7.55 * blur or 2.0, rel=0.25)
        assert law.hurst == pytest.approx(hurst, abs=0.2 if blur < 3 else 0.45)
        ground[120:135] += 0.3 * ground.std()
        seamed = fit_law(power_spectrum(ground, (1.0, 1.0)), 2.0)
        assert seamed.resolution == pytest.approx(law.resolution, rel=0.1)
        assert seamed.hurst == pytest.approx(law.hurst, abs=0.02)


def test_the_clip_rolls_off_below_seventy_metres(rille_data):
    """SOURCES.md: "spectrum rolls off below about 70 m"; half of the power is lost at 40 to 80 m, far above the 9.5 m of its posting."""
    raster = open_raster(rille_data / CLIP)
    law = law_of(raster)
    assert 40 < law.resolution < 80
    assert 0.5 < law.hurst < 1.0


# --- composition ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("posting", [0.5, 0.3])
def test_the_clip_keeps_its_heights(rille_data, posting):
    """Averaged back to its cells, the composed ground (as delivered: the bilinear surface of the scene's grid, integrated exactly) has
    the clip's heights. RMS < 2 cm is asked; what the grid of the scene does not show of the smooth part is lost: 1 mm at 0.5 m. And there
    is detail: it raises and lowers the ground by more than 5 cm."""
    raster = open_raster(rille_data / CLIP)
    keys = {"size": [300, 220], "center": [-60, 80], "posting": posting}
    made = base_of(rille_data / CLIP, **keys, detail={"seed": 4})
    rows, cols = inner_cells(made, raster)
    assert (rows[1] - rows[0]) * (cols[1] - cols[0]) > 2500
    difference = cell_means(made, rows, cols, raster) - raster.read(rows, cols)
    assert np.sqrt(np.mean(difference**2)) < 2e-3
    plain = base_of(rille_data / CLIP, **keys, values="means")
    assert np.std(whole(made) - whole(plain)) > 0.05


def test_the_clip_continues_its_spectrum(rille_data):
    """Waves shorter than 1.3 cells have the power of the law, within 10 % (500 modes and more per ring); those longer than
    6 cells have the base's own, within 2 %; between, neither is exceeded by more than 10 %: nothing counts twice."""
    raster = open_raster(rille_data / CLIP)
    keys = {"size": [500, 420], "posting": 0.5}
    composed = base_of(rille_data / CLIP, **keys, detail={"seed": 4})
    plain = base_of(rille_data / CLIP, **keys, values="means")
    law = law_of(raster)
    spectrum, own = (power_spectrum(whole(made), (0.5, 0.5)) for made in (composed, plain))
    wave, wanted = 1 / spectrum.frequency, law.density(spectrum.frequency)
    short, long = (wave < 1.3 * raster.posting[0]) & (wave > 1.2), wave > 6 * raster.posting[0]
    assert short.sum() >= 8
    assert long.sum() >= 5
    assert spectrum.density[short] == pytest.approx(wanted[short], rel=0.1)
    assert spectrum.density[long] == pytest.approx(own.density[long], rel=0.02)
    between = ~long & (wave > 1.2)
    assert np.all(spectrum.density[between] < 1.1 * (wanted + own.density)[between])


def test_detail_joins_a_base_that_holds_all_it_can(tmp_path):
    """Ground of 1024 x 1024 values at 0.5 m, averaged over cells of 4 m, composed at 0.5 m: the spectrum is that of the first ground, from
    the longest wave to the shortest, through the joint at 8 m. Rings above the joint are the ground itself; those below are another of
    the same law, fitted to 128 x 128 values (H within 0.1, so within a factor 4^0.2 = 1.3 at 2 m). Double counting would give 2 at the
    joint, a gap nearly 0."""
    ground = fractal_lattice((2304, 2304), 0.5, 0.75, math.radians(10), 1).outer(np.arange(1024), np.arange(1024))
    file = dem(tmp_path / "means.tif", ground.reshape(128, 8, 128, 8).mean((1, 3)), 4.0)
    made = base_of(file, size=[480, 480], posting=0.5, detail={})
    spectrum, truth = (power_spectrum(field, (0.5, 0.5)) for field in (whole(made)[:960, :960], ground[32:992, 32:992]))
    ratio, wave = spectrum.density / truth.density, 1 / truth.frequency
    joint = (wave > 5) & (wave < 14) & (truth.count > 100)
    assert joint.sum() >= 5
    assert ratio[joint] == pytest.approx(np.ones(joint.sum()), abs=0.35)
    assert ratio[(wave > 14) & (truth.count > 20)] == pytest.approx(1.0, abs=0.1)
    short = (wave < 5) & (wave > 2)
    assert np.all((ratio[short] > 0.65) & (ratio[short] < 1.5))


def test_fill_restores_what_is_missing_and_says_what_it_costs(rille_data):
    """With fill, waves from 12 m to 40 m have the law's power, too (rings of 50 modes and more: 40 %), where the clip has a tenth; the
    heights change by what the note says, within 20 %."""
    raster = open_raster(rille_data / CLIP)
    made = base_of(rille_data / CLIP, size=[500, 420], posting=0.5, detail={"seed": 4, "fill": True})
    law = law_of(raster)
    spectrum = power_spectrum(whole(made), (0.5, 0.5))
    wave = 1 / spectrum.frequency
    part = (wave > 12) & (wave < 40)
    assert spectrum.density[part] == pytest.approx(law.density(spectrum.frequency)[part], rel=0.4)
    rows, cols = inner_cells(made, raster)
    change = np.sqrt(np.mean((cell_means(made, rows, cols, raster) - raster.read(rows, cols)) ** 2))
    said = float(made.notes[1].split("heights by ")[1].split(" m")[0])
    assert change == pytest.approx(said, rel=0.2)
    assert change > 0.1


def test_strength_is_a_factor(rille_data):
    keys = {"size": [60, 50], "posting": 0.4}
    none, half, full = (whole(base_of(rille_data / CLIP, **keys, detail={"strength": s, "seed": 2})) for s in (0, 0.5, 1))
    assert none == pytest.approx(whole(base_of(rille_data / CLIP, **keys, values="means")), abs=1e-9)
    assert half - none == pytest.approx((full - none) / 2, abs=1e-9)
    other = whole(base_of(rille_data / CLIP, **keys, detail={"seed": 3}))
    assert np.corrcoef((other - none).ravel(), (full - none).ravel())[0, 1] < 0.2


def test_points_stay_points_with_detail_between_them(rille_data):
    """values = "points": the bilinear surface, plus detail whose mean is zero over every cell, but for what the scene's grid does not show
    of its smooth part."""
    raster = open_raster(rille_data / CLIP)
    keys = {"size": [120, 100], "posting": 0.4, "values": "points"}
    plain, composed = base_of(rille_data / CLIP, **keys), base_of(rille_data / CLIP, **keys, detail={"seed": 2})
    cells = inner_cells(plain, raster)
    assert np.abs(cell_means(composed, *cells, raster) - cell_means(plain, *cells, raster)).max() < 5e-3
    assert np.std(whole(composed) - whole(plain)) > 0.05


def test_detail_stays_where_it_is_when_the_region_moves(rille_data):
    """A region moved by whole postings of the scene shows the same ground, to what splines of its border have forgotten."""
    first = base_of(rille_data / CLIP, size=[60, 50], posting=0.5, detail={"seed": 2})
    moved = base_of(rille_data / CLIP, size=[80, 70], center=[7.5, -4], posting=0.5, detail={"seed": 2})
    a, b = first.base.window(first.grid, first.grid.whole) + first.map_origin[2], whole(moved) + moved.map_origin[2]
    col, row = round((moved.grid.x_west - first.grid.x_west) / 0.5), round((first.grid.y_north - moved.grid.y_north) / 0.5)
    n_rows, n_cols = min(a.shape[0] - max(row, 0), b.shape[0] + min(row, 0)), min(a.shape[1] - max(col, 0), b.shape[1] + min(col, 0))
    left = a[max(row, 0) :, max(col, 0) :][:n_rows, :n_cols]
    right = b[max(-row, 0) :, max(-col, 0) :][:n_rows, :n_cols]
    assert left.size > 8000
    assert left == pytest.approx(right, abs=1e-7)


def test_detail_of_large_regions_is_made_in_blocks(rille_data, monkeypatch):
    """The same ground, to what the border of a block has not forgotten."""
    keys = {"size": [200, 150], "posting": 0.8, "detail": {"seed": 2}}
    at_once = whole(base_of(rille_data / CLIP, **keys))
    monkeypatch.setattr(means_module, "MOST_AT_ONCE", 10)
    monkeypatch.setattr(means_module, "BLOCK", 16)
    made = base_of(rille_data / CLIP, **keys)
    assert whole(made) == pytest.approx(at_once, abs=1e-7)
    part = Window(row0=20, row1=90, col0=3, col1=200)
    assert made.base.window(made.grid, part).tobytes() == whole(made)[part.slices].tobytes()


def test_detail_that_has_no_room_or_no_law_is_refused(rille_data, tmp_path):
    clip = rille_data / CLIP
    ground = spectral((64, 64), 4.0, 0.8, 0.1, 1)
    noise = np.random.default_rng(2).normal(size=(64, 64))
    cases = [
        (clip, {"detail": {}}, "smaller `posting`"),
        (clip, {"posting": 5.0, "size": [50, 50], "detail": {}}, "smaller `posting`"),
        (clip, {"posting": 0.5, "size": [50, 50], "detail": {"resolution": "3 m"}}, "two postings of the base"),
        (clip, {"posting": 0.5, "size": [50, 50], "detail": {"resolution": "2 km"}}, "too few waves"),
        (dem(tmp_path / "flat.tif", np.zeros((64, 64)), 4.0), {"posting": 0.5, "detail": {}}, "no relief"),
        (dem(tmp_path / "small.tif", ground[:12, :12], 4.0), {"posting": 0.5, "detail": {}}, "too few waves"),
        (dem(tmp_path / "tiny.tif", ground[:2, :3], 4.0), {"posting": 0.5, "detail": {}}, "only 2 x 3 heights"),
        (dem(tmp_path / "noise.tif", noise, 4.0), {"posting": 0.5, "detail": {}}, "unlike any ground"),
    ]
    for file, keys, words in cases:
        with pytest.raises(InputRefused) as refusal:
            base_of(file, **keys)
        assert words in str(refusal.value), words
        assert "\n" not in str(refusal.value)
    with pytest.raises(ValueError, match="strength"):  # endless relief
        base_of(clip, posting=0.5, size=[50, 50], detail={"strength": math.inf})
    given = base_of(clip, posting=0.5, size=[50, 50], detail={"hurst": 0.8, "resolution": "90 m"})
    assert "f^-3.60 (H = 0.80, given) of the waves above 90 m" in given.notes[0]
