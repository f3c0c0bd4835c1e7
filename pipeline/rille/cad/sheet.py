"""The sheet ``rover.toml``: what a STEP file cannot say. Points and axes are in the frame of the drawing.

Keys below are the tables of the sheet. Numbers are SI, or strings with a unit ("35 deg", "120 mm").
"""

from typing import Literal

from pydantic import Field

from rille.model.sheet import Sheet

Number = float | int | str
Triple = list[Number]
Collision = Literal["box", "hull", "primitives", "auto", "symmetric", "coacd", "cuts", "none"]


def triple(default: list[Number] | None = None):
    """Field of exactly three numbers."""
    return Field(default, min_length=3, max_length=3) if default is not None else Field(min_length=3, max_length=3)


def optional_triple():
    """Field of three numbers or nothing."""
    return Field(None, min_length=3, max_length=3)


class MaterialSheet(Sheet):
    """[[material]]: density of a named material. Further ones are in `materials.toml` beside the sheet and in rille's library."""

    name: str = Field(min_length=1)
    density: Number
    source: str = ""


class MaterialLibrary(Sheet):
    """A file ``materials.toml``."""

    material: list[MaterialSheet] = Field(default_factory=list)


class PartSheet(Sheet):
    """[[part]]: material or stated mass of the prototypes whose names match.

    Precedence: stated mass and inertia; stated mass (the exact inertia is rescaled); material of the sheet; of the CAD file; default.
    """

    match: str
    material: str | None = None
    mass: Number | None = None
    com: Triple | None = optional_triple()
    """Stated centre of mass in the part's frame; without it that of the geometry."""
    inertia: list[Number] | None = Field(None, min_length=6, max_length=6)
    """ixx, iyy, izz, ixy, ixz, iyz about the part's centre of mass, in the part's axes."""


class PlaceSheet(Sheet):
    """[[place]]: a part from elsewhere: another STEP file or CadQuery script, a part of the library, a part of another database."""

    name: str = Field(min_length=1)
    """Path of its instance; those of an assembly come below it."""
    file: str | None = None
    part: str | None = None
    database: str | None = None
    """Where ``part`` is; without it the part library."""
    body: str | None = None
    """Body of its instances; without it the patterns of the bodies decide."""
    position: Triple = triple([0, 0, 0])
    rpy: Triple = triple([0, 0, 0])
    """Roll, pitch, yaw about the fixed x, y, z: R = Rz(yaw) Ry(pitch) Rx(roll)."""


class MassSheet(Sheet):
    """[[mass]]: a lumped mass without geometry, or what geometry does not show. size: of a homogeneous box; neither: a point."""

    name: str = Field(min_length=1)
    body: str
    mass: Number
    at: Triple = triple()
    size: Triple | None = optional_triple()
    inertia: list[Number] | None = Field(None, min_length=6, max_length=6)


class CylinderSheet(Sheet):
    """A cylindrical face of a part: that of this radius whose axis passes nearest to a point of the part's frame."""

    radius: Number
    near: Triple = triple([0, 0, 0])


class FrameSheet(Sheet):
    """[[frame]]: a named place: a named face of the file, a cylinder of a part, or coordinates (of a part, or of the drawing)."""

    name: str = Field(min_length=1)
    part: str | None = None
    face: str | None = None
    cylinder: CylinderSheet | None = None
    point: Triple | None = optional_triple()
    axis: Triple | None = optional_triple()


class MoveSheet(Sheet):
    """[[move]]: shifts instances before anything else, for example to build another configuration of a machine."""

    parts: list[str] = Field(min_length=1)
    by: Triple = triple()


class BodySheet(Sheet):
    """[[body]]: the instances that move together. A stated mass (and centre, inertia) of the body overrides the sum of its parts."""

    name: str = Field(min_length=1)
    parts: list[str] = Field(default_factory=list)
    mass: Number | None = None
    com: Triple | None = optional_triple()
    """Stated centre of mass in the frame of the drawing."""
    inertia: list[Number] | None = Field(None, min_length=6, max_length=6)
    """ixx, iyy, izz, ixy, ixz, iyz about the body's centre of mass, in the axes of the drawing."""
    collision: Collision | None = None


class FrictionSheet(Sheet):
    """Friction of a joint: dry (Coulomb) and viscous."""

    coulomb: Number = 0.0
    viscous: Number = 0.0


class StopSheet(Sheet):
    """Elastic stops at the limits of a joint; without this table they are rigid."""

    stiffness: Number
    damping: Number = 0.0


class JointSheet(Sheet):
    """[[joint]]: a freedom between two bodies; without a parent the child is held by the world.

    Its axis is that of the frame ``at``, or given by ``point`` and ``axis``. Where both ``at`` and ``axis`` are given they must agree, and
    ``axis`` says which way is positive.
    """

    name: str = Field(min_length=1)
    kind: Literal["hinge", "prismatic", "fixed", "spherical"]
    parent: str | None = None
    child: str
    at: str | None = None
    point: Triple | None = optional_triple()
    axis: Triple | None = optional_triple()
    lower: Number | None = None
    upper: Number | None = None
    stop: StopSheet | None = None
    friction: FrictionSheet | None = None


class MotorSheet(Sheet):
    """Motor line and gear of a drive: torque at the joint falls from stall_torque x gear_ratio x efficiency at rest to zero at
    no_load_speed / gear_ratio (Lynch & Park 2017, Modern Robotics, ch. 8.9.1)."""

    stall_torque: Number
    no_load_speed: Number
    gear_ratio: Number = 1.0
    efficiency: Number = 1.0
    torque_constant: Number | None = None
    resistance: Number | None = None


class DriveSheet(Sheet):
    """[[drive]]: what moves a joint; its name defaults to the joint's. Give max_torque, or a motor."""

    joint: str
    name: str | None = None
    mode: Literal["speed", "torque", "position"]
    max_torque: Number | None = None
    max_speed: Number | None = None
    position_gain: Number = 5.0
    speed_gain: Number | None = None
    integral_gain: Number = 0.0
    torque_constant: Number | None = None
    resistance: Number | None = None
    motor: MotorSheet | None = None


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


class LoopSheet(Sheet):
    """[[loop]]: two bodies that share a point and so close a loop; without body_b the point is held by the world."""

    name: str = Field(min_length=1)
    body_a: str
    body_b: str | None = None
    at: str | None = None
    point: Triple | None = optional_triple()


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
    center: Triple | None = optional_triple()
    material: str | None = None
    grousers: GrouserSheet | None = None


class SensorSheet(Sheet):
    """[[sensor]]: reads one quantity of a body, joint, wheel or drive."""

    name: str = Field(min_length=1)
    quantity: str
    target: str
    rate: Number
    frame: Literal["world", "body"] = "world"


class MirrorSheet(Sheet):
    """[mirror]: everything whose name holds the word ``of`` is declared once more under the word ``to``, on the other side of a plane.

    normal, offset : the plane, in the drawing. What has a twin of its own on the sheet is left alone.
    """

    of: str = Field("_left", min_length=1)
    to: str = Field("_right", min_length=1)
    normal: Literal["x", "y", "z"] = "y"
    offset: Number = 0.0


class BudgetSheet(Sheet):
    """[budget]: what the whole machine should weigh; `rille cad check` holds the model against it."""

    mass: Number
    tolerance: Number = 0.01


class RoverSheet(Sheet):
    """The whole sheet."""

    step: str | None = None
    """STEP file, or CadQuery script (``.py``); absent where everything is placed or comes from a URDF."""
    urdf: str | None = None
    """A mechanism to begin with; bodies and joints come from it, this sheet adds to it."""
    accepted: bool = True
    """`rille cad new` writes false: suggestions must be read by a person before they are used."""
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    tolerance: Number = "0.5 mm"
    collision: Collision = "hull"
    default_material: str | None = None
    ignore: list[str] = Field(default_factory=list)
    mirror: MirrorSheet | None = None
    budget: BudgetSheet | None = None
    material: list[MaterialSheet] = Field(default_factory=list)
    part: list[PartSheet] = Field(default_factory=list)
    place: list[PlaceSheet] = Field(default_factory=list)
    mass: list[MassSheet] = Field(default_factory=list)
    frame: list[FrameSheet] = Field(default_factory=list)
    move: list[MoveSheet] = Field(default_factory=list)
    body: list[BodySheet] = Field(default_factory=list)
    joint: list[JointSheet] = Field(default_factory=list)
    drive: list[DriveSheet] = Field(default_factory=list)
    differential: list[DifferentialSheet] = Field(default_factory=list)
    gear: list[GearSheet] = Field(default_factory=list)
    loop: list[LoopSheet] = Field(default_factory=list)
    wheel: list[WheelSheet] = Field(default_factory=list)
    sensor: list[SensorSheet] = Field(default_factory=list)
