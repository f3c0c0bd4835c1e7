"""A model for the command line."""

import pytest

from machines import cart, plane
from rille import store
from rille.model import Command, Scenario


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
