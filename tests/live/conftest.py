"""A live session of a cart on a plane, behind a real server on loopback."""

from dataclasses import replace

import pytest

from effect_rigs import EARTH
from live_server import FASTEST, HOSTILE, Live
from machines import cart, plane
from rille.model import Scenario


@pytest.fixture
def cart_model(make_model):
    """Database with a cart on a plane, a body whose name would be a script, and a first drive that turns at most so fast."""
    rover = cart(5.0, 0.15, 0.165)
    bodies = (replace(rover.bodies[0], name=HOSTILE), *rover.bodies[1:])
    joints = tuple(replace(joint, parent=HOSTILE) for joint in rover.joints)
    drives = (replace(rover.drives[0], max_speed=FASTEST), *rover.drives[1:])
    scenario = Scenario(name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2)
    return make_model(replace(rover, bodies=bodies, joints=joints, drives=drives), scenario, plane(0.02))


@pytest.fixture
def live(cart_model):
    """The session behind its server, without a token."""
    made = Live(cart_model)
    yield made
    made.close()


@pytest.fixture
def guarded(cart_model):
    """The same with a token."""
    made = Live(cart_model, token="correct-horse-battery")
    yield made
    made.close()
