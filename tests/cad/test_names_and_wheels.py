"""Names of parts that look like patterns, and wheels that share a joint."""

import pytest

from rille.cad import build
from rille.cad.entries import is_named
from rille.model import InputRefused


@pytest.mark.parametrize(
    ("name", "pattern", "expected"),
    [("[torus]", "[torus]", True), ("t", "[torus]", True), ("what?", "what?", True), ("arm_left", "arm_*", True), ("arm", "leg", False)],
)
def test_a_name_with_brackets_names_itself(name, pattern, expected):
    assert is_named(name, pattern) is expected


def test_a_joint_carries_one_wheel(rig_sheet):
    wheel = '[[wheel]]\njoint = "left_hinge"\nname = "{}"\nradius = "5 cm"\nwidth = "2 cm"\n'
    with pytest.raises(InputRefused, match="wheel 'b' turns on joint 'left_hinge' like wheel 'a'; a joint carries one wheel"):
        build(rig_sheet(more=wheel.format("a") + wheel.format("b")))
