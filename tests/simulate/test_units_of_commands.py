"""A command has the unit of what its drive moves: a wheel that turns takes no metres a second."""

import pytest

from rille.model import InputRefused
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


@pytest.mark.parametrize(
    ("unit", "text", "value"),
    [("rad/s", "2 rad/s", 2.0), ("rad/s", "60 deg/s", 1.0471975511965976), ("m/s", "3 cm/s", 0.03), ("rad", "90 deg", 1.5707963267948966)],
)
def test_its_own_unit_is_taken(tmp_path, unit, text, value):
    (tmp_path / "s.toml").write_text(SHEET.format(text))
    (command,) = read_scenario_file(tmp_path / "s.toml", {"wheel": unit}).commands
    assert command.value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("unit", "text"), [("rad/s", "1 m/s"), ("rad/s", "1 Hz"), ("m/s", "1 rad/s"), ("rad", "0.1 m"), ("N m", "5 N")])
def test_another_is_refused(tmp_path, unit, text):
    (tmp_path / "s.toml").write_text(SHEET.format(text))
    with pytest.raises(InputRefused, match=f"the command of drive 'wheel' is \"{text}\""):
        read_scenario_file(tmp_path / "s.toml", {"wheel": unit})
