"""kill -9 at random moments: nothing that was committed is lost, the database is sound, and the same command completes what was begun."""

import json
import os
import signal
import subprocess
import time

import numpy as np
import pytest

from command import RILLE, rille
from effect_rigs import EARTH
from machines import cart, plane
from remembering import TABLES, make_remembering, numbers
from rille import store
from rille.model import Command, Scenario, Sensor

MOMENTS = np.random.default_rng(20261123).uniform(0.25, 1.1, 3)  # [s] after the start of the program; Python itself takes 0.2


def kill(seconds, *arguments, cwd=None):
    """Start the command and kill it with all its children after so long. Returns whether it was still at work."""
    process = subprocess.Popen(
        [RILLE, *map(str, arguments)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True, cwd=cwd
    )
    time.sleep(seconds)
    working = process.poll() is None
    if working:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return working


def sound(path):
    """The file is whole; that a run never ended may be said."""
    assert [line for line in store.check(path) if "never ended" not in line] == []


def test_a_run_is_killed_three_times_and_goes_on_bit_by_bit(tmp_path):
    whole = make_remembering(tmp_path / "whole.db")
    assert rille("run", whole).returncode == 0
    path = make_remembering(tmp_path / "model.db")
    held = {}  # by run: its rows after the last kill; a run that was killed in its first moments has none
    for seconds in MOMENTS + 0.1:
        kill(seconds, "run", path, "--checkpoint", "0.05", *(["--resume"] if store.list_runs(path) else []))
        sound(path)
        now = {row.id: numbers(path, row.id) for row in store.list_runs(path)}
        for run, before in held.items():
            for table in TABLES:
                assert set(before[table]) <= set(now[run][table]), table
        held = now
    done = rille("run", path, "--resume")
    if done.returncode == 3:  # killed before there was a checkpoint, or done before it was killed
        assert "no run that was interrupted" in done.stderr
        done = rille("run", path)
    assert done.returncode == 0, done.stderr
    first, second = numbers(whole), numbers(path, store.list_runs(path)[-1].id)
    for table in TABLES:
        assert first[table] == second[table], table


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder with a recording of a cart (CSV and manifest), and a model for it."""
    folder = tmp_path_factory.mktemp("recorded")
    rover = cart(5.0, 0.15, 0.165)
    from dataclasses import replace

    sensors = tuple(
        Sensor(name=f"encoder_{k}", quantity="joint.velocity", target=joint.name, rate=1000.0) for k, joint in enumerate(rover.joints)
    )
    commands = tuple(Command(drive=d.name, time=t, value=v) for d in rover.drives for t, v in ((0.0, 1.0), (3.0, -0.5)))
    scenario = Scenario(
        name="s", duration=60, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    path = folder / "model.db"
    store.create(path)
    store.write_rover(path, replace(rover, sensors=sensors))
    store.write_terrain(path, plane(0.02))
    store.write_scenario(path, scenario)
    done = rille("record", "run", path, "-o", folder / "drive.csv")
    assert done.returncode == 0, done.stderr
    return folder


def fresh_model(recorded, target):
    """A copy of the model without the recording."""
    target.write_bytes((recorded / "model.db").read_bytes())
    return target


def test_an_import_is_killed_three_times_and_brings_the_same_recording(recorded, tmp_path):
    whole, path = fresh_model(recorded, tmp_path / "whole.db"), fresh_model(recorded, tmp_path / "model.db")
    assert rille("import", recorded / "drive.toml", "-o", whole).returncode == 0
    for seconds in MOMENTS:
        kill(seconds, "import", recorded / "drive.toml", "-o", path)
        sound(path)
    if not store.recording_names(path):
        done = rille("import", recorded / "drive.toml", "-o", path)
        assert done.returncode == 0, done.stderr
    (name,) = store.recording_names(path)
    first, second = store.read_recording(whole, name), store.read_recording(path, name)
    assert [channel.name for channel in first.channels] == [channel.name for channel in second.channels]
    for a, b in zip(first.channels, second.channels, strict=True):
        assert np.array_equal(a.time, b.time)
        assert np.array_equal(a.value, b.value, equal_nan=True)


def test_a_terrain_is_killed_while_it_is_built_and_has_the_same_heights(repository, tmp_path, monkeypatch):
    scene = tmp_path / "scene.toml"
    scene.write_text((repository / "examples/terrain/composed.toml").read_text())
    for name in ("whole", "killed"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache_whole"))
    assert rille("terrain", "build", scene, "-o", tmp_path / "whole/dem.npy").returncode == 0
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache_killed"))
    for seconds in MOMENTS:
        kill(seconds, "terrain", "build", scene, "-o", tmp_path / "killed/dem.npy")
        left = [file.name for file in (tmp_path / "killed").iterdir() if file.name == "dem.npy"]
        if left:
            np.load(tmp_path / "killed/dem.npy")  # whole or not there, never half
    done = rille("terrain", "build", scene, "-o", tmp_path / "killed/dem.npy", "--force")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "killed/dem.npy").read_bytes() == (tmp_path / "whole/dem.npy").read_bytes()


@pytest.fixture(scope="module")
def puzzle(tmp_path_factory):
    """A database with a pendulum and recordings of one that has a law more, as sealed trials are made."""
    pytest.importorskip("mujoco", reason="sealed trials need MuJoCo: pip install 'rille[proof]'")
    from rille.cli.prove_run import make_trial
    from rille.proof.trials import Trial

    folder = tmp_path_factory.mktemp("puzzle")
    _, files, _ = make_trial(Trial(number=3, sort="one", machine="pendulum", strength=5.0, beacon="killed"))
    for name, content in files.items():
        (folder / name).write_bytes(content)
    done = rille("import", *sorted(folder.glob("*.toml")), "-o", folder / "model.db")
    assert done.returncode == 0, done.stderr
    return folder / "model.db"


def answer(text):
    """What a diagnosis says, without the file's name, its own, and how long it took."""
    return {key: value for key, value in json.loads(text).items() if key not in ("model", "finding", "seconds")}


def test_a_diagnosis_is_killed_and_goes_on_to_the_same_answer(puzzle, tmp_path, monkeypatch):
    """Killed once in each third of the time that it takes; nothing but whole findings is in the database."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")  # sums in another order are other last digits
    words = ["--held-out", "held_out", "--only", "coulomb_friction", "--only", "viscous_friction", "--json"]
    path, whole = tmp_path / "model.db", tmp_path / "whole.db"
    for copy in (path, whole):
        copy.write_bytes(puzzle.read_bytes())
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache_whole"))
    begin = time.monotonic()
    expected = rille("diagnose", whole, *words)
    took = time.monotonic() - begin
    assert expected.returncode == 0, expected.stderr
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache_killed"))
    for share in np.random.default_rng(8).uniform((0.1, 0.4, 0.7), (0.4, 0.7, 1.0)):
        kill(share * took, "diagnose", path, *words)
        sound(path)
        assert all(finding.sentence for finding in store.read_findings(path))
    done = rille("diagnose", path, *words)
    assert done.returncode == 0, done.stderr
    assert answer(done.stdout) == answer(expected.stdout)
    assert any((tmp_path / "cache_killed").rglob("*.pickle"))
