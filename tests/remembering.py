"""A model with everything that has a memory, and every number of its runs, for tests of what must give the same bytes."""

import sqlite3
from contextlib import closing
from dataclasses import replace

from effect_rigs import EARTH
from machines import cart, plane
from rille import store
from rille.model import Command, Effect, MaterialPair, Obstacle, Pose, Scenario, Sensor, Watch

TABLES = ("body_state", "joint_state", "wheel_state", "joint_reaction", "energy_state", "sensor_sample", "rut_tile", "event")
DURATION = 120.0  # two seconds of computing: long enough to be stopped three times


def make_remembering(path):
    """A cart with everything that has a memory: friction, transmission, lag, slosh, digging, ruts, a rock, sensors with delay and a
    fast clock, a watch."""
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
        Effect(kind="command_delay", target="wheel_front_right", parameters={"delay": 0.0123}),
        Effect(kind="delay", target="encoder", parameters={"delay": 0.05}),
        Effect(kind="clock_skew", target="accelerometer", parameters={"skew": 0.02}),
    )
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, terrain)
    store.write_scenario(path, scenario)
    store.write_effects(path, effects)
    return path


def numbers(path, run_id=1):
    """Every number of a run, by table."""
    with closing(sqlite3.connect(path)) as connection:
        connection.row_factory = sqlite3.Row
        found = {}
        for table in TABLES:
            rows = connection.execute(f"SELECT * FROM {table} WHERE run_id = ?", (run_id,)).fetchall()
            found[table] = sorted(tuple(row[key] for key in row.keys() if key not in ("run_id", "id")) for row in rows)  # noqa: SIM118
        return found
