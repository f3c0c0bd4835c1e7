"""What a machine is, as diagnosis must know it: bodies, joints, drives, wheels, and the numbers that may be set. Frozen facts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from rille.model.effect import Effect

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineBody:
    """mass [kg]; com, frame [m]: centre of mass and origin of the body frame in the model frame M."""

    name: str
    mass: float
    com: Vector
    frame: Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineJoint:
    """kind : hinge, prismatic, fixed or spherical. parent : body that carries, '' the world. point [m], axis [-] in M.
    lower, upper : limits [rad or m].
    """

    name: str
    kind: str
    parent: str
    child: str
    point: Vector
    axis: Vector
    lower: float = -math.inf
    upper: float = math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineDrive:
    """mode : speed, torque or position. max_torque [N m or N], max_speed [rad/s or m/s], speed_gain [N m s/rad], torque_constant [N m/A],
    resistance [ohm]; None: the drive has no such bound or number.
    """

    name: str
    joint: str
    mode: str
    max_torque: float
    max_speed: float | None = None
    speed_gain: float | None = None
    torque_constant: float | None = None
    resistance: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineWheel:
    """joint : that it turns about. radius, width, grouser_height [m]; grouser_count 0: smooth. soft : some ground is soft for it."""

    name: str
    joint: str
    radius: float
    width: float
    grouser_count: int = 0
    grouser_height: float = 0.0
    soft: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineSensor:
    """A sensor of the model: what quantity of which target it reads."""

    name: str
    quantity: str
    target: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """A model in its scenario.

    root : body that no joint carries, '' if the world holds the mechanism. has_ground : the scenario has a terrain under a free machine;
    terrain : its name, '' none. soft_ground : some wheel meets soil that gives way there. gravity : its size [m/s^2]. soils : names of
    those that the terrain shows. effects : that the model has. parameters : of the solver, by name: value, smallest, largest (SI); see
    solver/src/simulate/parameters.hpp.
    """

    root: str
    has_ground: bool
    soft_ground: bool
    gravity: float
    terrain: str = ""
    joints: tuple[MachineJoint, ...] = ()
    drives: tuple[MachineDrive, ...] = ()
    wheels: tuple[MachineWheel, ...] = ()
    bodies: tuple[MachineBody, ...] = ()
    sensors: tuple[MachineSensor, ...] = ()
    soils: tuple[str, ...] = ()
    effects: tuple[Effect, ...] = ()
    parameters: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
