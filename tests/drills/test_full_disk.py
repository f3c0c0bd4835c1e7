"""A disk that is full: one sentence, the exit code of a refusal, and what was there stays readable.

A file system of its own (tmpfs of 3 MB) where that is allowed; else the largest size of a file is limited for the child, which gives the
same errors at the same places.
"""

import contextlib
import math
import os
import resource
import shutil
import signal
import subprocess
import tempfile
import time
from collections import Counter
from pathlib import Path

import pytest

from command import RILLE
from effect_rigs import EARTH
from machines import cart, plane
from rille import store, terrain
from rille.cli.sweep_prepare import prepare
from rille.model import Command, MachineFailed, Scenario
from rille.model.study import Case
from rille.study import read_study_sheet

SIZE = 3_000_000  # bytes


@contextlib.contextmanager
def mounted(folder: Path, size: int):
    """The folder, new, with room for ``size`` bytes; yields whether a file system of its own could be mounted there."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    done = os.geteuid() == 0 and subprocess.run(mount, capture_output=True).returncode == 0
    yield done
    if done:
        subprocess.run(["umount", "-l", str(folder)], check=True)


@pytest.fixture
def small(tmp_path):
    """A folder with room for ``SIZE`` bytes, and what a child does before it starts."""
    folder = tmp_path / "small"

    def limited():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (SIZE, SIZE))

    with mounted(folder, SIZE) as done:
        yield folder, None if done else limited


def run(limited, *arguments):
    return subprocess.run([RILLE, *map(str, arguments)], capture_output=True, text=True, timeout=120, preexec_fn=limited)


def refused(done):
    """One sentence and no more; the solver's own comes through rille."""
    assert done.returncode == 3, (done.returncode, done.stdout, done.stderr)
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("rille: ")
    assert done.stderr.count("\n") == 1, done.stderr


@pytest.fixture
def model(make_model):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=100, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    return make_model(rover, scenario, plane(0.02))


def placed(model: Path, folder: Path) -> Path:
    path = folder / "model.db"
    shutil.copyfile(model, path)
    return path


def test_a_run_that_fills_the_disk_keeps_what_it_committed(model, small):
    folder, limited = small
    path = placed(model, folder)
    refused(run(limited, "run", path))
    runs = store.list_runs(path)
    assert len(runs) == 1
    assert len(store.read_trace(path).time) > 100  # chunks that were committed
    assert [line for line in store.check(path) if "never ended" not in line] == []


def test_a_replay_that_finds_no_room_leaves_nothing(model, small):
    folder, limited = small
    path = placed(model, folder)
    assert run(limited, "run", path, "--duration", "1").returncode == 0
    filler = folder / "filler"
    with filler.open("wb") as file:
        room = os.statvfs(folder).f_bavail * os.statvfs(folder).f_frsize if limited is None else 0
        file.truncate(0)
        if room:
            file.write(b"x" * max(0, room - 200_000))
    target = folder / "page.html"
    if limited is not None:
        pytest.skip("without a file system of its own a page of 2 MB finds room")
    refused(run(limited, "replay", path, "-o", target))
    assert not target.exists()
    assert not list(folder.glob("*.part"))


def test_an_export_and_a_terrain_that_find_no_room(model, small, repository):
    folder, limited = small
    target = folder / "dem.npy"
    if limited is None:
        (folder / "filler").write_bytes(b"x" * (SIZE - 600_000))
    else:
        resource_limit = 100_000

        def limited() -> None:  # a DEM of 400 x 600 float32 has 960 kB
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (resource_limit, resource_limit))

    done = run(limited, "terrain", "build", repository / "examples/terrain/composed.toml", "-o", target)
    refused(done)
    assert not target.exists()


GROUND = """
name = "slope"
soil = "lunar_soft"

[base]
kind = "plane"
size = ["40 m", "20 m"]
posting = "0.1 m"
slope = "2 deg"
"""
SLOPES = 24


@pytest.fixture
def temporary(tmp_path):
    """A folder for temporary files with room for 40 MB."""
    folder = tmp_path / "temporary"
    with mounted(folder, 40_000_000) as done:
        if not done:
            pytest.skip("a file system of its own cannot be mounted here")
        yield folder


def fill(filler: Path) -> None:
    """Take all the room that is left."""
    with contextlib.suppress(OSError), filler.open("ab") as file:
        while True:
            file.write(bytes(1 << 16))
            file.flush()


def sloping_study(tmp_path: Path) -> Path:
    """The sheet of a study whose cases each have ground of their own."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=1, gravity=(0, 0, -EARTH), terrain="slope", placement="on_terrain", settle_time=1, commands=commands
    )
    model, scene, sheet = (tmp_path / name for name in ("model.db", "slope.toml", "study.toml"))
    scene.write_text(GROUND)
    store.create(model)
    store.write_rover(model, rover)
    store.write_terrain(model, terrain.build(scene))
    store.write_scenario(model, scenario)
    sheet.write_text(
        'name = "s"\nmodel = "model.db"\nscenario = "s"\nterrain = "slope.toml"\ndesign = "grid"\n'
        f'levels = {SLOPES}\n[[vary]]\nname = "base.slope"\nlow = "1 deg"\nhigh = "6 deg"\n'
    )
    return sheet


def test_a_study_that_finds_no_room_keeps_what_is_done_and_goes_on(temporary, tmp_path):
    """Each slope is ground of its own, which workers write to TMPDIR: that fills while they are at work, and is emptied again. A full disk
    is no case's fault, so it is no case's outcome.
    """
    sheet, study = sloping_study(tmp_path), tmp_path / "study.db"
    command = [RILLE, "sweep", str(sheet), "-o", str(study), "--workers", "1"]
    environment = {**os.environ, "TMPDIR": str(temporary)}
    filler = temporary / "filler"
    filler.touch()  # while there is room for its name
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not (study.exists() and "done" in store.read_study(study).status):
        time.sleep(0.01)
    fill(filler)
    out, err = process.communicate(timeout=120)
    refused(subprocess.CompletedProcess(command, process.returncode, out, err))
    assert "no room" in err
    assert "goes on" in err
    status = store.read_study(study).status
    assert set(status) == {"done", "waiting"}, store.read_study(study).reason
    filler.unlink()
    again = subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)
    assert again.returncode == 0, again.stderr
    assert f"{status.count('done')} of {SLOPES} cases are done already" in again.stderr
    assert store.read_study(study).status == ("done",) * SLOPES
    assert list(temporary.iterdir()) == []  # nor do workers leave anything


def test_whatever_room_is_left_no_case_is_refused_for_want_of_it(temporary, tmp_path, monkeypatch):
    """Room ends at every place of a case in turn: in its heights, the copy of the model, the journal, the rows of ground and scenario."""
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    job = prepare(read_study_sheet(sloping_study(tmp_path)), tmp_path, lambda what, fraction: None).work
    filler = temporary / "filler"
    filler.touch()
    went = Counter()
    for number, pages in enumerate(range(0, 300, 2)):
        fill(filler)
        os.truncate(filler, max(0, filler.stat().st_size - 4096 * pages))
        try:
            (result,) = job([Case(number=number, values=(math.radians(1 + 0.01 * number),))])
            went[f"{result.status} {result.reason}"] += 1
        except MachineFailed as failed:
            went[str(failed).split(" in ")[0]] += 1
        os.truncate(filler, 0)
    assert set(went) == {"no room for a worker", "done "}, went
