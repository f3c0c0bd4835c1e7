"""Speeds and angles that turn a rover: the rigid motion of a plane body."""

import math

import pytest

from machines import cart
from rille.live import DrivenWheel, driven_wheels, set_values

R = 0.15


def six_wheels():
    """Six wheels, the four of the corners steered."""
    wheels = []
    for row, x in (("front", 0.6), ("middle", 0.0), ("rear", -0.6)):
        for side, y in (("left", 0.5), ("right", -0.5)):
            name = f"{row}_{side}"
            steering = None if row == "middle" else f"steer_{name}"
            wheels.append(DrivenWheel(drive=name, x=x, y=y, radius=R, sign=1, fastest=3.0, steering=steering))
    return wheels


@pytest.mark.parametrize(("forward", "turn"), [(0.2, 0.0), (0.2, 0.1), (0.1, -0.15), (-0.2, 0.1), (0.0, 0.2)])
def test_every_wheel_rolls_where_the_rigid_motion_takes_it(forward, turn):
    """Steered wheels do not slide: their velocity u = (v - w y, w x) lies along their heading, and r times the rate is its length."""
    values = set_values(six_wheels(), forward, turn)
    for wheel in six_wheels():
        u = (forward - turn * wheel.y, turn * wheel.x)
        angle = values.get(wheel.steering, 0.0)
        rolled = (R * values[wheel.drive] * math.cos(angle), R * values[wheel.drive] * math.sin(angle))
        assert rolled == pytest.approx(u, abs=1e-12), wheel


def test_what_is_too_fast_is_scaled_down_for_all_alike():
    values = set_values(six_wheels(), 10.0, 3.0)
    slow = set_values(six_wheels(), 1e-3, 3e-4)
    assert max(abs(values[w.drive]) for w in six_wheels()) == pytest.approx(3.0, abs=1e-12)
    ratios = [values[w.drive] / slow[w.drive] for w in six_wheels()]
    assert ratios == pytest.approx([ratios[0]] * 6, rel=1e-9)


def test_wheels_without_steering_skid():
    wheels = driven_wheels(cart(5.0, R, 0.165))
    assert {w.steering for w in wheels} == {None}
    values = set_values(wheels, 0.3, 0.5)
    assert values["wheel_front_left"] == pytest.approx((0.3 - 0.5 * 0.4) / R, abs=1e-12)
    assert values["wheel_rear_right"] == pytest.approx((0.3 + 0.5 * 0.4) / R, abs=1e-12)


def test_the_limits_of_steering_are_kept_and_an_axle_may_point_to_the_right():
    wheel = DrivenWheel(drive="d", x=0.6, y=0.0, radius=R, sign=-1, fastest=math.inf, steering="s", steering_sign=-1, limits=(-0.3, 0.3))
    other = DrivenWheel(drive="e", x=-0.6, y=0.0, radius=R, sign=1, fastest=math.inf)
    values = set_values([wheel, other], 0.1, 0.2)
    assert values["s"] == -0.3  # to the left is negative here
    assert values["d"] < 0 < values["e"]


def test_a_machine_without_driven_wheels_is_not_steered():
    assert set_values((), 1.0, 0.0) == {}
