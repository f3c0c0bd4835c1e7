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

from command import rille
from remembering import TABLES, make_remembering, numbers
from rille import store
from rille.simulate.run import find_solver


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run without interruption."""
    path = make_remembering(tmp_path_factory.mktemp("whole") / "model.db")
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
    path = make_remembering(tmp_path / "model.db")
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
    path = make_remembering(tmp_path / "model.db")
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


def interrupted(path, *options):
    """A run that a signal ended while it was going on, after it had come to rest."""
    process = subprocess.Popen(
        [find_solver(), "run", str(path), "--progress", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    while float((process.stderr.readline().split() or ["", "0"])[1]) <= 0:
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 130
    return json.loads(output)


def test_what_others_are_given_does_not_keep_a_run_from_going_on(tmp_path):
    """Another ground and another scenario: the run depends on neither, and --resume means the scenario that was interrupted."""
    path = make_remembering(tmp_path / "model.db")
    interrupted(path)
    ground, asked = store.read_terrain(path, "plane"), store.read_scenario(path)
    store.write_terrain(path, replace(ground, name="other"))
    store.write_scenario(path, replace(asked, name="other", terrain="other", duration=0.01))
    assert store.resumable_scenarios(path) == (asked.name,)
    done = rille("run", path, "--resume")
    assert done.returncode == 0, done.stderr
    assert store.resumable_scenarios(path) == ()


def test_what_goes_on_takes_as_long_as_was_asked_for(tmp_path):
    """An interrupted run remembers its --duration, here a longer one than the scenario's; another one can be stated, if it is not past."""
    path = make_remembering(tmp_path / "model.db")
    with closing(sqlite3.connect(path)) as connection:
        stated = connection.execute("SELECT duration FROM scenario").fetchone()[0]
    longer = stated + 2.5
    first = interrupted(path, "--duration", str(longer))
    assert f"of {longer:g} s" in first["message"]
    done = subprocess.run([find_solver(), "run", str(path), "--resume"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["time_reached"] == pytest.approx(longer, abs=1e-9)
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT duration FROM run").fetchall() == [(longer,)]

    second = interrupted(path, "--duration", str(longer))
    past = second["time_reached"] / 2
    refused = subprocess.run(
        [find_solver(), "run", str(path), "--resume", "--duration", repr(past)], capture_output=True, text=True, timeout=120
    )
    assert refused.returncode == 3
    assert "state a longer --duration" in refused.stderr
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT status FROM run ORDER BY id").fetchall() == [("done",), ("interrupted",)]
    later = second["time_reached"] + 0.1
    done = subprocess.run(
        [find_solver(), "run", str(path), "--resume", "--duration", repr(later)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["time_reached"] == pytest.approx(later, abs=1e-3)  # of one step
