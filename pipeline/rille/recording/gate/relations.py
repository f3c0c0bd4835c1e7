"""Which channels of a recording tell of the same thing."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from rille.model.recording import ANGLES, Channel
from rille.recording.gate.turning import turnings

DERIVATIVE = {
    "joint.position": "joint.velocity",
    "part.position": "part.linear_velocity",
    "part.linear_velocity": "part.linear_acceleration",
}
TURNING = {"roll": "x", "pitch": "y", "yaw": "z"}  # component of the angular velocity that an angle nearly integrates
EFFORTS = ("joint.effort", "wheel.drive_torque")


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Two channels, by name.

    order : 0: second = first, 1: second = d first/dt. kind : ``same`` quantity measured twice; ``rate``; ``response`` of the machine to a
    command; ``scaled``: proportional by a factor that is not known (current and torque).
    """

    first: str
    second: str
    order: int
    kind: Literal["same", "rate", "response", "scaled"]


def related(channels: Sequence[Channel]) -> tuple[Pair, ...]:
    """All pairs of channels, ``ignore`` left out, of which one tells of the other; ``first`` may be a turning, by its name."""
    used = [channel for channel in channels if channel.role != "ignore"]
    pairs = [pair for one, other in combinations(used, 2) for pair in _pair(one, other)]
    turns = [Pair(first=turning.name, second=rate.name, order=1, kind="rate") for turning, rate in turnings(used)]
    return (*pairs, *turns, *_efforts(used))


def _pair(one: Channel, other: Channel) -> list[Pair]:
    if one.target != other.target or one.role == other.role == "command":
        return []
    if (one.quantity, one.component) == (other.quantity, other.component):
        if one.frame != other.frame:
            return []
        first, second = (other, one) if other.role == "command" else (one, other)
        kind = "response" if first.role == "command" else "same"
        return [Pair(first=first.name, second=second.name, order=0, kind=kind)]
    for first, second in ((one, other), (other, one)):
        if "command" not in (first.role, second.role) and _integrates(first, second):
            return [Pair(first=first.name, second=second.name, order=1, kind="rate")]
    return []


def _integrates(first: Channel, second: Channel) -> bool:
    if DERIVATIVE.get(first.quantity) == second.quantity and first.component == second.component:
        return first.frame == second.frame == "world" or not first.component
    turning = first.quantity == "part.orientation" and second.quantity == "part.angular_velocity"
    return turning and first.component in ANGLES and TURNING[first.component] == second.component


def _efforts(channels: Sequence[Channel]) -> tuple[Pair, ...]:
    currents = [channel for channel in channels if channel.quantity == "motor.current" and channel.role == "observed"]
    efforts = [channel for channel in channels if channel.quantity in EFFORTS and channel.role == "observed"]
    pairs = []
    for current in currents:
        fits = [effort for effort in efforts if _akin(current.target, effort.target)]
        if not fits and len(currents) == len(efforts) == 1:
            fits = efforts
        pairs += [Pair(first=current.name, second=effort.name, order=0, kind="scaled") for effort in fits[:1]]
    return tuple(pairs)


def _akin(drive: str, joint: str) -> bool:
    """Whether a drive's name is that of its joint, save for a word such as "motor"."""
    return drive == joint or drive.startswith(joint) or drive.endswith(joint) or joint.startswith(drive) or joint.endswith(drive)
