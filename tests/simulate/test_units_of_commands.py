"""Commands and states have the unit of what they move: a wheel that turns takes no metres a second, a hinge does not stand at a length."""

from dataclasses import replace

import pytest

from machines import chain
from rille.model import Drive, InputRefused
from rille.simulate import read_scenario_file

SHEET = """name = "spin"
duration = "1 s"
gravity = "moon"
step = "1 ms"

[[command]]
drives = ["*"]
time = "0 s"
value = "{}"
"""
STATE = """name = "spin"
duration = "1 s"
gravity = "moon"

[[initial_state]]
joint = "{}"
{} = "{}"
"""


def driven(mode, kind):
    """A rod at the world, on a joint that a drive moves."""
    rover = chain([1.0], [1.0])
    return replace(
        rover, joints=(replace(rover.joints[0], kind=kind),), drives=(Drive(name="wheel", joint="hinge1", mode=mode, max_torque=1.0),)
    )


@pytest.mark.parametrize(
    ("mode", "kind", "text", "value"),
    [
        ("speed", "hinge", "2 rad/s", 2.0),
        ("speed", "hinge", "60 deg/s", 1.0471975511965976),
        ("speed", "prismatic", "3 cm/s", 0.03),
        ("position", "hinge", "90 deg", 1.5707963267948966),
    ],
)
def test_its_own_unit_is_taken(tmp_path, mode, kind, text, value):
    (tmp_path / "s.toml").write_text(SHEET.format(text))
    (command,) = read_scenario_file(tmp_path / "s.toml", driven(mode, kind)).commands
    assert command.value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("mode", "kind", "text"),
    [
        ("speed", "hinge", "1 m/s"),
        ("speed", "hinge", "1 Hz"),
        ("speed", "prismatic", "1 rad/s"),
        ("position", "hinge", "0.1 m"),
        ("torque", "hinge", "5 N"),
    ],
)
def test_another_is_refused(tmp_path, mode, kind, text):
    (tmp_path / "s.toml").write_text(SHEET.format(text))
    with pytest.raises(InputRefused, match=f"the command of drive 'wheel' is \"{text}\""):
        read_scenario_file(tmp_path / "s.toml", driven(mode, kind))


@pytest.mark.parametrize(
    ("kind", "key", "text", "value"),
    [("hinge", "position", "180 deg", 3.141592653589793), ("hinge", "velocity", "2 rad/s", 2.0), ("prismatic", "velocity", "5 cm/s", 0.05)],
)
def test_a_joint_starts_in_its_own_unit(tmp_path, kind, key, text, value):
    (tmp_path / "s.toml").write_text(STATE.format("hinge1", key, text))
    (state,) = read_scenario_file(tmp_path / "s.toml", driven("speed", kind)).initial_states
    assert getattr(state, key) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("joint", "key", "text", "words"),
    [
        ("hinge1", "position", "1 cm", "position of joint 'hinge1' is \"1 cm\""),
        ("hinge1", "velocity", "1 m/s", "velocity of joint 'hinge1' is \"1 m/s\""),
        ("hing1", "position", "1 deg", "initial_state of scenario 'spin' names the joint 'hing1'"),
    ],
)
def test_it_does_not_start_in_another_nor_elsewhere(tmp_path, joint, key, text, words):
    (tmp_path / "s.toml").write_text(STATE.format(joint, key, text))
    with pytest.raises(InputRefused, match=words):
        read_scenario_file(tmp_path / "s.toml", driven("speed", "hinge"))
