"""Models for the command line."""

from dataclasses import replace

import pytest

from cli.test_compare import SENSORS, rover, scenario
from machines import cart, plane
from recorded import commanded, record
from rille import store
from rille.model import Command, Effect, Scenario

FRICTION, MASS = 0.06, 0.45  # [N m], [kg] of the true pendulum; its model has none and 0.5


@pytest.fixture
def model(tmp_path):
    """Database with a cart that can drive for two seconds."""
    path = tmp_path / "model.db"
    rover = cart(5.0, 0.15, 0.165)
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, plane())
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(name="go", duration=2, terrain="plane", placement="on_terrain", settle_time=2.0, commands=commands)
    store.write_scenario(path, scenario)
    return path


@pytest.fixture
def pendulum(make_model):
    """Database of a frictionless model, with a recording of a machine that has dry friction and a lighter lower link."""
    friction = Effect(kind="coulomb_friction", target="hinge1", parameters={"torque": FRICTION})
    base = make_model(rover(), scenario())
    lighter = rover()
    link = lighter.bodies[1]
    lighter = replace(lighter, bodies=(lighter.bodies[0], replace(link, properties=replace(link.properties, mass=MASS))))
    true = make_model(lighter, scenario(), effects=[friction])
    store.write_recording(base, commanded(record(true, SENSORS, duration=4.0, rate=200, seed=3), scenario()))
    return base
