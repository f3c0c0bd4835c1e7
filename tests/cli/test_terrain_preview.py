"""`rille terrain preview` as a designer meets it."""

import json
import os
import signal
import subprocess
import time

import pytest

from command import RILLE, assert_refused, rille
from rille.cli import terrain_preview
from rille.terrain import surface

SCENE = """name = "yard"
soil = "lunar_sourcebook"

[base]
kind = "plane"
size = ["30 m", "20 m"]
posting = "0.1 m"
slope = "4 deg"

[[landform]]
name = "bowl"
landform = "crater"
x = "5 m"
y = "2 m"
drivers = { diameter = "6 m" }
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "yard.toml"
    path.write_text(SCENE)
    return path


def test_one_picture_of_a_scene(scene, tmp_path):
    done = rille("terrain", "preview", scene, "--kind", "shade", "-o", tmp_path / "yard.png")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(tmp_path / "yard.png")]
    assert (tmp_path / "yard.png").read_bytes().startswith(b"\x89PNG")


def test_all_pictures_and_their_measures(scene, tmp_path):
    """The base is a plane of 4 deg, of which the crater covers a twelfth: it is the median. The profile crosses the crater."""
    kinds = ["slope", "soil", "profile", "shade"]
    asked = [word for kind in kinds for word in ("--kind", kind)]
    done = rille("terrain", "preview", scene, *asked, "--line", "-10,2,12,2", "-o", tmp_path / "out", "--json")
    value = json.loads(done.stdout)
    assert value["terrain"] == "yard"
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted(f"{kind}.png" for kind in kinds)
    assert value["slope"]["median_deg"] == pytest.approx(4.0, abs=0.05)
    assert value["soil"]["shares"] == {"lunar_sourcebook": 1.0}
    assert value["profile"]["length_m"] == pytest.approx(22.0)
    assert value["profile"]["steepest_deg"] > 15
    assert value["notes"] == []


def test_the_ground_of_a_database(model, tmp_path):
    done = rille("terrain", "preview", model, "--kind", "slope", "-o", tmp_path / "s.png", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["terrain"] == "plane"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "all.png"], ["'all.png' is one picture", "give one --kind, or a folder"]),
        (["--kind", "profile"], ["a profile needs its line"]),
        (["--line", "1,2,3"], ["the line is '1,2,3'", "4 numbers in metres"]),
        (["--kind", "3d", "--at", "nan,0"], ["'nan,0'", "2 numbers"]),
        (["--kind", "3d", "--at", "50,0"], ["(50, 0) m lies outside the terrain", "x -15 to 15 m"]),
        (["--kind", "profile", "--line", "50,50,60,60"], ["does not meet the terrain"]),
        (["--kind", "3d", "--heading", "3 m"], ["heading of the rover"]),
        (["--kind", "3d", "--heading", "30"], ["heading of the rover is 30 without a unit", "'30 deg'"]),
        (["-o", "yard.jpg"], ["'yard.jpg' is named as a picture that is no PNG", "yard.png", "folder"]),
        (["--kind", "shade", "-o", "/proc/x/y"], ["the folder '/proc/x/y' cannot be made"]),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(scene, tmp_path, arguments, words):
    assert_refused(rille("terrain", "preview", scene, *arguments, cwd=tmp_path), *words)


def test_a_scene_that_is_not_there(tmp_path):
    assert_refused(rille("terrain", "preview", tmp_path / "no.db"), "there is no file", "rille terrain build SCENE.toml")
    assert_refused(rille("terrain", "preview", tmp_path / "no.toml"), "there is no file")
    assert_refused(rille("terrain", "preview", tmp_path / "no.toml", "--watch"), "to watch")


def wait_for(path, words, seconds=60):
    """Lines of a file, once it holds the words."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        text = path.read_text()
        if words in text:
            return text
        time.sleep(0.05)
    raise AssertionError(f"no '{words}' in: {path.read_text()}")


def test_watching_draws_again_and_survives_a_broken_scene(scene, tmp_path):
    picture, talk = tmp_path / "yard.png", tmp_path / "talk.txt"
    with talk.open("w") as file:
        command = [RILLE, "terrain", "preview", str(scene), "--kind", "shade", "-o", str(picture), "--watch"]
        child = subprocess.Popen(command, stderr=file, stdout=subprocess.DEVNULL, env=os.environ)
    try:
        wait_for(talk, "drew shade in ")
        first = picture.read_bytes()
        scene.write_text(SCENE.replace('diameter = "6 m"', "diameter = "))
        assert "is not valid TOML" in wait_for(talk, "not drawn: ")
        assert picture.read_bytes() == first
        scene.write_text(SCENE.replace('x = "5 m"', 'x = "-5 m"'))
        end = time.monotonic() + 60
        while talk.read_text().count("drew shade in ") < 2 and time.monotonic() < end:
            time.sleep(0.05)
        assert talk.read_text().count("drew shade in ") == 2
        assert picture.read_bytes() != first
        child.send_signal(signal.SIGINT)
        assert child.wait(timeout=30) == 130
    finally:
        child.kill()
        child.wait()


def test_ground_that_was_drawn_is_let_go(scene, tmp_path, monkeypatch):
    """Heights that stay in their file hold the lock of the scene; watching must not hold it when it evaluates the scene again."""
    monkeypatch.setattr(surface, "IN_MEMORY", 1000)
    terrain_preview._drawn(scene, None, {terrain_preview.Kind.SHADE: tmp_path / "yard.png"}, {})
    with surface.kept(scene) as store:
        assert store.state
        assert store.folder.parent == tmp_path / "cache" / "terrain"


def test_watching_looks_at_every_file_that_a_scene_names(tmp_path):
    (tmp_path / "forms").mkdir()
    scene, form = tmp_path / "scene.toml", tmp_path / "forms" / "bowl.toml"
    form.write_text("")
    scene.write_text(
        'library = ["forms"]\n[base]\nfile = "dem.tif"\n[[population]]\ndensity = { map = "rocks.tif" }\n[[population]]\n'
        'density = { around = "crater" }\n[[population]]\n'
    )
    assert terrain_preview.used_files(scene) == [scene, tmp_path / "dem.tif", tmp_path / "rocks.tif", form]


def test_help_has_an_example():
    assert "Example: rille terrain preview" in rille("terrain", "preview", "--help").stdout


def test_a_database_without_a_rover_and_a_picture_that_is_none_are_refused(scene, tmp_path):
    database = tmp_path / "ground.db"
    assert rille("terrain", "build", scene, "-o", database).returncode == 0
    assert_refused(rille("terrain", "preview", scene, "--kind", "3d", "--rover", database, "-o", tmp_path / "p.png"), "no rover")
    assert_refused(rille("terrain", "stats", scene, "--picture", tmp_path / "p.tif"), "p.tif", "PNG")
