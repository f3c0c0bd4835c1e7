"""The command ``rille`` as a user meets it: exit codes, sentences, JSON, nothing destroyed."""

import json
import os
import pty
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from command import RILLE, assert_refused, rille
from rille import __version__, store
from rille.model import Command, Scenario


def test_the_version_is_a_verb_and_an_option():
    verb, option = rille("version"), rille("--version")
    assert (option.returncode, option.stdout, option.stderr) == (0, verb.stdout, verb.stderr)
    assert verb.stdout.strip() == __version__


def test_run_prints_a_table_and_leaves_a_run(model):
    done = rille("run", model)
    assert done.returncode == 0, done.stderr
    for word in ("distance", "mean slip ratio", "maximal sinkage", "energy", "real-time factor"):
        assert word in done.stdout
    assert store.list_runs(model)[0].status == "done"


def test_json_is_one_object_on_stdout(model, tmp_path):
    for arguments in (("run", model), ("db", "info", model), ("db", "check", model), ("db", "migrate", model)):
        answer = json.loads(rille(*arguments, "--json").stdout)
        assert isinstance(answer, dict)
    run = json.loads(rille("run", model, "--json", "--duration", "0.5").stdout)
    assert run["summary"]["duration"] == pytest.approx(0.5)
    assert len(json.loads(rille("terrain", "list", "--json").stdout)["crater"]["drivers"]) >= 2


def test_out_writes_beside_the_model_and_leaves_it_alone(model, tmp_path):
    before = model.read_bytes()
    other = tmp_path / "run.db"
    assert rille("run", model, "--out", other).returncode == 0
    assert model.read_bytes() == before
    assert len(store.list_runs(other)) == 1
    assert_refused(rille("run", model, "--out", other), "exists already")


def test_view_draws_plots_and_map(model, tmp_path):
    rille("run", model)
    done = rille("view", model, "-o", tmp_path / "pictures")
    assert done.returncode == 0, done.stderr
    for line in done.stdout.split():
        assert Path(line).read_bytes().startswith(b"\x89PNG")
    assert "map.png" in done.stdout
    assert "traces.png" in done.stdout


def bad_databases(tmp_path, model):
    """Path and expected word of every kind of file that is no database of ours."""
    text, foreign, newer, truncated = (tmp_path / f"{n}.db" for n in ("text", "foreign", "newer", "truncated"))
    text.write_text("hello")
    with closing(sqlite3.connect(foreign)) as connection:
        connection.execute("CREATE TABLE t (x)")
        connection.commit()
    shutil.copyfile(model, newer)
    with closing(sqlite3.connect(newer)) as connection:
        connection.execute("PRAGMA user_version = 999")
        connection.commit()
    truncated.write_bytes(model.read_bytes()[:20000])
    return {
        tmp_path / "absent.db": "there is no file",
        text: "not an SQLite database",
        foreign: "another program",
        newer: "upgrade",
        truncated: "restore",
    }


def test_every_verb_refuses_every_bad_database_and_keeps_it(tmp_path, model, repository):
    scene = tmp_path / "flat.toml"
    scene.write_text('name = "f"\nsoil = "lunar_sourcebook"\n[base]\nkind = "flat"\nsize = [10, 10]\nposting = 1\n')
    for path, word in bad_databases(tmp_path, model).items():
        before = path.read_bytes() if path.exists() else None
        verbs = [("run", path), ("view", path), ("db", "check", path), ("db", "info", path), ("db", "migrate", path)]
        if before is not None:
            verbs.append(("terrain", "build", scene, "-o", path))
        for verb in verbs:
            assert_refused(rille(*verb), word)
        assert (path.read_bytes() if path.exists() else None) == before


SHEET = 'step = "{step}"\ndefault_material = "steel"\n[[material]]\nname = "steel"\ndensity = 7850\n'


@pytest.fixture(scope="module")
def step_files(tmp_path_factory):
    """Small STEP files: two boxes, and a surface without a solid."""
    import cadquery as cq

    folder = tmp_path_factory.mktemp("step")
    box = cq.Workplane().box(100, 100, 100)
    assembly = cq.Assembly(name="thing").add(box, name="lower_arm").add(box, name="upper_arm", loc=cq.Location((0, 0, 200)))
    assembly.export(str(folder / "two.step"))
    cq.exporters.export(cq.Workplane(obj=box.faces(">Z").val()), str(folder / "surface.step"))
    return folder


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ('[[body]]\nname = "b"\nparts = ["thing/loer_arm"]\n', ("loer_arm", "did you mean 'thing/lower_arm'")),
        ('[[part]]\nmatch = "lower_arm"\nmass = "0 kg"\n[[body]]\nname = "b"\nparts = ["thing"]\n', ("lower_arm", "0 kg", "above 0")),
        (
            '[[part]]\nmatch = "lower_arm"\nmass = "1 kg"\ninertia = [1, 1, 5, 0, 0, 0]\n[[body]]\nname = "b"\nparts = ["thing"]\n',
            ("triangle inequality",),
        ),
        ('[[body]]\nname = "b"\nparts = ["thing"]\nmas = 3\n', ("mas", "did you mean 'mass'")),
        ('[[body]]\nname = "b"\nparts = ["thing/lower_arm"]\n', ("upper_arm", "belongs to no body")),
        ('[[body]]\nname = "b"\nparts = ["thing"]\nmass = "3 apples"\n', ("apples",)),
        ("[[body]\n", ("TOML",)),
    ],
)
def test_cad_build_refuses_in_one_sentence(tmp_path, step_files, extra, words):
    sheet, target = tmp_path / "sheet.toml", tmp_path / "model.db"
    sheet.write_text(SHEET.format(step=step_files / "two.step") + extra)
    assert_refused(rille("cad", "build", sheet, "-o", target), *words)
    assert not target.exists()


def test_cad_build_refuses_bad_step_files(tmp_path, step_files):
    sheet = tmp_path / "sheet.toml"
    body = '[[body]]\nname = "b"\nparts = ["*"]\n'
    broken = tmp_path / "broken.step"
    broken.write_text("ISO-10303-21;\nHEADER;\nrubbish")
    text = tmp_path / "text.step"
    text.write_text("no step at all")
    for file, word in (
        (tmp_path / "none.step", "there is no"),
        (text, "not a STEP file"),
        (broken, "broken.step"),
        (step_files / "surface.step", "no solid"),
    ):
        sheet.write_text(SHEET.format(step=file) + body)
        assert_refused(rille("cad", "build", sheet, "-o", tmp_path / "model.db"), word)
    assert_refused(rille("cad", "build", tmp_path / "none.toml"), "there is no file")


def test_a_bad_scenario_file_is_refused(tmp_path, model):
    file = tmp_path / "s.toml"
    before = model.read_bytes()
    good = 'name = "s"\nduration = "1 s"\nterrain = "plane"\n'
    for text, words in (
        (good + 'gravty = "moon"\n', ("gravty", "gravity")),
        (good + 'gravity = "mon"\n', ("moon",)),
        (good + '[[command]]\ndrives = ["whel_*"]\nvalue = 1\n', ("whel_*", "wheel_")),
        (good + '[[command]]\ndrives = ["wheel_*"]\nvalue = "3 kg"\n', ("3 kg",)),
        (good.replace("plane", "plain"), ("plain", "plane")),
        (good.replace('"1 s"', '"-1 s"'), ("duration",)),
        ('name = "s"\n', ("duration", "missing")),
    ):
        file.write_text(text)
        assert_refused(rille("run", model, "--scenario", file), *words)
        assert model.read_bytes() == before


def test_commands_come_from_a_table(tmp_path, model):
    """A drive stands, turns by 90 deg/s for a second, stands: 1.57 rad, less the ramp of one step."""
    table, file = tmp_path / "commands.csv", tmp_path / "s.toml"
    file.write_text('name = "s"\nduration = "2 s"\nterrain = "plane"\ncommand_table = "commands.csv"\n')
    table.write_text("time,wheel_* [deg/s],wheel_front_left [deg/s]\n0,0,\n0.5,90,\n1.5,0,\n1.0,,90\n")
    assert rille("run", model, "--scenario", file).returncode == 0
    trace = store.read_trace(model)
    assert trace.joints[0].position[-1] == pytest.approx(1.5708, abs=0.01)
    for text, words in (
        ("time,whel_* [deg/s]\n0,1\n", ("whel_*", "wheel_")),
        ("time,wheel_* [kg]\n0,1\n", ("kg",)),
        ("time,wheel_*\n0,fast\n", ("line 2", "fast")),
        ("time,wheel_*\n0,nan\n", ("line 2", "nan")),
        ("time,wheel_*\n,1\n", ("line 2", "no time")),
        ("time,wheel_*\n0,1,2\n", ("line 2", "3 cells")),
        ("wheel_*\n1\n", ("header",)),
    ):
        table.write_text(text)
        assert_refused(rille("run", model, "--scenario", file), *words)
    table.unlink()
    assert_refused(rille("run", model, "--scenario", file), "commands.csv")


def test_usage_is_2_and_a_bug_is_1(model, tmp_path):
    assert rille("run").returncode == 2
    assert rille("dance").returncode == 2
    assert rille("run", model, "--step", "fast").returncode == 2
    liar = tmp_path / "liar"
    liar.write_text("#!/bin/sh\necho not json\n")
    liar.chmod(0o755)
    done = rille("run", model, env={**os.environ, "RILLE_SOLVER": str(liar)})
    assert done.returncode == 1
    assert "bug" in done.stderr
    assert "Traceback" not in done.stderr


def write_crawl(model):
    """A scenario that outlasts every test."""
    crawl = tuple(Command(drive=d.name, time=0.0, value=1e-5) for d in store.read_rover(model).drives)
    store.write_scenario(model, Scenario(name="crawl", duration=100000, terrain="plane", placement="on_terrain", commands=crawl))


def wait_until_it_runs(model):
    """Until the solver has opened its run; before that Python still starts."""
    deadline = time.monotonic() + 60
    while not store.list_runs(model) and time.monotonic() < deadline:
        time.sleep(0.1)


INTERRUPTS = """
import os, signal, sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "rille.cli.sweep":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from rille.cli import main
main()
"""


def test_ctrl_c_while_python_reads_modules_is_a_sentence():
    done = subprocess.run([sys.executable, "-c", INTERRUPTS], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (130, "rille: interrupted before anything was begun\n")


def test_ctrl_c_on_a_terminal_is_130_and_keeps_the_run(model):
    """Both rille and the solver get SIGINT, as from a keyboard; the bar is drawn on a terminal."""
    write_crawl(model)
    try:
        primary, secondary = pty.openpty()
    except OSError as error:
        pytest.skip(f"this machine hands out no pseudo-terminals: {error}")
    process = subprocess.Popen(
        [RILLE, "run", str(model), "--scenario", "crawl"], stdout=subprocess.PIPE, stderr=secondary, text=True, start_new_session=True
    )
    os.close(secondary)
    wait_until_it_runs(model)
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    os.close(primary)
    assert process.returncode == 130
    assert "interrupted" in output
    assert store.read_trace(model).status == "interrupted"


def test_a_scenario_that_cannot_be_run_is_not_kept(model, tmp_path):
    """Neither as a scenario nor as a run that goes on for ever."""
    before = store.scenario_names(model)
    runs = len(store.list_runs(model))
    sheet = tmp_path / "odd.toml"
    body = store.read_rover(model).bodies[0].name
    change = f'[[state_change]]\ntime = 0.1\nquantity = "part.position"\ntarget = "{body}"\nvalues = [1.0, 2.0]\n'
    sheet.write_text(f'name = "odd"\nduration = "0.2 s"\nterrain = "plane"\n{change}')
    assert_refused(rille("run", model, "--scenario", sheet), "takes 3 numbers, not 2")
    assert store.scenario_names(model) == before
    assert len(store.list_runs(model)) == runs
    assert store.check(model) == []


def test_numbers_that_end_before_the_run_are_told(model):
    """States are stored every 99 s of a run of 0.2 s: only the first one is."""
    store.write_scenario(model, Scenario(name="sparse", duration=0.2, output_interval=99.0, terrain="plane", placement="on_terrain"))
    done = rille("run", model, "--scenario", "sparse")
    assert done.returncode == 0, done.stderr
    assert "last stored state" in done.stderr
    assert "0.2 s" in done.stderr


def test_an_interrupt_of_rille_alone_reaches_the_solver(model):
    """As supervisors and the stop buttons of editors send it: not to the group of processes, as a keyboard does."""
    write_crawl(model)
    process = subprocess.Popen([RILLE, "run", str(model), "--scenario", "crawl"], stdout=subprocess.PIPE, text=True, start_new_session=True)
    wait_until_it_runs(model)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in output
    assert store.read_trace(model).status == "interrupted"


def test_an_outcome_of_physics_is_4(model):
    rover = store.read_rover(model)
    commands = tuple(Command(drive=d.name, time=0.0, value=30.0) for d in rover.drives)
    store.write_scenario(model, Scenario(name="far", duration=100, terrain="plane", placement="on_terrain", commands=commands))
    done = rille("run", model, "--scenario", "far")
    assert done.returncode == 4
    assert "left terrain" in done.stderr
    assert "left_terrain" in done.stdout
