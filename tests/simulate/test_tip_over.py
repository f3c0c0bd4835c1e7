"""The angle to tipping over is that of the machine that drove, effects included."""

import pytest

from effect_rigs import EARTH
from machines import cart, plane
from rille.model import Scenario
from rille.model.study import Change
from rille.simulate.case import CaseRunner

RADIUS = 0.15


def margin(make_model, *settings, ground=True, **numbers):
    """Status and smallest angle [rad] of a cart that stands. numbers : of its parameters, as what is added to them."""
    place = {"terrain": "plane", "placement": "on_terrain", "settle_time": 2.0} if ground else {}
    scenario = Scenario(name="s", duration=0.1, gravity=(0, 0, -EARTH), **place)
    runner = CaseRunner(make_model(cart(5.0, RADIUS, 0.165), scenario, plane() if ground else None), scenario)
    changes = [(Change(kind="parameter", name=f"body.chassis.{name}"), by) for name, by in numbers.items()]
    added = [(change, runner.bounds[change.name][0] + by) for change, by in changes]
    result = runner.run(0, [*settings, *added])
    return result.status, result.outcomes.get("min_stability_angle")


def effect(name, target, number, value):
    return Change(kind="effect", name=name, target=target, number=number), value


def test_effects_that_move_or_add_mass_count_as_the_numbers_themselves_do(make_model):
    """Two descriptions of one machine."""
    base = margin(make_model)[1]
    raised = margin(make_model, effect("com_offset", "chassis", "z", 0.3))[1]
    assert raised < base - 0.1
    assert raised == pytest.approx(margin(make_model, com_z=0.3)[1], abs=1e-4)
    lighter = margin(make_model, effect("mass_change", "chassis", "mass", -5.0))[1]
    assert lighter > base + 0.005
    assert lighter == pytest.approx(margin(make_model, mass=-5.0)[1], abs=1e-4)


def test_a_tilted_gravity_takes_its_tilt_off(make_model):
    """To the nearer side, of a cart that stands level: by the angle itself, but for what its springs of soil give way."""
    base, tilted = margin(make_model)[1], margin(make_model, effect("gravity_tilt", "*", "roll", 0.2))[1]
    assert base - tilted == pytest.approx(0.2, abs=0.01)


def test_a_machine_with_wheels_and_no_ground_has_none(make_model):
    assert margin(make_model, ground=False)[0] == "done"
