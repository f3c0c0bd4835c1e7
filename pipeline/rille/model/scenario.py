"""A scenario: where the rover starts, what it is commanded, for how long, under which gravity."""

from dataclasses import dataclass, field
from typing import Literal

from rille.model.rover import Pose, SourceFile, Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """Set value of a drive from ``time`` [s] until its next command [rad/s, rad or N m, by the drive's mode]."""

    drive: str
    time: float
    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StateChange:
    """Puts a joint, or the body that no joint carries, elsewhere at ``time`` [s].

    quantity : joint.position, joint.velocity, part.position, part.orientation (quaternion w x y z), part.linear_velocity or
    part.angular_velocity. target : name of the joint or body. values : all numbers of the quantity [SI], in W.
    """

    time: float
    quantity: str
    target: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialJointState:
    """Position [rad or m] and velocity [rad/s or m/s] of a joint at t = 0.

    Joints that have none start at 0, but what differentials and gears tie to this one follows, and joints of its loop move until it closes.
    """

    joint: str
    position: float = 0.0
    velocity: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Watch:
    """Waits for an event ("stuck") or for a quantity to pass a bound, then acts once.

    quantity, component, target : as of a sensor. above, below : bounds in SI. hold : for so long without a break [s].
    action : ``mark`` writes an event, ``stop`` ends the run, ``command`` gives ``drive`` the set ``value``.
    """

    name: str
    action: Literal["mark", "stop", "command"]
    event: str | None = None
    quantity: str | None = None
    component: int = 0
    target: str = ""
    above: float | None = None
    below: float | None = None
    hold: float = 0.0
    drive: str | None = None
    value: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One experiment.

    gravity : [m/s^2] in W. duration, step, output_interval, settle_time : [s].
    placement : ``on_terrain`` takes height and tilt from the ground under the wheels; start's x, y and heading count.
    start : pose of the root body's frame in W; start_velocity [m/s], start_angular_velocity [rad/s] in W.
    steered_from : name of the scenario that was steered to give this one; empty: stated by a person.
    """

    name: str
    duration: float
    gravity: Vector = (0.0, 0.0, -9.80665)
    step: float = 0.001
    output_interval: float = 0.02
    integrator: Literal["auto", "semi_implicit_euler", "rk4"] = "auto"
    terrain: str | None = None
    placement: Literal["on_terrain", "as_given"] = "as_given"
    settle_time: float = 0.0
    start: Pose = field(default_factory=Pose)
    start_velocity: Vector = (0.0, 0.0, 0.0)
    start_angular_velocity: Vector = (0.0, 0.0, 0.0)
    initial_states: tuple[InitialJointState, ...] = ()
    commands: tuple[Command, ...] = ()
    changes: tuple[StateChange, ...] = ()
    watches: tuple[Watch, ...] = ()
    sources: tuple[SourceFile, ...] = ()
    steered_from: str = ""
