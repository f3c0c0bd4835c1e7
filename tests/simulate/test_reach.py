"""Is a command that no drive can follow said, and only such a one?"""

from dataclasses import replace

import pytest

from machines import cart
from rille.model import Command, JointLimit, Scenario
from rille.simulate import beyond_reach

NAME = "wheel_front_left"


def machine(**changes):
    """A cart whose first drive is another one; its joint turns by at most 0.5 rad."""
    rover = cart(5.0, 0.15, 0.165)
    joints = (replace(rover.joints[0], limit=JointLimit(lower=-0.5, upper=0.4)), *rover.joints[1:])
    return replace(rover, joints=joints, drives=(replace(rover.drives[0], **changes), *rover.drives[1:]))


def scenario(*values):
    commands = tuple(Command(drive=NAME, time=float(k), value=value) for k, value in enumerate(values))
    return Scenario(
        name="s", gravity=(0, 0, -9.81), duration=5.0, step=0.001, output_interval=0.01, placement="as_given", commands=commands
    )


@pytest.mark.parametrize(
    ("changes", "within", "beyond", "words"),
    [
        ({"mode": "speed", "max_speed": 3.0}, (3.0, -3.0), -3.1, "-3.1 rad/s at 2 s, beyond its max_speed, -3 rad/s"),
        ({"mode": "speed"}, (1e3, -1e3), None, ""),
        ({"mode": "torque", "max_torque": 2.0}, (2.0, -2.0), 2.5, "2.5 N m at 2 s, beyond its max_torque, 2 N m"),
        ({"mode": "position"}, (0.4, -0.5), 0.5, f"0.5 rad at 2 s, beyond the range of joint '{NAME}', 0.4 rad"),
    ],
    ids=["speed", "speed without bound", "torque", "position"],
)
def test_only_what_is_beyond_is_said(changes, within, beyond, words):
    rover = machine(**changes)
    assert beyond_reach(rover, scenario(*within)) == ()
    if beyond is not None:
        (sentence,) = beyond_reach(rover, scenario(*within, beyond, 2 * beyond))
        assert f"drive '{NAME}' is commanded {words}" in sentence
