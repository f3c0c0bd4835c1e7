"""``rille compare``: a recorded simulation against its own model is noise; a known difference shows where it was made."""

import csv
import json
import signal
import subprocess
import time
from dataclasses import replace

import numpy as np
import pytest

from command import RILLE, assert_refused, rille
from machines import chain
from recorded import commanded, record
from rille import store
from rille.cli.compare import compare
from rille.model import Command, Drive, Effect, InitialJointState, InputRefused, Scenario
from rille.model.recording import Channel

DURATION, PULSE = 4.0, (2.6, 2.9)  # [s]
SENSORS = tuple(
    Channel(name=f"{word}{k}", quantity=f"joint.{quantity}", target=f"hinge{k}", unit=unit, noise=noise, delay=0.007)
    for k in (1, 2)
    for word, quantity, unit, noise in (("angle", "position", "rad", 1e-3), ("rate", "velocity", "rad/s", 0.02))
)


def scenario(pulse=0.0):
    """Two slow waves of torque, and a pulse [N m] on the second hinge that nobody logged."""
    time = np.arange(0, DURATION, 0.01)
    commands = []
    for hinge, size, rate in (("hinge1", 0.5, 3.0), ("hinge2", 0.15, 5.0)):
        for t in time:
            extra = pulse if hinge == "hinge2" and PULSE[0] <= t < PULSE[1] else 0.0
            commands.append(Command(drive=hinge, time=float(t), value=float(size * np.sin(rate * t) + extra)))
    start = (InitialJointState(joint="hinge1", position=0.3), InitialJointState(joint="hinge2", position=-0.2))
    return Scenario(name="swing", duration=DURATION, commands=tuple(commands), initial_states=start)


def rover():
    drives = tuple(Drive(name=f"hinge{k}", joint=f"hinge{k}", mode="torque", max_torque=10.0) for k in (1, 2))
    return replace(chain([0.2, 0.3], [0.6, 0.5]), drives=drives)


def measured(path, pulse=0.0, seed=1):
    """Recording of the model at ``path`` with irregular sampling, a gap and a delay of 7 ms; commands as logged."""
    return commanded(record(path, SENSORS, duration=DURATION, rate=200, seed=seed, jitter=5e-4, gaps=[(1.4, 1.7)]), scenario(pulse))


@pytest.fixture
def plain(make_model):
    return make_model(rover(), scenario())


def compared(path, *arguments):
    done = rille("compare", path, *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_its_own_recording_is_noise(plain):
    for seed in (1, 2):
        store.write_recording(plain, replace(measured(plain, seed=seed), name=f"run/{seed}"))
    data = compared(plain, "run/*")
    assert data["differs"] is False, data["sentence"]
    assert data["recordings"] == ["run/1", "run/2"]
    assert [channel["verdict"] for channel in data["channels"]] == ["white"] * 4
    # 6000 residuals: their mean square scatters by sqrt(2 / n) = 1.8 %; three times that, and 1 % for what interpolation adds
    assert data["chi2_per_degree"] == pytest.approx(1, abs=0.065)
    assert all(window["ended"] == "" for window in data["windows"])


def test_an_unlogged_push_shows_in_its_window_and_joint(plain, make_model):
    pushed = make_model(rover(), scenario(pulse=0.1))
    recording = commanded(record(pushed, SENSORS, duration=DURATION, rate=200, seed=3), scenario())
    store.write_recording(plain, recording)
    data = compared(plain)
    assert data["differs"] is True
    worst = data["windows"][0]
    pushed_in = [window["number"] for window in data["windows"] if window["start"] < PULSE[1] and window["stop"] > PULSE[0]]
    assert worst["number"] in pushed_in
    assert {window["number"] for window in data["windows"] if window["differs"]} <= set(pushed_in)
    assert data["targets"][0]["name"] == worst["target"] == "hinge2"


def test_friction_that_the_model_lacks_shows_in_its_joint(plain, make_model):
    rubbing = make_model(rover(), scenario(), effects=[Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.02})])
    store.write_recording(plain, measured(rubbing))
    data = compared(plain)
    assert data["differs"] is True
    assert data["targets"][0]["name"] == "hinge2"
    assert any(row["differs"] and row["regime"] == "joint_speed/hinge2" for row in data["regimes"])


def test_table_csv_report_and_text(plain, tmp_path):
    store.write_recording(plain, measured(plain))
    page, table = tmp_path / "report.html", tmp_path / "table.csv"
    done = rille("compare", plain, "run", "--window", "300 ms", "-o", page, "--csv", table)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("nothing is missing")
    assert "angle1" in done.stdout
    assert "wrote" in done.stderr
    rows = list(csv.DictReader(table.open()))
    assert [row["channel"] for row in rows] == ["angle1", "rate1", "angle2", "rate2"]
    assert page.read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")


def test_whole_follows_the_recording_from_one_start(plain):
    store.write_recording(plain, measured(plain))
    data = compared(plain, "--whole")
    assert data["mode"] == "whole"
    assert len(data["windows"]) == 1
    assert data["chi2_per_degree"] == pytest.approx(1, abs=0.2)  # four seconds of a double pendulum make much of little


def test_refusals(plain, tmp_path):
    assert_refused(rille("compare", plain), "holds no recording", "rille import")
    store.write_recording(plain, measured(plain))
    for words, options in (
        ("no recording 'ran'.*'run'", {"recording": ["ran"]}),
        ("no scenario 'swim'.*'swing'", {"scenario": "swim"}),
        ("--window is 0 s", {"window": "0 s"}),
        ("--window.*time", {"window": "5 m"}),
        ("choose one", {"whole": True, "inverse": True}),
        ("there is no folder", {"report": tmp_path / "no" / "report.html"}),
        ("it is a folder", {"csv": tmp_path}),
        ("-o report.html", {"figure": tmp_path / "points.png"}),
    ):
        with pytest.raises(InputRefused, match=words):
            compare(plain, **({"window": "0.5 s"} | options))


def test_a_recording_of_another_machine_is_refused(plain):
    recording = measured(plain)
    strange = tuple(replace(channel, target=channel.target.replace("hinge2", "hinge22")) for channel in recording.channels)
    store.write_recording(plain, replace(recording, channels=strange))
    assert_refused(rille("compare", plain), "hinge22", "'hinge2'")


def test_ctrl_c_ends_at_once_with_130(plain):
    recording = measured(plain)
    with store.held_open(plain):
        for k in range(60):
            store.write_recording(plain, replace(recording, name=f"run/{k}"))
    with subprocess.Popen([RILLE, "compare", str(plain)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        time.sleep(4)  # by then it replays: imports take one second, sixty recordings half a minute
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=60)
    assert child.returncode == 130, err
    assert out == ""
    assert "Traceback" not in err


def test_inverse_dynamics_needs_the_efforts_that_were_commanded(plain):
    store.write_recording(plain, measured(plain))
    data = compared(plain, "--inverse")
    assert data["mode"] == "inverse_dynamics"
    assert {channel["quantity"] for channel in data["channels"]} == {"joint.effort"}
