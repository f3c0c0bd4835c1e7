"""A machine of a trial, as values: what the base model says of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from rille.model import Effect, Rover, Terrain
from rille.model.rover import Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """A machine.

    kind : of its recordings: ``time``, or ``points`` of a wheel bench. gravity : in W [m/s^2]. step : of the model that diagnosis runs [s].
    duration : of a recording [s]. effects : physics that the model has. targets : sort of target (joint, driven, body, wheel, world,
    terrain) -> names at which something may be concealed. efforts : torque drive -> largest torque of a maneuver [N m]; speed drive ->
    largest speed [rad/s]. speeds : of the carriage of a bench [m/s].
    """

    name: str
    rover: Rover
    gravity: Vector
    step: float = 1e-3
    duration: float = 5.0
    terrain: Terrain | None = None
    effects: tuple[Effect, ...] = ()
    targets: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    efforts: Mapping[str, float] = field(default_factory=dict)
    speeds: tuple[float, ...] = ()
    kind: Literal["time", "points"] = "time"


def near(machine: Subject, target: str) -> list[str]:
    """A joint, body or wheel and its neighbours in the chain of joints: a friction moves bodies on both sides. []: everywhere."""
    found = {target}
    for joint in machine.rover.joints:
        if target in (joint.name, joint.child, joint.parent):
            found |= {joint.name, joint.child, joint.parent or joint.name}
    for gear in machine.rover.gears:
        if found & {gear.joint_a, gear.joint_b}:
            found |= {gear.joint_a, gear.joint_b}
    return sorted(found) if target != "*" else []
