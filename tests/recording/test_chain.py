"""The chain as a user walks it: record a simulation in every format, import it, compare it with its own model and with wrong ones."""

import json
from dataclasses import replace

import numpy as np
import pytest

from command import rille
from machines import chain
from rille import store
from rille.model import Command, Drive, Effect, InitialJointState, Scenario

FORMATS = {"csv": "swing.csv", "parquet": "swing.parquet", "mcap": "swing.mcap", "ros1": "swing.bag", "ros2": "swing_bag"}
SENSORS = """
name = "swing"
[noise]
seed = 5
[[clock]]
name = "fast"
rate = "400 Hz"
jitter = "0.4 ms"
gaps = { fraction = 0.03, mean_length = "0.15 s" }
[[sensor]]
name = "angle"
quantity = "joint.position"
target = "hinge*"
clock = "fast"
noise = "0.5 mrad"
[[sensor]]
name = "rate"
quantity = "joint.velocity"
target = "hinge*"
clock = "fast"
noise = "20 mrad/s"
delay = "7 ms"
[[command]]
drive = "*"
"""


def swing(path, effects=()):
    """A driven double pendulum of rods, 6 s; torques change every 0.4 s."""
    machine = chain([0.4, 0.3], [1.0, 0.6])
    drives = tuple(Drive(name=f"motor{k}", joint=f"hinge{k}", mode="torque", max_torque=10.0) for k in (1, 2))
    rng = np.random.default_rng(3)
    times = np.arange(0, 6, 0.4)
    commands = [
        Command(drive=d.name, time=float(t), value=float(v))
        for d in drives
        for t, v in zip(times, rng.normal(0, 0.25, len(times)), strict=True)
    ]
    scenario = Scenario(
        name="swing",
        gravity=(0, 0, -9.81),
        duration=6.0,
        step=5e-4,
        output_interval=0.01,
        initial_states=(InitialJointState(joint="hinge1", position=0.4),),
        commands=tuple(commands),
    )
    store.create(path)
    store.write_rover(path, replace(machine, drives=drives))
    store.write_scenario(path, scenario)
    for effect in effects:
        store.add_effect(path, effect)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Database and recordings in all formats; the manifests hide the delay."""
    place = tmp_path_factory.mktemp("chain")
    swing(place / "swing.db")
    (place / "sensors.toml").write_text(SENSORS)
    return place


def walk(folder, kind, model, *hidden):
    """Record the true model in a format, import it into a model, return what import says and the model's path."""
    done = rille("record", folder / "swing.db", "--sensors", folder / "sensors.toml", "-o", folder / FORMATS[kind], "--force", *hidden)
    assert done.returncode == 0, done.stderr
    manifest = (folder / FORMATS[kind]).with_suffix(".toml")
    done = rille("import", manifest, "-o", model, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def found_by_gate(said):
    """What import found beside notes."""
    return [f for r in said["recordings"] for f in r["findings"] if f["severity"] != "note"]


@pytest.fixture(scope="module")
def own(folder, tmp_path_factory):
    """The true model with its recording, imported from CSV."""
    model = swing(tmp_path_factory.mktemp("own") / "own.db")
    assert not found_by_gate(walk(folder, "csv", model))
    return model


def compared(model, *options):
    """What `rille compare --json` says."""
    done = rille("compare", model, "--json", *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_own_model_leaves_white_noise(own):
    """Irregular samples, gaps, 7 ms delay of the rates. RMS / noise of 2 400 samples has a standard error of 1/sqrt(2 n) = 1.5 %, and a few
    per cent of bias from start states that were fitted to the same samples: 5 %."""
    result = compared(own)
    assert result["differs"] is False
    for channel in result["channels"]:
        assert channel["normalised"] == pytest.approx(1.0, abs=0.05)
        assert channel["verdict"] == "white"
        assert abs(channel["lag_fit"]["delay"]) < 1e-3


@pytest.mark.parametrize("kind", [kind for kind in FORMATS if kind != "csv"])
def test_every_format_carries_the_same_numbers(folder, kind, own, tmp_path):
    """Channels that were imported are those of CSV, times to the nanosecond in which some formats count, and the gate finds nothing."""
    model = swing(tmp_path / "model.db")
    assert not found_by_gate(walk(folder, kind, model))
    found, wanted = (store.read_recording(path, "swing") for path in (model, own))
    assert [c.name for c in found.channels] == [c.name for c in wanted.channels]
    for one, csv in zip(found.channels, wanted.channels, strict=True):
        assert (one.of, one.unit, one.role, one.frame) == (csv.of, csv.unit, csv.role, csv.frame)
        assert (one.noise, one.delay) == (pytest.approx(csv.noise), pytest.approx(csv.delay))
        assert one.time == pytest.approx(csv.time, abs=1e-9)
        assert one.value == pytest.approx(csv.value, rel=1e-9, abs=1e-12)


def test_a_hidden_delay_is_found_by_the_gate(folder, tmp_path):
    """7 ms, to 1 ms, in the channels that have it and in no other."""
    model = swing(tmp_path / "own.db")
    said = walk(folder, "csv", model, "--hide", "delay,noise")
    delays = [f for r in said["recordings"] for f in r["findings"] if f["code"] == "delay"]
    assert sorted(f["channel"] for f in delays) == ["rate_hinge1", "rate_hinge2"]
    for finding in delays:
        assert finding["detail"]["delay"] == pytest.approx(7e-3, abs=1e-3)


def test_missing_friction_shows_at_its_joint(folder, tmp_path):
    """The recorded machine has no friction, the model has 0.02 N m at hinge2: both joints move differently (they are coupled), but most of
    what is beyond the noise is at hinge2."""
    model = swing(tmp_path / "friction.db", [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.02})])
    walk(folder, "csv", model)
    result = compared(model)
    assert result["differs"] is True
    assert result["targets"][0]["name"] == "hinge2"
    assert result["targets"][0]["share"] > 0.7


def test_a_push_shows_in_its_window_and_nowhere_else(folder, tmp_path):
    """A force of 3 N on the lower link from 3.1 s to 3.3 s: the window from 3.0 to 3.5 s differs, the others are white. A window's start is
    smoothed from samples on both sides of it, so that its neighbour may feel the push at 3.1 s; those farther away must not."""
    push = {"start": 3.1, "duration": 0.2, "force_x": 3.0}
    model = swing(tmp_path / "push.db", [Effect(kind="external_pulse", target="link2", parameters=push)])
    walk(folder, "csv", model)
    result = compared(model)
    worst = result["windows"][0]
    assert (worst["start"], worst["stop"]) == pytest.approx((3.0, 3.5), abs=0.01)
    assert all(w["q"] > 0.01 for w in result["windows"] if w["stop"] < 2.9 or w["start"] > 3.6)
