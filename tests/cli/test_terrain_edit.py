"""Composing a scene on the command line: every verb, its JSON, its refusals, a full disk."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from command import assert_refused, rille


@pytest.fixture
def scene(tmp_path) -> Path:
    """A new flat scene."""
    file = tmp_path / "site.toml"
    done = rille("terrain", "new", file, "--base", "flat", "--size", "20 m,12 m", "--posting", "0.25 m")
    assert done.returncode == 0, done.stderr
    assert "rille terrain place" in done.stderr
    return file


def data(*arguments):
    """What the command prints with ``--json``."""
    done = rille("terrain", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_scene_is_composed_without_an_editor(scene, tmp_path):
    picture = tmp_path / "site.png"
    placed = data("place", scene, "crater", "--x", "5", "--y", "-80 cm", "--set", "diameter=4m", "--picture", picture)
    assert placed["name"] == "crater_1"
    assert placed["entry"] == {"name": "crater_1", "landform": "crater", "x": "5 m", "y": "-80 cm", "drivers": {"diameter": "4 m"}}
    assert (placed["undo"], placed["redo"]) == (1, 0)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert data("move", scene, "crater_1", "--by", "-1 m,30 cm")["entry"]["y"] == "-50 cm"
    assert data("move", scene, "crater_1", "--x", "-2.5")["entry"]["x"] == "-2.5 m"
    assert data("rotate", scene, "crater_1", "--by", "-15 deg")["entry"]["heading"] == "-15 deg"
    assert data("scale", scene, "crater_1", "--to", "1.5")["entry"]["scale"] == 1.5
    assert data("set", scene, "crater_1", "relief=0.5", "--soil", "lunar_soft")["entry"]["drivers"]["relief"] == 0.5
    listed = data("list", scene)["kinds"]["landform"]
    assert [(e["name"], e["of"], e["x_m"], e["heading_deg"], e["scale"]) for e in listed] == [("crater_1", "crater", -2.5, -15.0, 1.5)]
    shown = rille("terrain", "list", scene)
    assert shown.stdout == "crater_1  crater  (-2.5, -0.5) m  -15 deg  scale 1.5, soil lunar_soft, diameter 4 m, relief 0.5\n"
    assert data("undo", scene, "2")["undone"] == ["set crater_1", "scale crater_1"]
    assert data("redo", scene)["done_again"] == ["scale crater_1"]
    assert data("remove", scene, "crater_1")["entry"] is None
    assert data("list", scene)["kinds"]["landform"] == []
    assert data("undo", scene)["undo"] == 7  # 5 edits, the state after the undo again, the removal undone
    built = data("build", scene, "-o", tmp_path / "site.db")
    assert built["heights_m"][0] < -0.5


def test_people_are_told_on_stderr(scene):
    done = rille("terrain", "place", scene, "mound", "--set", "diameter=3m", "--set", "height=40cm")
    assert (done.returncode, done.stdout) == (0, "")
    assert "landform 'mound_1' (mound): x 0 m, y 0 m, diameter 3 m, height 40 cm" in done.stderr
    done = rille("terrain", "undo", scene)
    assert "undone: place mound_1; 0 more to undo, 1 to redo" in done.stderr
    assert "nothing is placed on its base (flat)" in rille("terrain", "list", scene).stderr


def test_refusals_leave_the_scene_as_it_was(scene):
    before = scene.read_bytes()
    place = ("terrain", "place", scene)
    assert_refused(rille("terrain", "new", scene), "exists already")
    assert_refused(rille(*place, "crater", "--set", "diametre=4m"), "'diametre'", "did you mean 'diameter'")
    assert_refused(rille(*place, "crater", "--set", "diameter=1mm"), "it must lie between")
    assert_refused(rille(*place, "crater", "--set", "diameter"), "is no NAME=VALUE")
    assert_refused(rille(*place, "krater"), "not registered; did you mean 'crater'")
    assert_refused(rille("terrain", "move", scene, "hill", "--x", "1"), "has no landform or obstacle called 'hill'")
    assert_refused(rille("terrain", "move", scene, "hill", "--by", "1"), "must be two values")
    assert_refused(rille("terrain", "undo", scene), "has no edit to undo")
    assert_refused(rille("terrain", "undo", scene, "0"), "must be at least 1")
    assert_refused(rille("terrain", "redo", scene.with_name("none.toml")), "there is no scene")
    assert scene.read_bytes() == before


def test_a_picture_that_cannot_be_drawn_is_said_with_what_was_done(scene, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = rille("terrain", "place", scene, "crater", "--set", "diameter=2m", "--picture", blocked / "p.png")
    assert_refused(done, "is edited, but its picture could not be drawn")
    assert "crater_1" in scene.read_text()


def test_a_disk_that_is_full_in_the_middle_of_the_file(scene):
    """The operating system ends every file after 700 bytes; the scene has more."""
    assert rille("terrain", "place", scene, "crater", "--set", "diameter=2m").returncode == 0
    before = scene.read_bytes()
    assert len(before) > 800

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (700, 700))

    done = rille("terrain", "move", scene, "crater_1", "--x", "3", preexec_fn=limit, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
    assert_refused(done, "cannot be written", "nothing was changed")
    assert scene.read_bytes() == before
    assert {p.name for p in scene.parent.iterdir()} == {scene.name, f".{scene.name}.history"}
    assert rille("terrain", "move", scene, "crater_1", "--x", "3").returncode == 0


@pytest.mark.parametrize("verb", ["new", "place", "move", "rotate", "scale", "set", "remove", "undo", "redo", "list"])
def test_help_gives_an_example(verb):
    done = rille("terrain", verb, "--help")
    assert done.returncode == 0
    assert f"Example: rille terrain {verb} " in done.stdout
    assert "--json" in done.stdout


def test_names_may_hold_anything_and_refusals_stay_one_line(scene, tmp_path):
    """Names with blanks, quotes, line ends and tabs are kept, drawn, and quoted in one line."""
    names = ["a b", 'x"y', "it's", "a.b", "[x]", "#c", "a\\b", "\u2603", "line\nend", "tab\there", "cr\rhere"]
    for name in names:
        assert data("place", scene, "crater", f"--name={name}", "--set", "diameter=2m")["name"] == name
    assert [e["name"] for e in data("list", scene)["kinds"]["landform"]] == names
    data("move", scene, "line\nend", "--x", "1", "--picture", tmp_path / "site.png")
    text = scene.read_bytes()
    assert_refused(rille("terrain", "move", scene, "line\nends", "--x", "1"), "line end")
    assert_refused(rille("terrain", "move", scene, "a b", "--by", "1e308,0"), "nearer origin")
    assert scene.read_bytes() == text


def test_a_picture_never_replaces_the_scene(scene):
    text = scene.read_bytes()
    assert_refused(rille("terrain", "place", scene, "crater", "--set", "diameter=2m", "--picture", scene), "is no PNG")
    assert scene.read_bytes() == text


def test_a_folder_is_no_new_scene(tmp_path):
    assert_refused(rille("terrain", "new", ".", cwd=tmp_path), "folder")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_says_that_nothing_is_lost(tmp_path):
    """SIGINT while 49 million heights are evaluated: one sentence and exit code 130, no file half-written."""
    scene = tmp_path / "big.toml"
    scene.write_text('name = "b"\nsoil = "lunar_sourcebook"\n[base]\nkind = "fractal"\nsize = [700, 700]\nposting = 0.1\n')
    command = [str(Path(sys.executable).with_name("rille")), "terrain", "build", str(scene), "-o", str(tmp_path / "b.npy")]
    cache = tmp_path / "cache"
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "RILLE_CACHE": str(cache)})
    while child.poll() is None and not list(cache.glob("terrain/*/heights.f64")):
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=60)
    assert child.returncode == 130
    assert said == "rille: interrupted; what was written before is complete\n"
    assert not list(tmp_path.glob("b.npy*"))
