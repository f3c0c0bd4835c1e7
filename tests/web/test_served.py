"""The page of a real session: it is loaded, the rover is dragged over the ground, driven with keys, and seen to move."""

import numpy as np
import pytest

from browser import until
from effect_rigs import EARTH
from live_server import HOSTILE, Live
from machines import cart, plane
from rille import store
from rille.live.server import Show
from rille.model import Scenario
from rille.view import scene3d

TOKEN = "correct-horse-battery"


@pytest.fixture
def model(make_model):
    """A cart on a plane."""
    scenario = Scenario(name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2)
    return make_model(cart(5.0, 0.15, 0.165), scenario, plane(0.02))


def served(path, token=None):
    rover, terrain = store.read_rover(path), store.read_terrain(path, "plane")
    view = scene3d.view_of(terrain, np.zeros((1, 3)), 6.0)
    show = Show(page=scene3d.live_page(), scene=scene3d.scene_glb(rover, terrain, view), layout=scene3d.layout(rover, view, title=HOSTILE))
    return Live(path, token=token, show=show)


def press(tab, name):
    tab.page.get_by_role("button", name=name, exact=True).first.click()


def test_a_rover_is_dragged_driven_with_keys_and_seen_to_move(model, tab):
    live = served(model)
    page = tab.page
    try:
        page.goto(live.address)
        page.evaluate("rille.ready")
        until(lambda: live.session.status().state == "ready", "a session that is ready")
        press(tab, "Take the command")
        until(lambda: page.locator("#who").inner_text() == "you command", "that we command")  # the server knows it first
        before = page.evaluate("rille.pose('chassis')")
        x, y = page.evaluate("rille.onScreen('chassis')")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 80, y + 10, steps=4)
        page.mouse.up()
        far = 0.1  # [m]
        where = until(
            lambda: np.hypot(*np.subtract(p := page.evaluate("rille.pose('chassis')"), before)[:2]) > far and p, "a rover elsewhere", 20
        )
        press(tab, "Start")
        page.keyboard.down("w")
        until(lambda: np.hypot(*(np.subtract(page.evaluate("rille.pose('chassis')"), where)[:2])) > 0.1, "a rover that moves", 20)
        page.keyboard.up("w")
        press(tab, "Pause")
        until(lambda: live.session.status().state == "paused", "a pause")
        assert tab.complaints == []
        assert tab.schemes <= {"http", "ws", "blob", "data"}
    finally:
        live.close()
    steered = store.read_scenario(model, live.session.status().scenario)
    assert np.hypot(*steered.start.position[:2]) > 0.1
    commands = steered.commands
    assert max(command.value for command in commands) > 0
    last = {command.drive: command.value for command in commands}
    assert set(last.values()) == {0.0}  # keys up: stand


def test_the_page_shows_its_token_and_says_when_it_is_wrong(model, tab):
    live = served(model, TOKEN)
    try:
        tab.page.goto(f"{live.address}/#token={TOKEN}")
        tab.page.evaluate("rille.ready")
        assert tab.page.evaluate("rille.pose('chassis')") is not None
        tab.page.goto("about:blank")
        tab.page.goto(f"{live.address}/#token=wrong")
        until(lambda: "token" in tab.page.inner_text("body").lower(), "a sentence about the token")
        assert "wheel front left" not in tab.page.inner_text("body")
    finally:
        live.close()
