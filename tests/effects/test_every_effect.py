"""What every effect owes: at zero amplitude every bit stays; at its usual size something changes; a small one changes little."""

import sqlite3
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Model, Simulation

from effect_rigs import EARTH
from machines import cart, plane
from rille import store
from rille.model import Command, Effect, Grouser, Scenario, Sensor
from rille.simulate import run

TABLES = ("body_state", "joint_state", "wheel_state", "sensor_sample", "joint_reaction", "energy_state")

# Where the usual value of a parameter would not be met on this short drive, one that is.
VALUES = {
    "soil_change": {"stiffness_change": -0.5, "radius": 50.0},
    "tether_pull": {"stiffness": 100.0, "length": 0.1, "anchor_x": -2.0},
    "joint_pulse": {"torque": 1.0, "start": 0.5, "duration": 0.2},
    "external_pulse": {"force_y": 10.0, "start": 0.5, "duration": 0.2},
    "expression": {
        "gain": 1.0,
        "formula": "-k*velocity",
        "output": "joint.effort",
        "target_kind": "joint",
        "constants": {"k": [0.1, "N m s/rad"]},
    },
    "motor_saturation": {"inverse_no_load_speed": 0.9},
    "command_delay": {"delay": 0.05},
    "saturation": {"inverse_range": 500.0},
    "clock_skew": {"skew": 0.01},
    "dropout": {"fraction": 0.3},
    "payload_slosh": {"mass": 0.5},
}


def values(kind, scale=1.0):
    """Usual amplitudes (times scale) and the parameters that belong to them."""
    given = VALUES.get(kind.name, {p.name: p.typical for p in kind.parameters if p.amplitude and p.typical != 0})
    amplitudes = {p.name for p in kind.parameters if p.amplitude}
    return {k: (v * scale if k in amplitudes else v) for k, v in given.items()}


def model(path, *effects):
    """A cart with grousers and a sensor that drives for 1 s up a gentle slope and turns its left wheels faster; those have a soft servo."""
    rover = cart(5.0, 0.15, 0.165)
    wheels = tuple(replace(w, grouser=Grouser(count=24, height=0.01, thickness=0.002)) for w in rover.wheels)
    sensors = (Sensor(name="gyro", quantity="part.angular_velocity", target="chassis", rate=50.0),)
    drives = tuple(replace(d, speed_gain=20.0, integral_gain=5.0) if "left" in d.name else d for d in rover.drives)
    rover = replace(rover, wheels=wheels, sensors=sensors, drives=drives)
    commands = tuple(Command(drive=d.name, time=0.1, value=1.2 if "left" in d.name else 0.8) for d in rover.drives)
    scenario = Scenario(
        name="s",
        duration=1.2,
        gravity=(0, 0, -EARTH),
        terrain="plane",
        placement="on_terrain",
        settle_time=2,
        commands=commands,
        output_interval=0.05,
    )
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, plane(0.1))
    store.write_scenario(path, scenario)
    store.write_effects(path, effects)
    return path


def tables(path):
    """Every number of a run, as bytes."""
    result = run(path)
    assert result.status == "done", result.message
    with closing(sqlite3.connect(path)) as connection:
        return {t: connection.execute(f"SELECT * FROM {t} ORDER BY 1, 2, 3").fetchall() for t in TABLES}


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """The same drive without effects."""
    return tables(model(tmp_path_factory.mktemp("base") / "model.db"))


@pytest.mark.parametrize("kind", store.effect_kinds(), ids=lambda kind: kind.name)
def test_zero_leaves_every_bit(tmp_path, base, kind):
    assert tables(model(tmp_path / "model.db", Effect(kind=kind.name, parameters=values(kind, 0.0)))) == base


@pytest.mark.parametrize("kind", store.effect_kinds(), ids=lambda kind: kind.name)
def test_zero_in_memory_leaves_every_bit(tmp_path, kind):
    """An amplitude that is taken back where the model is, as a fit does, is none."""

    def drive(*effects):
        path = model(tmp_path / f"{len(effects)}.db", *effects)
        solver = Model(str(path))
        for name in solver.parameters():
            if name.startswith(f"effect.{kind.name}.") and name.rpartition(".")[2] in amplitudes:
                solver.set(name, 0.0)
        simulation = Simulation(solver)
        assert simulation.settle() == "running"
        return simulation.sample(300, 10, [("part.position", "chassis", 0), ("joint.effort", "wheel_rear_left", 0)])

    amplitudes = {p.name for p in kind.parameters if p.amplitude}
    assert np.array_equal(drive(), drive(Effect(kind=kind.name, parameters=values(kind))))


@pytest.mark.parametrize("kind", store.effect_kinds(), ids=lambda kind: kind.name)
def test_the_usual_size_changes_something_and_a_small_one_little(tmp_path, base, kind):
    """At 1e-6 of the usual size the pose of the chassis may change by 1e-4 m at most, and joints by 1e-4 rad: nothing jumps when an effect
    begins.
    """
    changed = tables(model(tmp_path / "model.db", Effect(kind=kind.name, parameters=values(kind))))
    assert changed != base
    small = tables(model(tmp_path / "small.db", Effect(kind=kind.name, parameters=values(kind, 1e-6))))
    for table, columns in (("body_state", slice(3, 6)), ("joint_state", slice(3, 4))):
        difference = np.array([row[columns] for row in small[table]]) - np.array([row[columns] for row in base[table]])
        assert np.abs(difference).max() < 1e-4
