"""``rille terrain extract``: one evaluation, every format, refusals in one sentence."""

import json
import math
import os
import resource

import numpy as np
import pytest
import rasterio

from command import assert_refused, rille
from rille import store

SCENE = """
name = "site"
soil = "lunar_sourcebook"
[base]
kind = "plane"
size = ["40 m", "30 m"]
center = ["3 m", "-2 m"]
posting = "0.5 m"
slope = "4 deg"
direction = "25 deg"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a scene and its database."""
    path = tmp_path_factory.mktemp("extract")
    (path / "scene.toml").write_text(SCENE)
    done = rille("terrain", "build", path / "scene.toml", "-o", path / "site.db")
    assert done.returncode == 0, done.stderr
    return path


def plane(x, y):
    """The base's formula."""
    return math.tan(math.radians(4)) * (math.cos(math.radians(25)) * x + math.sin(math.radians(25)) * y)


@pytest.mark.parametrize("source", ["scene.toml", "site.db"])
def test_everything_at_once_from_scene_and_from_database(folder, tmp_path, source):
    """A turned region of the ramp: heights by its formula at the map places of the GeoTIFF's cells, to 1e-9 m; a plane has no
    interpolation error."""
    out = [tmp_path / name for name in ("a.tif", "a.npy", "a.glb", "a.mjcf", "b.db")]
    arguments = ["--center", "4,-1", "--size", "6 m,4 m", "--posting", "0.25,0.2", "--heading", "30 deg", "--name", "piece", "--json"]
    done = rille("terrain", "extract", folder / source, *arguments, *(f for path in out for f in ("-o", path)))
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert {str(path) for path in out} <= set(facts["files"])
    assert (facts["rows"], facts["columns"], facts["terrain"]) == (21, 25, "piece")
    assert facts["map_origin_m"] == pytest.approx([4.0, -1.0, 0.0], abs=1e-9)
    with rasterio.open(out[0]) as raster:
        rows, columns = np.indices(raster.shape)
        x, y = raster.xy(rows.ravel(), columns.ravel())
        assert np.abs(raster.read(1).ravel() - plane(np.array(x), np.array(y))).max() < 1e-9
    piece = store.read_terrain(out[-1])
    assert np.array_equal(piece.heights, np.load(out[1]))
    assert piece.map_heading == pytest.approx(math.radians(30))


def test_a_polygon_from_geojson_and_from_the_command_line(folder, tmp_path):
    corners = [[0, 0], [8, 0], [8, 6], [0, 0]]
    (tmp_path / "p.geojson").write_text(
        json.dumps({"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [corners]}})
    )
    for text, name in ((tmp_path / "p.geojson", "a.npy"), ("0,0 8,0 8,6", "b.npy")):
        done = rille("terrain", "extract", folder / "site.db", "--polygon", text, "-o", tmp_path / name)
        assert done.returncode == 0, done.stderr
        assert done.stdout == ""
    a, b = np.load(tmp_path / "a.npy"), np.load(tmp_path / "b.npy")
    assert np.array_equal(a, b, equal_nan=True)
    assert a.shape == (13, 17)
    assert np.isnan(a[0, 0])
    assert np.isfinite(a[12, 0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--box", "0,0,99,1", "-o", "a.tif"), ("x = 99.00 m", "-17.00 to 23.00 m", "move or shrink it")),
        (("--box", "0,0,9", "-o", "a.tif"), ("--box is '0,0,9'", "4 numbers")),
        (("--size", "3 kg", "-o", "a.tif"), ("--size", "3 kg")),
        (("--size", "5", "--heading", "30", "-o", "a.tif"), ("--heading is 30 without a unit", "'30 deg'")),
        (("--size", "5", "--heading", "0.5 rad", "-o", "a.asc"), ("turned by 0.5 rad", "GeoTIFF")),
        (("--size", "5", "-o", "a.tfi"), ("cannot be told", "did you mean '.tif'")),
        (("--size", "5", "-f", "geotif", "-o", "a.x"), ("no format 'geotif'", "'geotiff'")),
        (("--size", "5", "-o", "nowhere/a.tif"), ("no folder", "nowhere")),
        (("--polygon", "none.geojson", "-o", "a.tif"), ("no file 'none.geojson'",)),
        (("--terrain", "x", "-o", "a.tif"), ("is a scene",)),
    ],
)
def test_refusals_are_one_sentence_and_leave_nothing(folder, tmp_path, arguments, words):
    source = "scene.toml"
    before = (folder / source).read_bytes()
    assert_refused(rille("terrain", "extract", folder / source, *arguments, cwd=tmp_path), *words)
    assert list(tmp_path.iterdir()) == []
    assert (folder / source).read_bytes() == before


def test_a_database_that_is_not_there_is_made_by_a_verb_of_terrain(tmp_path):
    done = rille("terrain", "extract", tmp_path / "no.db", "-o", tmp_path / "a.tif")
    assert_refused(done, "there is no file", "check the path", "rille terrain build SCENE.toml")
    done = rille("terrain", "ruts", tmp_path / "no.db", "-o", tmp_path / "a.tif")
    assert_refused(done, "there is no file", "check the path", "rille run")
    done = rille("terrain", "ruts", tmp_path / "no.db", "-o", tmp_path / "a.png")
    assert_refused(done, "does not end in .tif or .tiff")


def test_obstacles_that_a_format_leaves_out_are_said_in_one_line(folder, tmp_path):
    stone = '[[obstacle]]\nname = "stone"\nkind = "box"\nsize = ["1 m", "1 m", "1 m"]\nx = 0\ny = 0\n'
    (tmp_path / "stones.toml").write_text((folder / "scene.toml").read_text() + stone)
    for verb in ("build", "extract"):
        done = rille("terrain", verb, tmp_path / "stones.toml", "-o", tmp_path / "a.stl", "-o", tmp_path / "a.glb")
        assert done.returncode == 0, done.stderr
        notes = [line for line in done.stderr.splitlines() if line.startswith("note:")]
        assert len(notes) == 1
        assert "a.stl: the ground alone, without the 1 obstacle of the scene" in notes[0]


def test_a_database_without_that_terrain_is_refused(folder, tmp_path):
    assert_refused(rille("terrain", "extract", folder / "site.db", "--terrain", "sit", "-o", tmp_path / "a.tif"), "did you mean 'site'")


def test_a_format_by_name(folder, tmp_path):
    done = rille("terrain", "extract", folder / "site.db", "--size", "5", "-f", "npy", "-o", tmp_path / "heights.dat")
    assert done.returncode == 0, done.stderr
    assert np.load(tmp_path / "heights.dat").shape == (11, 11)


@pytest.mark.parametrize("ending", ["tif", "cog", "asc", "npy", "png", "obj"])
def test_a_full_disk_is_one_sentence_in_every_format(folder, tmp_path, ending):
    """The operating system ends every file after 4000 bytes, and 40 401 heights need more in every format; nothing is left behind, and
    no library adds lines of its own."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))

    more = {"env": {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, "preexec_fn": limit}
    done = rille("terrain", "extract", folder / "scene.toml", "--size", "20", "--posting", "0.1", "-o", tmp_path / f"full.{ending}", **more)
    assert_refused(done, f"full.{ending}' could not be written")
    assert not list(tmp_path.iterdir())
