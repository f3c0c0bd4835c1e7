"""Two programs at one database: both complete, or one is refused in a sentence."""

import json
import subprocess
import time
from dataclasses import replace

import pytest

from command import RILLE
from effect_rigs import EARTH
from machines import cart, plane
from rille import store
from rille.model import Command, Scenario


@pytest.fixture
def path(make_model):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=20, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    found = make_model(rover, scenario, plane(0.02))
    store.write_scenario(found, replace(scenario, name="other"))
    return found


def start(*arguments):
    return subprocess.Popen([RILLE, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def end(process):
    out, err = process.communicate(timeout=120)
    assert "Traceback" not in err
    return process.returncode, out, err


def test_two_runs_on_one_database(path):
    two = [start("run", path, "--scenario", name, "--json") for name in ("s", "other")]
    ends = [end(process) for process in two]
    done = [json.loads(out) for code, out, _ in ends if code == 0]
    assert done, ends
    for code, _, err in ends:
        assert code in (0, 3), err
        assert code == 0 or err.count("\n") <= 2, err
    for facts in done:
        trace = store.read_trace(path, facts["run_id"])
        assert trace.status == "done"
        assert len(trace.time) == 1001
    assert [line for line in store.check(path) if "never ended" not in line] == []


def test_readers_see_what_a_run_has_committed(path):
    run = start("run", path, "--scenario", "s", "--duration", "80", "--json")
    seen = []
    while run.poll() is None:
        try:
            runs = store.list_runs(path)
            seen.append(len(store.read_trace(path).time) if runs else 0)
        except Exception as error:
            raise AssertionError(f"a reader was turned away: {error}") from error
        time.sleep(0.05)
    code, _, err = end(run)
    assert code == 0, err
    assert seen == sorted(seen)
    assert len(store.read_trace(path).time) == 4001


def test_a_run_and_writers_of_another_kind(path):
    run = start("run", path, "--scenario", "s", "--duration", "60", "--json")
    others = [
        start("effects", "add", path, "viscous_friction", "--target", "wheel_front_left", "--set", "coefficient=0.1") for _ in range(2)
    ]
    for code, _, err in (end(run), *map(end, others)):
        assert code in (0, 3), err
    assert [line for line in store.check(path) if "never ended" not in line] == []


def test_two_sweeps_of_one_sheet(path, tmp_path):
    """Begun together on a file that is not there yet: one does all cases, the other does or is refused; and the study is whole."""
    (soil,) = {soil.name for soil in store.read_terrain(path).soils}
    sheet, study = tmp_path / "study.toml", tmp_path / "study.db"
    sheet.write_text(
        f'name = "s"\nmodel = "{path}"\nscenario = "s"\ndesign = "latin_hypercube"\nsamples = 8\nset = {{ "scenario.duration" = "1 s" }}\n'
        f'[[vary]]\nname = "soil.{soil}.cohesion"\nlow = "0 Pa"\nhigh = "2 kPa"\n'
    )
    ends = [end(process) for process in [start("sweep", sheet, "-o", study, "--workers", "1") for _ in range(2)]]
    assert 0 in [code for code, _, _ in ends], ends
    for code, _, err in ends:
        assert code in (0, 3), err
        assert code == 0 or any(words in err for words in ("exists already", "another `rille sweep` is at work")), err
    assert store.read_study(study).status == ("done",) * 8
    assert not list(tmp_path.glob(".study.db*")) + list(tmp_path.glob("study.db-*"))
