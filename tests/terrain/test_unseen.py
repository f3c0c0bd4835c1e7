"""What a scene places without a trace on its own grid is told, by whatever builds it."""

import numpy as np
import pytest
import rasterio
from typer.testing import CliRunner

from rille.cli.main import app
from rille.terrain.extraction import extract_from_scene
from rille.terrain.scene import build

BASE = """name = "yard"
soil = "lunar_sourcebook"
[base]
kind = "flat"
size = ["40 m", "40 m"]
center = ["100 m", 0]
posting = "0.5 m"
"""
PIT = '[[landform]]\nname = "pit"\nlandform = "crater"\nx = {x}\ny = {y}\nheading = "45 deg"\ndrivers = {{ diameter = {diameter} }}\n'
ROCKS = '[[population]]\nname = "rocks"\nlandform = "rock"\nlaw = "haworth"\ndiameter = [0.3, 1.0]\n'
DUST = '[[soil_patch]]\nname = "dust"\nsoil = "lunar_soft"\npolygon = {}\n'
BESIDE = "lies beside the ground, which spans x 80 to 120 m and y -20 to 20 m"
NO_ROOM = "finds no room on the ground, which spans x 80 to 120 m and y -20 to 20 m"


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """Writes a scene of a base and more."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))

    def write(more):
        (tmp_path / "yard.toml").write_text(BASE + more)
        return tmp_path / "yard.toml"

    for name, west in (("here.tif", 80), ("far.tif", 1080)):
        place = {"transform": rasterio.Affine(10, 0, west, 0, -10, 20), "width": 4, "height": 4, "count": 1, "dtype": "float64"}
        with rasterio.open(tmp_path / name, "w", driver="GTiff", **place) as raster:
            raster.write(np.ones((4, 4)), 1)
    return write


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (PIT.format(x=135, y=0, diameter=6), f"landform 'pit' {BESIDE}"),
        (PIT.format(x=100.25, y=0.25, diameter=0.1), "landform 'pit' lies between the heights of the ground, which stand 0.5 m apart"),
        (ROCKS + "region = [130, -10, 150, 10]\n", f"population 'rocks' {BESIDE}"),
        (ROCKS + "region = [130, -10, 150, 10]\ncount = 5\n", f"population 'rocks' {BESIDE}"),
        (ROCKS + 'density = { map = "far.tif" }\n', f"population 'rocks' {NO_ROOM}"),
        (ROCKS + "exclude = [[100, 0, 40]]\n", f"population 'rocks' {NO_ROOM}"),
        (DUST.format("[[121, 0], [130, 0], [121, 9]]"), f"soil patch 'dust' {BESIDE}"),
        (DUST.format("[[121, 15], [130, 15], [130, 30], [119, 30]]"), f"soil patch 'dust' {BESIDE}"),  # its box reaches onto the ground
    ],
)
def test_what_leaves_no_trace_is_told(scene, more, told):
    notes: list[str] = []
    build(scene(more), tell=notes.append)
    (note,) = notes
    assert note.startswith(told)


@pytest.mark.parametrize(
    "more",
    [
        PIT.format(x=123, y=0, diameter=6),  # its rim reaches in
        ROCKS + "region = [119, -10, 150, 10]\n",
        ROCKS + "region = [99.9, 0, 100, 0.1]\n",  # chance places nothing
        ROCKS + 'density = { map = "here.tif" }\n',
        DUST.format("[[119, 0], [130, 0], [119, 9]]"),
    ],
)
def test_what_may_leave_one_is_not(scene, more):
    notes: list[str] = []
    build(scene(more), tell=notes.append)
    assert notes == []


@pytest.mark.parametrize("verb", ["build", "preview", "stats"])
def test_verbs_tell_it(scene, tmp_path, verb):
    """The same sentence from each; what they print stays on stdout."""
    ends = {"build": ["-o", str(tmp_path / "yard.npy")], "preview": ["--kind", "soil", "-o", str(tmp_path / "yard.png")], "stats": []}
    done = CliRunner().invoke(app, ["terrain", verb, str(scene(PIT.format(x=135, y=0, diameter=6))), *ends[verb]])
    assert done.exit_code == 0, done.output
    assert f"landform 'pit' {BESIDE}" in done.stderr
    assert BESIDE not in done.stdout


def test_a_region_is_told_of_too(scene):
    notes: list[str] = []
    extract_from_scene(scene(DUST.format("[[121, 0], [130, 0], [121, 9]]")), tell=notes.append, box=(90.0, -5.0, 95.0, 5.0))
    assert notes == [f"soil patch 'dust' {BESIDE}"]
