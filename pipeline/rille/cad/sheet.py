"""The sheet ``rover.toml``: what a STEP file cannot say. Points and axes are in the frame of the STEP file."""

from typing import Literal

from pydantic import Field

from rille.model.sheet import Sheet

Number = float | int | str
Triple = list[Number]


def triple(default: list[Number] | None = None):
    """Field of exactly three numbers."""
    return Field(default, min_length=3, max_length=3) if default is not None else Field(min_length=3, max_length=3)


class MaterialSheet(Sheet):
    """[[material]]: density of a named material."""

    name: str = Field(min_length=1)
    density: Number
    source: str = ""


class PartSheet(Sheet):
    """[[part]]: material or stated mass of the prototypes whose names match.

    Precedence: stated mass and inertia; stated mass (the exact inertia is rescaled); material of the sheet.
    """

    match: str
    material: str | None = None
    mass: Number | None = None
    inertia: list[Number] | None = Field(None, min_length=6, max_length=6)
    """ixx, iyy, izz, ixy, ixz, iyz about the part's centre of mass, in the part's axes."""


class MoveSheet(Sheet):
    """[[move]]: shifts instances before anything else, for example to build another configuration of a machine."""

    parts: list[str] = Field(min_length=1)
    by: Triple = triple()


class BodySheet(Sheet):
    """[[body]]: the instances that move together."""

    name: str = Field(min_length=1)
    parts: list[str] = Field(min_length=1)
    mass: Number | None = None


class JointSheet(Sheet):
    """[[joint]]: a freedom between two bodies; without a parent the child is held by the world."""

    name: str = Field(min_length=1)
    kind: Literal["hinge", "prismatic", "fixed", "spherical"]
    parent: str | None = None
    child: str
    point: Triple = triple([0, 0, 0])
    axis: Triple = triple([0, 0, 1])
    lower: Number | None = None
    upper: Number | None = None


class DriveSheet(Sheet):
    """[[drive]]: what moves a joint; its name defaults to the joint's."""

    joint: str
    name: str | None = None
    mode: Literal["speed", "torque", "position"]
    max_torque: Number
    max_speed: Number | None = None
    position_gain: Number = 5.0
    speed_gain: Number | None = None
    integral_gain: Number = 0.0
    torque_constant: Number | None = None
    resistance: Number | None = None


class DifferentialSheet(Sheet):
    """[[differential]]: theta_a + theta_b = 2 theta_carrier."""

    name: str = Field(min_length=1)
    carrier: str
    joint_a: str
    joint_b: str


class GearSheet(Sheet):
    """[[gear]]: q_b = ratio q_a."""

    name: str = Field(min_length=1)
    joint_a: str
    joint_b: str
    ratio: Number


class GrouserSheet(Sheet):
    """Grousers of a wheel."""

    count: int = Field(gt=0)
    height: Number
    thickness: Number


class WheelSheet(Sheet):
    """[[wheel]]: a wheel on a hinge; its centre defaults to the hinge's point."""

    joint: str
    name: str | None = None
    radius: Number
    width: Number
    center: list[Number] | None = Field(None, min_length=3, max_length=3)
    material: str | None = None
    grousers: GrouserSheet | None = None


class SensorSheet(Sheet):
    """[[sensor]]: reads one quantity of a body, joint, wheel or drive."""

    name: str = Field(min_length=1)
    quantity: str
    target: str
    rate: Number
    frame: Literal["world", "body"] = "world"


class RoverSheet(Sheet):
    """The whole sheet."""

    step: str
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    tolerance: Number = "0.5 mm"
    default_material: str | None = None
    ignore: list[str] = Field(default_factory=list)
    material: list[MaterialSheet] = Field(default_factory=list)
    part: list[PartSheet] = Field(default_factory=list)
    move: list[MoveSheet] = Field(default_factory=list)
    body: list[BodySheet] = Field(min_length=1)
    joint: list[JointSheet] = Field(default_factory=list)
    drive: list[DriveSheet] = Field(default_factory=list)
    differential: list[DifferentialSheet] = Field(default_factory=list)
    gear: list[GearSheet] = Field(default_factory=list)
    wheel: list[WheelSheet] = Field(default_factory=list)
    sensor: list[SensorSheet] = Field(default_factory=list)
