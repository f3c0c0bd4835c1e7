"""``rille replay``: files of every kind, and sentences for what cannot be."""

import json
import signal
import sqlite3
import subprocess
import time
from dataclasses import replace

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from command import RILLE, assert_refused, rille
from effect_rigs import EARTH
from machines import cart, plane
from rille import store
from rille.cli.replay import _latest
from rille.model import Command, Scenario


@pytest.fixture
def path(make_model):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=1, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    found = make_model(rover, scenario, plane(0.05))
    assert rille("run", found).returncode == 0
    return found


def test_a_run_as_page_film_animation_and_stills(path, tmp_path):
    targets = [tmp_path / name for name in ("p.html", "f.mp4", "g.gif", "a.glb", "s.png")]
    options = ["--size", "160x90", "--fps", "10", "--speed", "2", "--at", "0", "--at", "1", "--camera", "chase"]
    done = rille("replay", path, *(word for target in targets for word in ("-o", target)), *options, "--json")
    assert done.returncode == 0, done.stderr
    files = json.loads(done.stdout)["files"]
    assert files == [str(t) for t in (*targets[:4], tmp_path / "s-0s.png", tmp_path / "s-1s.png")]
    for film in targets[1:3]:
        frames = imageio_ffmpeg.read_frames(str(film))
        facts = next(frames)
        pictures = [np.frombuffer(frame, np.uint8) for frame in frames]
        assert facts["size"] == (160, 90)
        assert len(pictures) == 6  # 1 s at twice its speed and ten frames a second: 0.5 s, both ends included
        assert np.abs(pictures[0].astype(int) - pictures[-1]).mean() > 1  # it moves
    first, last = (np.asarray(Image.open(tmp_path / f"s-{t}s.png").convert("L"), dtype=int) for t in (0, 1))
    assert first.std() > 10
    assert np.abs(first - last).mean() > 1
    assert (tmp_path / "a.glb").read_bytes()[:4] == b"glTF"
    assert sorted(p.name for p in tmp_path.iterdir() if p.suffix == ".part") == []


def test_a_film_shows_the_other_run_as_a_ghost_and_an_animation_tells_that_it_does_not(path, tmp_path):
    assert rille("run", path, "--duration", "0.5", "--step", "0.002").returncode == 0
    options = ["--run", "1", "--size", "160x90", "--at", "0.4", "--camera=2,-3,1.5"]
    alone, both = tmp_path / "alone.png", tmp_path / "both.png"
    assert rille("replay", path, *options, "-o", alone).returncode == 0
    done = rille("replay", path, *options, "-o", both, "-o", tmp_path / "a.glb", "--against", "2", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["notes"] == ["'a.glb' holds run 1 alone: run 2 is in pages, films and stills"]
    first, second = (np.asarray(Image.open(p).convert("RGB"), dtype=int) for p in (alone, both))
    assert 0 < (np.abs(first - second).max(axis=2) > 8).mean() < 0.5  # something is there besides, and not everywhere


def test_a_run_on_other_ground_or_under_other_gravity_is_told(path, tmp_path):
    """It is drawn in the world of the run that is shown; a run of the same world is shown without a word."""
    store.write_terrain(path, replace(plane(0.0), name="flat"))
    for name, terrain, gravity in (("as before", "plane", EARTH), ("moon", "flat", 1.62)):
        scenario = Scenario(name=name, duration=0.1, gravity=(0, 0, -gravity), terrain=terrain, placement="on_terrain", settle_time=2)
        store.write_scenario(path, scenario)
        assert rille("run", path, "--scenario", name).returncode == 0
    notes = {}
    for other in ("2", "3"):
        done = rille("replay", path, "--run", "1", "--against", other, "-o", tmp_path / "p.html", "--json")
        assert done.returncode == 0, done.stderr
        notes[other] = json.loads(done.stdout)["notes"]
        assert all(note in done.stderr for note in notes[other])
    assert notes == {
        "2": [],
        "3": [
            "run 3 was on terrain 'flat'; it is shown on that of run 1, terrain 'plane'",
            "run 3 was under a gravity of 1.62 m/s^2; run 1 under 9.80665 m/s^2",
        ],
    }


def test_a_run_that_ended_where_it_began_has_a_still_picture_and_no_film(path, tmp_path):
    with sqlite3.connect(path) as connection:
        for table in ("body_state", "joint_state", "wheel_state", "energy_state"):
            connection.execute(f"DELETE FROM {table} WHERE time > 0")
    still = tmp_path / "s.png"
    done = rille("replay", path, "-o", still, "--size", "160x90")
    assert done.returncode == 0, done.stderr
    assert np.asarray(Image.open(still).convert("L"), dtype=int).std() > 10
    assert_refused(rille("replay", path, "-o", tmp_path / "f.mp4"), "--from must come before --to")


def test_the_latest_run_is_known_without_reading_it(path):
    assert _latest(path, None) == 1
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TABLE body_state")
    assert _latest(path, None) == 1


def test_without_a_run_it_says_how_to_make_one(path):
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("DELETE FROM run")
    assert_refused(rille("replay", path), "has no run; make one")


def test_ctrl_c_leaves_no_half_film(path, tmp_path):
    command = [RILLE, "replay", str(path), "-o", str(tmp_path / "f.mp4"), "--speed", "0.001", "--size", "640x360"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for _ in range(600):  # until ffmpeg writes
        if list(tmp_path.glob("rille-film-*/0.mp4")):
            break
        time.sleep(0.1)
    assert list(tmp_path.glob("rille-film-*/0.mp4")), "the film was not begun"
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 130
    assert list(tmp_path.glob("*.mp4")) == list(tmp_path.glob("rille-film-*")) == []


def test_the_page_stands_beside_the_database_by_default(path):
    done = rille("replay", path, "--against", "1", "--side")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(path.with_name(f"{path.stem}-run-1.html"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--run", "7"], ["has no run 7"]),
        (["--against", "mars"], ["neither a run nor a recording 'mars'"]),
        (["-o", "film.avi"], ["ends in none of"]),
        (["-o", "nowhere/p.html"], ["no folder 'nowhere'"]),
        (["-o", "s.png", "--at", "9"], ["time is 9 s", "goes from 0 to 1 s"]),
        (["-o", "f.mp4", "--from", "0.8", "--to", "0.2"], ["--from must come before --to"]),
        (["-o", "f.mp4", "--size", "huge"], ["size is 'huge'"]),
        (["-o", "f.mp4", "--camera", "selfie"], ["camera is 'selfie'"]),
        (["-o", "f.mp4", "--camera", "1,2,nan"], ["camera is '1,2,nan'", "or a place such as 3,-4,2"]),
    ],
)
def test_what_cannot_be_shown_is_refused(path, tmp_path, options, words):
    assert_refused(rille("replay", path, *options, cwd=tmp_path), *words)
    assert list(tmp_path.glob("f.*")) == []
