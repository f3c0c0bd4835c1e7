"""Is what a run does not do said, and only that?"""

from dataclasses import replace

import pytest

from machines import cart, chain
from rille.model import Command, InitialJointState, JointLimit, Pose, Scenario, StateChange
from rille.simulate import unheeded

NAME = "wheel_front_left"
HELD = chain([1.0], [1.0])


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
    assert unheeded(rover, scenario(*within)) == ()
    if beyond is not None:
        (sentence,) = unheeded(rover, scenario(*within, beyond, 2 * beyond))
        assert f"drive '{NAME}' is commanded {words}" in sentence


def test_what_comes_after_the_end():
    rover, asked = machine(), scenario(0.0)
    late = tuple(Command(drive=NAME, time=time, value=0.0) for time in (5.0, 7.0, 6.0))
    change = StateChange(time=9.0, quantity="joint.velocity", target=NAME, values=(1.0,))
    assert unheeded(rover, replace(asked, commands=late[:1])) == ()
    commanded, changed = unheeded(rover, replace(asked, commands=late, changes=(change,)))
    assert commanded.startswith(f"2 commands come after the end of scenario 's' at 5 s, the first of drive '{NAME}' at 6 s")
    assert changed.startswith(f"1 change comes after the end of scenario 's' at 5 s, the first of '{NAME}' at 9 s")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"start_velocity": (0.1, 0.0, 0.0)}, None),  # in free space it has it
        (
            {"start_velocity": (0.1, 0.0, 0.0), "settle_time": 1.0},
            "the velocity of the start of scenario 's' is lost, as the model comes to rest",
        ),
        (
            {"start_angular_velocity": (0.0, 0.0, 1.0), "placement": "on_terrain", "terrain": "plane"},
            "the velocity of the start of scenario 's' is lost, as the model is set down on its terrain",
        ),
        ({"initial_states": (InitialJointState(joint=NAME, velocity=2.0),)}, None),
        (
            {"initial_states": (InitialJointState(joint=NAME, velocity=2.0),), "settle_time": 1.0},
            f"the velocity of joint '{NAME}' in [[initial_state]] is lost",
        ),
    ],
)
def test_velocities_that_are_gone_when_it_begins(changes, words):
    found = unheeded(machine(), replace(scenario(), **changes))
    assert len(found) == (words is not None)
    assert all(words in sentence and "[[state_change]] at time 0" in sentence for sentence in found)


def test_times_that_are_no_whole_number_of_steps():
    assert unheeded(machine(), replace(scenario(), duration=0.3, step=0.1, output_interval=0.1)) == ()  # 0.3 / 0.1 is 2.9999999999999996
    ends, stored = unheeded(machine(), replace(scenario(), duration=0.1, step=0.03, output_interval=0.04))
    assert ends == "duration is 0.1 s, no whole number of steps of 0.03 s; the run ends at 0.09 s"
    for impossible in ({"step": 0.0}, {"step": -1.0}, {"step": float("nan")}, {"duration": float("inf")}, {"duration": 0.0}):
        assert unheeded(machine(), replace(scenario(), **impossible)) == ()  # the solver refuses these
    assert stored == "output_interval is 0.04 s, no whole number of steps of 0.03 s; states are stored every 0.03 s"


@pytest.mark.parametrize(
    "start", [{"start": Pose(position=(1.0, 0.0, 0.0))}, {"start_velocity": (0.1, 0.0, 0.0)}, {"start_angular_velocity": (0.0, 0.0, 1.0)}]
)
def test_the_start_of_what_the_world_holds(start):
    asked = replace(scenario(), **start)
    assert unheeded(cart(5.0, 0.15, 0.165), asked) == ()
    (sentence,) = unheeded(HELD, asked)
    assert f"hangs '{HELD.joints[0].child}' on the world" in sentence
    assert unheeded(HELD, scenario()) == ()
