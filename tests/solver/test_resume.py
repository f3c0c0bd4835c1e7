"""Checkpoint, interrupt, kill, resume: the resumed run equals the one that was never interrupted, bit by bit."""

import json
import os
import signal
import sqlite3
import subprocess
import time
from contextlib import closing
from dataclasses import replace

import pytest

from effect_rigs import EARTH
from machines import cart, plane
from rille import store
from rille.model import Command, Effect, MaterialPair, Obstacle, Pose, Scenario, Sensor, Watch
from rille.simulate.run import find_solver

TABLES = ("body_state", "joint_state", "wheel_state", "joint_reaction", "energy_state", "sensor_sample", "rut_tile", "event")
DURATION = 120.0  # two seconds of computing: long enough to be stopped three times


def make(path):
    """A cart with everything that has a memory: friction, transmission, lag, slosh, digging, ruts, a rock, sensors with delay, a watch."""
    rover = cart(5.0, 0.15, 0.165)
    sensors = (
        Sensor(name="accelerometer", quantity="part.linear_acceleration", target="chassis", rate=37.0, frame="body"),
        Sensor(name="encoder", quantity="joint.position", target="wheel_front_left", rate=50.0),
    )
    drives = tuple(replace(d, speed_gain=40.0, integral_gain=80.0) if "rear" in d.name else d for d in rover.drives)
    rover = replace(rover, sensors=sensors, drives=drives)
    commands = tuple(
        Command(drive=d.name, time=t, value=v) for d in drives for t, v in ((0.0, 0.8), (7.0, -0.5), (12.0, 1.1), (30.0, -0.6), (70.0, 0.3))
    )
    watch = Watch(name="far", quantity="part.position", target="chassis", above=0.6, action="command", drive="wheel_rear_left", value=0.9)
    scenario = Scenario(
        name="s",
        duration=DURATION,
        gravity=(0, 0, -EARTH),
        terrain="plane",
        placement="on_terrain",
        settle_time=2,
        commands=commands,
        watches=(watch,),
        start=Pose(position=(0.0, 0.0, 0.0)),
    )
    stone = Obstacle(name="stone", kind="sphere", pose=Pose(position=(1.1, 0.4, -0.05)), size=(0.1,))
    terrain = plane(0.05, 0.03)
    terrain = replace(terrain, obstacles=(stone,), pairs=(*terrain.pairs, MaterialPair(response="rigid", friction=0.7)))
    effects = (
        Effect(kind="sinkage_transient", parameters={"depth": 0.01}),
        Effect(kind="multipass", parameters={"memory": 1.0}),
        Effect(kind="payload_slosh", target="chassis", parameters={"mass": 2.0}),
        Effect(kind="motor_lag", parameters={"time_constant": 0.2}),
        Effect(kind="joint_elasticity", target="wheel_front_left", parameters={"compliance": 1e-3}),
        Effect(kind="coulomb_friction", parameters={"torque": 0.2}),
        Effect(kind="delay", target="encoder", parameters={"delay": 0.05}),
    )
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, terrain)
    store.write_scenario(path, scenario)
    store.write_effects(path, effects)
    return path


def numbers(path):
    """Every number of the only run."""
    with closing(sqlite3.connect(path)) as connection:
        columns = {"event": "time, kind, subject, message"}
        return {t: connection.execute(f"SELECT {columns.get(t, '*')} FROM {t} ORDER BY 1, 2, 3, 4").fetchall() for t in TABLES}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run without interruption."""
    path = make(tmp_path_factory.mktemp("whole") / "model.db")
    done = subprocess.run([find_solver(), "run", str(path)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return numbers(path)


def stop_and_go(path, stop):
    """Interrupt with a signal as often as it takes, resuming each time."""
    command = [find_solver(), "run", str(path), "--checkpoint", "0.1"]
    for attempt in range(40):
        process = subprocess.Popen(
            [*command, *(["--resume"] if attempt else [])], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        if attempt < 3:
            time.sleep(0.35)
            os.kill(process.pid, stop)
        output, talk = process.communicate(timeout=120)
        if process.returncode == 0:
            return attempt, json.loads(output)
        assert process.returncode in (130, -stop), talk
    raise AssertionError("never ended")


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGKILL], ids=["ctrl-c", "kill -9"])
def test_resumed_equals_uninterrupted(tmp_path, whole, stop):
    path = make(tmp_path / "model.db")
    stops, result = stop_and_go(path, stop)
    assert stops == 3
    assert result["status"] == "done"
    got = numbers(path)
    for table in TABLES:
        assert len(got[table]) == len(whole[table]), table
        assert got[table] == whole[table], table
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT count(*) FROM run").fetchone()[0] == 1
        assert connection.execute("SELECT count(*) FROM checkpoint").fetchone()[0] == 0  # a run that is done needs none
    assert store.check(path) == []


def test_what_cannot_be_resumed_is_refused(tmp_path):
    path = make(tmp_path / "model.db")
    done = subprocess.run([find_solver(), "run", str(path), "--resume"], capture_output=True, text=True)
    assert done.returncode == 3
    assert "no run that was interrupted" in done.stderr
    process = subprocess.Popen([find_solver(), "run", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(0.4)
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert process.returncode == 130
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE soil SET cohesion = 171")
    done = subprocess.run([find_solver(), "run", str(path), "--resume"], capture_output=True, text=True)
    assert done.returncode == 3
    assert "model changed" in done.stderr
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE soil SET cohesion = 170")
        connection.execute("UPDATE checkpoint SET data = substr(data, 1, 5000)")
    done = subprocess.run([find_solver(), "run", str(path), "--resume"], capture_output=True, text=True)
    assert done.returncode == 3
    assert "checkpoint" in done.stderr
