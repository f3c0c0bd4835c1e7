"""Does the accepted sheet of the tutorial build the low_cost_robot arm, and does it fall? (AlexanderKoch-Koch/low_cost_robot, MIT)"""

from pathlib import Path

import numpy as np
import pytest

from command import rille
from rille import store
from rille.cad import build
from rille.model import Rover


@pytest.fixture(scope="module")
def arm(repository: Path, rille_data: Path) -> Rover:
    if not (rille_data / "data/cad/low_cost_robot_arm.step").is_file():
        pytest.skip("the low_cost_robot arm is absent (data/cad/low_cost_robot_arm.step)")
    return build(repository / "examples/robot_arm/arm.toml")


def test_servos_weigh_what_their_data_sheets_say(arm):
    """57.2 g and 18 g each, to the 0.1 % to which the sheet's densities are rounded; whatever of a servo turns with the next body."""
    mass = {part.name: part.properties.mass for part in arm.parts}
    servos: dict[str, float] = {}
    for instance in arm.instances:
        name = next((piece for piece in instance.path.split("/") if piece.startswith(("XL-430", "XL,XC-330"))), None)
        if name is not None:
            servos[name] = servos.get(name, 0.0) + mass[instance.part]
    assert len(servos) == 6
    for name, weight in servos.items():
        assert weight == pytest.approx(0.0572 if name.startswith("XL-430") else 0.018, rel=1e-3), name


def test_hinges_are_where_the_machine_has_them(arm):
    joints = {joint.name: joint for joint in arm.joints if joint.kind == "hinge"}
    assert list(joints) == ["shoulder_pan", "shoulder_lift", "elbow", "wrist_flex", "wrist_roll", "gripper"]
    apart = np.array(joints["elbow"].point) - joints["shoulder_lift"].point
    np.testing.assert_allclose(apart[1:], [0.0148, 0.1083], atol=1e-5)  # measured in the drawing (SOURCES.md)
    axes = {name: int(np.argmax(np.abs(joint.axis))) for name, joint in joints.items()}
    assert axes == {"shoulder_pan": 2, "shoulder_lift": 0, "elbow": 0, "wrist_flex": 0, "wrist_roll": 2, "gripper": 1}


def test_it_falls_onto_a_stop(arm, repository, tmp_path):
    model = tmp_path / "arm.db"
    store.create(model)
    store.write_rover(model, arm)
    done = rille("run", model, "--scenario", repository / "examples/robot_arm/fall.toml", "--json")
    assert done.returncode == 0, done.stderr
    trace = store.read_trace(model)
    hand = next(body for body in trace.bodies if body.name == "hand")
    assert hand.position[-1, 2] < hand.position[0, 2] - 0.03
    lift = next(joint for joint in trace.joints if joint.name == "shoulder_lift")
    assert lift.position[-1] == pytest.approx(np.radians(-75), abs=0.02)
