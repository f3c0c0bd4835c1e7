"""The program rille-solver: exit codes, sentences, interruption, chunks that stay readable."""

import json
import signal
import sqlite3
import subprocess
import time
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from machines import cart, plane
from rille import __version__, store
from rille.model import Command, Pose, Scenario
from rille.simulate.run import find_solver


@pytest.fixture
def model(tmp_path):
    """Database with a cart on a plane and a drive of an hour."""
    rover = cart(5.0, 0.15, 0.165)
    path = tmp_path / "model.db"
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, plane())
    commands = tuple(Command(drive=d.name, time=0.0, value=0.001) for d in rover.drives)
    scenario = Scenario(name="long", duration=3600, terrain="plane", placement="on_terrain", settle_time=1.0, commands=commands)
    store.write_scenario(path, scenario)
    return path


def solver(*arguments):
    """Run the program to its end."""
    return subprocess.run([find_solver(), *map(str, arguments)], capture_output=True, text=True, timeout=120)


def change(path, sql):
    """Edit a database by hand, past every check."""
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute(sql)
        connection.commit()


def test_a_run_answers_with_one_json_object(model):
    done = solver("run", model, "--duration", "0.5")
    assert done.returncode == 0
    result = json.loads(done.stdout)
    assert result["status"] == "done"
    assert result["steps"] == 500
    trace = store.read_trace(model)
    assert trace.time[-1] == pytest.approx(0.5)
    assert len(trace.time) == 26


def test_ctrl_c_leaves_a_readable_database_and_130(model):
    process = subprocess.Popen([find_solver(), "run", str(model)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    output, talk = process.communicate(timeout=30)
    assert process.returncode == 130
    result = json.loads(output)
    assert result["status"] == "interrupted"
    assert "readable" in talk
    trace = store.read_trace(model)
    assert trace.status == "interrupted"
    assert 0 < trace.time[-1] < 3600
    assert trace.time[-1] == pytest.approx(result["time_reached"])
    assert store.check(model) == []


def test_kill_in_mid_run_loses_at_most_the_open_chunk(model):
    process = subprocess.Popen([find_solver(), "run", str(model)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(2.0)
    process.kill()
    process.wait()
    trace = store.read_trace(model)
    assert trace.status == "running"
    assert len(trace.time) >= 200
    assert any("never ended" in problem for problem in store.check(model))
    assert solver("run", model, "--duration", "0.1").returncode == 0  # the file is not stuck


@pytest.mark.parametrize(
    ("sql", "word"),
    [
        ("UPDATE body SET mass = 0 WHERE name = 'chassis'", "chassis"),
        ("UPDATE body SET ixx = 100 WHERE name = 'chassis'", "triangle"),
        ("UPDATE wheel SET radius = 9e999", "inf"),
        ("DELETE FROM material_pair", "material_pair"),
        ("DELETE FROM terrain_tile", "no heights"),
        ("UPDATE terrain_tile SET n_rows = 7", "tile"),
        ("UPDATE scenario SET start_x = 500", "outside"),
        ("UPDATE scenario SET step = 1.0", "0.1"),
        ("UPDATE joint SET kind = 'fixed' WHERE name LIKE 'wheel_front_left'", "hinge"),
        ("DELETE FROM scenario", "no scenario"),
        ("UPDATE soil SET cohesion = -1", "cohesion"),
        ("UPDATE soil SET shear_modulus = 0", "shear_modulus"),
        ("UPDATE soil SET sinkage_exponent = 9e999", "sinkage_exponent"),
        ("UPDATE wheel SET radius = 0", "radius"),
        ("UPDATE drive SET max_torque = -3", "max_torque"),
        ("UPDATE scenario SET start_x = -500", "outside"),
        (
            "INSERT INTO obstacle (terrain_id, name, kind, x, y, z, size_x, size_y, size_z) "
            "VALUES (1, 'boulder', 'box', 0.5, 0.4, 0.1, 1, 1, 1)",
            "inside obstacle 'boulder'",
        ),
        ("INSERT INTO effect VALUES (1, (SELECT id FROM effect_kind WHERE name = 'slip_sinkage'), 'wheel_x', '{}')", "wheel_x"),
        ("INSERT INTO effect VALUES (1, (SELECT id FROM effect_kind WHERE name = 'slip_sinkage'), '*', '{\"slip_gain\": 99}')", "1.5"),
        (
            "INSERT INTO effect VALUES (1, (SELECT id FROM effect_kind WHERE name = 'slip_sinkage'), '*', '{\"gain\": 1}')",
            "no parameter 'gain'",
        ),
        (
            "INSERT INTO watch (scenario_id, name, quantity, target, above, action) VALUES (1, 'w', 'part.speed', 'chassis', 1, 'stop')",
            "part.speed",
        ),
        ("INSERT INTO watch (scenario_id, name, event, action) VALUES (1, 'w', 'stcuk', 'stop')", "never happens"),
        ("INSERT INTO watch (scenario_id, name, event, target, action) VALUES (1, 'w', 'stuck', 'chasis', 'stop')", "chasis"),
        ("INSERT INTO sensor VALUES (1, 's', 'joint.velocity', 'knee', 50, 'world')", "knee"),
    ],
)
def test_bad_values_are_sentences_and_exit_code_3(model, sql, word):
    change(model, sql)
    done = solver("run", model, "--duration", "0.1")
    assert done.returncode == 3, done.stderr
    assert word in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_a_hole_in_the_terrain_is_a_sentence_at_the_start_and_an_outcome_on_the_way(model):
    """Missing heights under the wheels at the start: refused. Met later: the run ends with what it has."""
    heights = np.array(plane().heights)
    commands = tuple(Command(drive=d.name, time=0.0, value=3.0) for d in cart(5.0, 0.15, 0.165).drives)
    for x, expected in ((0.0, 3), (3.0, 4)):
        holed = heights.copy()
        holed[:, round((x + 12.0) / 1.0)] = np.nan
        name = f"hole_at_{x:g}"
        store.write_terrain(model, replace(plane(), name=name, heights=holed))
        store.write_scenario(model, Scenario(name=name, duration=20, terrain=name, placement="on_terrain", commands=commands))
        done = solver("run", model, "--scenario", name)
        assert done.returncode == expected, done.stderr
        assert "missing height" in done.stderr or "no height" in done.stderr
        if expected == 4:
            trace = store.read_trace(model)
            assert trace.status == "left_terrain"
            assert len(trace.time) > 10


def test_an_effect_that_this_solver_does_not_have_is_refused_not_ignored(model):
    change(
        model,
        "INSERT INTO effect_kind (id, name, family, target, needs, memory, passive, channel, equation, meaning, source) "
        "VALUES (999, 'magic', 'body', 'body', '', 0, 1, 'part.position', 'x', 'x', 'x')",
    )
    change(model, "INSERT INTO effect_parameter VALUES (999, 'size', '1', 1, 'local', 0, 1, 1, 1, 'x')")
    assert solver("run", model, "--duration", "0.1").returncode == 0  # a catalogue entry alone changes nothing
    change(model, "INSERT INTO effect VALUES (1, 999, 'chassis', '{\"size\": 1}')")
    done = solver("run", model, "--duration", "0.1")
    assert done.returncode == 3
    assert "magic" in done.stderr


def test_leaving_the_terrain_is_an_outcome_with_code_4(model):
    scenario = Scenario(
        name="edge",
        duration=60,
        terrain="plane",
        placement="on_terrain",
        start=Pose(position=(10.0, 0.0, 0.0)),
        commands=tuple(Command(drive=d.name, time=0.0, value=5.0) for d in cart(5.0, 0.15, 0.165).drives),
    )
    store.write_scenario(model, scenario)
    done = solver("run", model, "--scenario", "edge")
    assert done.returncode == 4
    assert json.loads(done.stdout)["status"] == "left_terrain"
    assert "wheel_front" in done.stderr
    trace = store.read_trace(model)
    assert trace.status == "left_terrain"
    assert trace.events[-1].kind == "left_terrain"


def test_usage_errors_are_code_2_and_help_is_0():
    assert solver("run").returncode == 2
    assert solver("dance").returncode == 2
    assert solver("--help").returncode == 0
    assert solver("version").stdout == f"rille-solver {__version__} (schema {store.schema_version()})\n"
