"""Speeds of wheels and angles of steering that give a rover a forward speed and a turn rate.

Every wheel rolls where the rigid motion takes it: u = (v - w y, w x) at a wheel that stands at (x, y) from the point that moves straight
ahead. A wheel that can be steered points along u and rolls with |u|; one that cannot rolls with u_x, and slides sideways by u_y.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rille.model import InputRefused, Joint, Rover

UPRIGHT = 0.9  # cosine of a steering axis with the vertical, at least
SHY = 0.02  # [rad] that steering stays away from its stops
LEVEL = 0.9  # of a wheel's axle with the horizontal plane, at least


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenWheel:
    """A wheel that a drive turns. x, y : of its centre in M [m]. sign : +1 if a positive rate rolls forward. fastest : [rad/s].

    steering : drive that steers it, or none; steering_sign : +1 if a positive position turns it left; leftmost, rightmost : [rad].
    """

    drive: str
    x: float
    y: float
    radius: float
    sign: float
    fastest: float
    steering: str | None = None
    steering_sign: float = 1.0
    limits: tuple[float, float] = (-math.inf, math.inf)


def driven_wheels(rover: Rover) -> tuple[DrivenWheel, ...]:
    """The wheels of a rover that speed drives turn, with what steers them; none for what is no rover."""
    joints = {joint.name: joint for joint in rover.joints}
    carried_by = {joint.child: joint for joint in rover.joints}
    turned = {drive.joint: drive for drive in rover.drives if drive.mode == "speed"}
    steered = {drive.joint: drive for drive in rover.drives if drive.mode == "position"}
    found = []
    for wheel in rover.wheels:
        joint = joints[wheel.joint]
        drive = turned.get(wheel.joint)
        if drive is None or math.hypot(joint.axis[0], joint.axis[1]) < LEVEL:
            continue
        above = _steering_joint(carried_by, joint, set(steered))
        limit = above.limit if above is not None else None
        found.append(
            DrivenWheel(
                drive=drive.name,
                x=wheel.center[0],
                y=wheel.center[1],
                radius=wheel.radius,
                sign=1.0 if joint.axis[1] >= 0 else -1.0,
                fastest=drive.max_speed if drive.max_speed is not None else math.inf,
                steering=None if above is None else steered[above.name].name,
                steering_sign=1.0 if above is None or above.axis[2] > 0 else -1.0,
                limits=(-math.inf, math.inf) if limit is None else (min(0.0, limit.lower + SHY), max(0.0, limit.upper - SHY)),
            )
        )
    return tuple(found)


def _steering_joint(carried_by: dict[str, Joint], joint: Joint, steered: set[str]) -> Joint | None:
    above = carried_by.get(joint.parent or "")
    while above is not None:
        if above.name in steered and abs(above.axis[2]) > UPRIGHT:
            return above
        above = carried_by.get(above.parent or "")
    return None


def steer(command: Callable[[str, float], None], wheels: Sequence[DrivenWheel], forward: float, turn: float) -> None:
    """Command drives to a forward speed [m/s] and a turn rate [rad/s, to the left] of the rover; command : drive, set value.

    Raises
    ------
    InputRefused : if no wheel is driven.
    """
    if not wheels:
        raise InputRefused("the model has no driven wheels to steer; set its drives one by one")
    for drive, value in set_values(wheels, forward, turn).items():
        command(drive, value)


def set_values(wheels: Sequence[DrivenWheel], forward: float, turn: float) -> dict[str, float]:
    """Set values of the drives [rad/s, rad] for a forward speed [m/s] and a turn rate [rad/s, to the left].

    What is faster than a drive can turn is scaled down, all wheels alike.
    """
    if not wheels:
        return {}
    unsteered = [wheel for wheel in wheels if wheel.steering is None]
    middle_x = sum(wheel.x for wheel in unsteered or wheels) / len(unsteered or wheels)
    middle_y = sum(wheel.y for wheel in wheels) / len(wheels)
    rates: dict[str, tuple[float, float]] = {}
    values: dict[str, float] = {}
    for wheel in wheels:
        ahead = forward - turn * (wheel.y - middle_y)
        aside = turn * (wheel.x - middle_x)
        along = ahead
        if wheel.steering is not None and (ahead or aside):
            back = ahead < 0 or (ahead == 0 and forward < 0)
            angle = math.atan2(-aside, -ahead) if back else math.atan2(aside, ahead)
            position = min(max(wheel.steering_sign * angle, wheel.limits[0]), wheel.limits[1])
            values[wheel.steering] = position
            angle = wheel.steering_sign * position
            along = ahead * math.cos(angle) + aside * math.sin(angle)
        rates[wheel.drive] = (wheel.sign * along / wheel.radius, wheel.fastest)
    share = min((fastest / abs(rate) for rate, fastest in rates.values() if abs(rate) > fastest), default=1.0)
    return values | {drive: rate * share for drive, (rate, _) in rates.items()}
