"""A rover (or any mechanism) as values: parts, moving bodies, joints, drives, wheels.

All lengths in metres, masses in kilograms, angles in radians. All poses, points, axes and inertias of bodies, joints,
wheels and collision shapes are given in the model frame M at the zero pose; those of a part in the part's own frame.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model.effect import Effect

Provenance = Literal["stated", "measured", "geometry", "cad_material", "default"]
"""Where a value comes from, strongest first."""

Vector = tuple[float, float, float]
"""Three components, x y z."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceFile:
    """A file that values were read from. ``sha256`` is its hexadecimal digest."""

    subject: str
    file: str
    sha256: str
    tool: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """Pose of a frame in its parent: ``position`` [m] and unit quaternion ``rotation`` (w, x, y, z)."""

    position: Vector = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MassProperties:
    """Mass, centre of mass and inertia about the centre of mass.

    mass : [kg]
    com : centre of mass [m], shape (3,).
    inertia : tensor about the centre of mass [kg m^2], shape (3, 3), off-diagonal elements ``-Int x y dm``.
    """

    mass: float
    com: NDArray[np.float64]
    inertia: NDArray[np.float64]
    mass_provenance: Provenance
    inertia_provenance: Provenance


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Material with its ``density`` [kg/m^3]."""

    name: str
    density: float
    provenance: Provenance = "stated"
    source: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Triangle mesh in the part's frame.

    vertices : [m], float32, shape (n, 3). triangles : int32, shape (m, 3), counter-clockwise from outside.
    tolerance : largest distance from the exact surface [m].
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    tolerance: float
    purpose: Literal["visual", "collision"] = "visual"


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Prototype of a part: geometry and mass properties once, used by any number of instances."""

    name: str
    volume: float
    properties: MassProperties
    material: str | None = None
    brep_hash: str = ""
    color: str = "#9aa0a6"
    meshes: tuple[Mesh, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PartInstance:
    """A placed part. ``path`` is its place in the assembly, ``body`` the moving body it belongs to (None: to none)."""

    path: str
    part: str
    pose: Pose
    body: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A moving body: parts that move together. ``frame`` is the origin of its frame in M [m]."""

    name: str
    properties: MassProperties
    frame: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CollisionShape:
    """Collision shape of a body, posed in M at the zero pose.

    size : box: full lengths (x, y, z) [m]; sphere: (radius,); cylinder: (radius, height) with its axis along z.
    vertices : hull only, [m], float64, shape (n, 3), relative to the pose.
    """

    body: str
    kind: Literal["box", "sphere", "cylinder", "hull"]
    pose: Pose
    size: tuple[float, ...] = ()
    vertices: NDArray[np.float64] | None = None
    material: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLimit:
    """Range of a joint's position [rad or m], with a stop at either end.

    stiffness [N m/rad or N/m] and damping [N m s/rad or N s/m] of the stops; None: rigid. A pressed stop pushes back by
    F = stiffness depth + damping speed, never pulls.
    """

    lower: float
    upper: float
    stiffness: float | None = None
    damping: float | None = None
    provenance: Provenance = "stated"


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """Joint between a carrier ``parent`` (None: the world) and ``child``; position zero at the CAD pose.

    point : a point on the axis [m] in M. axis : unit vector in M, right-hand rule.
    """

    name: str
    kind: Literal["hinge", "prismatic", "fixed", "spherical"]
    child: str
    parent: str | None
    point: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    limit: JointLimit | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Drive of a joint.

    mode : what a command sets. max_torque : largest effort at the joint [N m or N]. max_speed : largest commanded
    speed [rad/s or m/s]. position_gain : position mode, commanded speed per position error [1/s].
    speed_gain, integral_gain : PI controller of the speed [N m s/rad, N m/rad]; no speed_gain: the speed is held exactly.
    torque_constant [N m/A], resistance [ohm] : of the motor, for sensors of current and voltage.
    """

    name: str
    joint: str
    mode: Literal["speed", "torque", "position"]
    max_torque: float
    max_speed: float | None = None
    position_gain: float = 5.0
    speed_gain: float | None = None
    integral_gain: float = 0.0
    torque_constant: float | None = None
    resistance: float | None = None
    provenance: Provenance = "stated"


@dataclass(frozen=True, slots=True, kw_only=True)
class Differential:
    """Differential of three bodies: theta_a + theta_b = 2 theta_carrier about the common direction of the hinges."""

    name: str
    carrier: str
    joint_a: str
    joint_b: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Gear:
    """Gear pair: q_b = ratio q_a."""

    name: str
    joint_a: str
    joint_b: str
    ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopClosure:
    """Two bodies that share a point [m, in M] (``body_b`` None: the world), closing a kinematic loop."""

    name: str
    body_a: str
    body_b: str | None
    point: Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Grouser:
    """Grousers (lugs) of a wheel: ``count``, ``height`` above the rim [m], ``thickness`` along the rim [m]."""

    count: int
    height: float
    thickness: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheel:
    """Wheel on a hinge. center : [m] in M. radius : rim without grousers [m]. width : [m]. material : of the rim."""

    name: str
    joint: str
    center: Vector
    radius: float
    width: float
    material: str | None = None
    grouser: Grouser | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """Reads ``quantity`` ("joint.velocity") of the body, joint, wheel or drive ``target``, ``rate`` times a second [Hz].

    frame : axes of vectors, ``world`` or ``body``.
    """

    name: str
    quantity: str
    target: str
    rate: float
    frame: Literal["world", "body"] = "world"


# what a drive's command sets, by its mode
COMMAND_QUANTITIES = {"speed": "joint.velocity", "position": "joint.position", "torque": "joint.effort"}
COMMAND_UNITS = {"speed": ("rad/s", "m/s"), "position": ("rad", "m"), "torque": ("N m", "N")}  # of a joint that turns, that slides


@dataclass(frozen=True, slots=True, kw_only=True)
class Rover:
    """A complete mechanism, as the CAD pipeline makes it and the store keeps it."""

    materials: tuple[Material, ...] = ()
    parts: tuple[Part, ...] = ()
    instances: tuple[PartInstance, ...] = ()
    bodies: tuple[Body, ...] = ()
    collision_shapes: tuple[CollisionShape, ...] = ()
    joints: tuple[Joint, ...] = ()
    drives: tuple[Drive, ...] = ()
    differentials: tuple[Differential, ...] = ()
    gears: tuple[Gear, ...] = ()
    loop_closures: tuple[LoopClosure, ...] = ()
    wheels: tuple[Wheel, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    effects: tuple[Effect, ...] = ()
    sources: tuple[SourceFile, ...] = field(default=())

    @property
    def drive_units(self) -> dict[str, str]:
        """SI unit of what a command of each drive sets: by its mode, and by whether its joint turns or slides."""
        slides = {joint.name: joint.kind == "prismatic" for joint in self.joints}
        return {drive.name: COMMAND_UNITS[drive.mode][slides[drive.joint]] for drive in self.drives}

    @property
    def joint_units(self) -> dict[str, tuple[str, str]]:
        """SI units of position and velocity of each joint: by whether it turns or slides."""
        return {joint.name: ("m", "m/s") if joint.kind == "prismatic" else ("rad", "rad/s") for joint in self.joints}
