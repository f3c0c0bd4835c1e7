"""The machines of the benchmark: what is known of them, and everything on them that an effect can be put at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from rille import cad, store
from rille.model import (
    Body,
    Drive,
    Effect,
    Gear,
    Grouser,
    Joint,
    MassProperties,
    MaterialPair,
    Rover,
    Soil,
    Terrain,
    Wheel,
)

EARTH, MOON = 9.80665, 1.62  # [m/s^2]
ROVER = Path(__file__).resolve().parents[2] / "examples/rover/rover.toml"
SOIL = Soil(
    name="regolith",
    sinkage_exponent=1.0,
    cohesive_modulus=1400.0,
    frictional_modulus=820e3,
    cohesion=170.0,
    friction_angle=np.radians(35.0),
    shear_modulus=0.0178,
    lateral_shear_modulus=0.0178,
    density=1700.0,
    source="Carrier et al. 1991, Lunar Sourcebook ch. 9",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """A machine as diagnosis knows it.

    effects : physics that the model has. gravity : in W [m/s^2]. step : of the model that diagnosis runs [s].
    duration : of a recording [s]. targets : kind of target (joint, driven, body, wheel, world, terrain) -> names.
    kind : of its recordings, ``time`` or ``points``.
    """

    name: str
    rover: Rover
    gravity: tuple[float, float, float]
    step: float = 1e-3
    duration: float = 5.0
    terrain: Terrain | None = None
    effects: tuple[Effect, ...] = ()
    targets: Mapping[str, Sequence[str]] = field(default_factory=dict)
    kind: str = "time"

    def write(self, path: Path) -> None:
        """A new database with the model."""
        store.create(path)
        store.write_rover(path, self.rover)
        if self.terrain is not None:
            store.write_terrain(path, self.terrain)
        store.write_effects(path, self.effects)


def _rod(name: str, mass: float, middle: tuple[float, float, float], size: tuple[float, float, float]) -> Body:
    x, y, z = (s * s for s in size)
    inertia = np.diag([y + z, x + z, x + y]) * mass / 12
    properties = MassProperties(mass=mass, com=np.array(middle), inertia=inertia, mass_provenance="stated", inertia_provenance="stated")
    return Body(name=name, properties=properties)


def _pendulum() -> Subject:
    """Two links that hang from the world; the upper joint is driven by torque."""
    rover = Rover(
        bodies=(_rod("upper", 0.6, (0, 0, -0.15), (0.03, 0.03, 0.3)), _rod("lower", 0.35, (0, 0, -0.425), (0.025, 0.025, 0.25))),
        joints=(
            Joint(name="shoulder", kind="hinge", parent=None, child="upper", point=(0, 0, 0), axis=(0, 1, 0)),
            Joint(name="elbow", kind="hinge", parent="upper", child="lower", point=(0, 0, -0.3), axis=(0, 1, 0)),
        ),
        drives=(Drive(name="shoulder", joint="shoulder", mode="torque", max_torque=4.0),),
    )
    targets = {"joint": ("shoulder", "elbow"), "driven": ("shoulder",), "body": ("upper", "lower"), "world": ("*",)}
    return Subject(name="pendulum", rover=rover, gravity=(0, 0, -EARTH), targets=targets)


def _arm() -> Subject:
    """Three hinges held by the world: a waist under speed control, a shoulder under torque, an elbow that a geared motor turns."""
    rover = Rover(
        bodies=(
            _rod("column", 1.2, (0, 0, -0.05), (0.12, 0.12, 0.1)),
            _rod("upper", 0.8, (0.02, 0, -0.25), (0.05, 0.04, 0.3)),
            _rod("rotor", 0.12, (0, 0.05, -0.2), (0.04, 0.03, 0.04)),
            _rod("fore", 0.4, (0, 0.03, -0.52), (0.035, 0.03, 0.25)),
        ),
        joints=(
            Joint(name="waist", kind="hinge", parent=None, child="column", point=(0, 0, 0), axis=(0, 0, 1)),
            Joint(name="shoulder", kind="hinge", parent="column", child="upper", point=(0, 0, -0.1), axis=(0, 1, 0)),
            Joint(name="elbow", kind="hinge", parent="upper", child="fore", point=(0, 0, -0.4), axis=(0, 1, 0)),
            Joint(name="motor", kind="hinge", parent="upper", child="rotor", point=(0, 0.05, -0.2), axis=(0, 1, 0)),
        ),
        gears=(Gear(name="gear", joint_a="elbow", joint_b="motor", ratio=12.0),),
        drives=(
            Drive(name="waist", joint="waist", mode="speed", max_torque=6.0, speed_gain=1.5),
            Drive(name="shoulder", joint="shoulder", mode="torque", max_torque=8.0),
            Drive(name="motor", joint="motor", mode="torque", max_torque=0.4),
        ),
    )
    effects = tuple(
        Effect(kind="viscous_friction", target=name, parameters={"coefficient": value})
        for name, value in (("waist", 0.05), ("shoulder", 0.15), ("elbow", 0.06))
    )
    targets = {
        "joint": ("waist", "shoulder", "elbow"),
        "driven": ("waist", "shoulder", "motor"),
        "body": ("upper", "fore"),
        "world": ("*",),
    }
    return Subject(name="arm", rover=rover, gravity=(0, 0, -EARTH), effects=effects, targets=targets)


def _free_body() -> Subject:
    """A body that was thrown, with a flywheel on a skew axis."""
    rover = Rover(
        bodies=(_rod("body", 4.0, (0.01, -0.01, 0.02), (0.3, 0.2, 0.15)), _rod("flywheel", 0.6, (0.1, 0.05, 0.05), (0.15, 0.15, 0.03))),
        joints=(Joint(name="spin", kind="hinge", parent="body", child="flywheel", point=(0.1, 0.05, 0.05), axis=(0.6, 0.0, 0.8)),),
        drives=(Drive(name="spin", joint="spin", mode="torque", max_torque=0.5),),
    )
    targets = {"joint": ("spin",), "driven": ("spin",), "body": ("body", "flywheel"), "world": ("*",)}
    return Subject(name="free_body", rover=rover, gravity=(0, 0, -MOON), targets=targets, duration=4.0)


def _hilly(seed: int = 4) -> Terrain:
    """Gentle hills of a few centimetres over 24 m x 20 m, on soft soil."""
    rng = np.random.default_rng(seed)
    x, y = np.arange(-12, 12.01, 0.25), np.arange(10, -10.01, -0.25)
    heights = np.zeros((len(y), len(x)))
    for _ in range(12):
        wave, heading, phase = 2 * np.pi / rng.uniform(2, 7), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
        heights += 0.006 * np.sin(wave * (np.cos(heading) * x[None, :] + np.sin(heading) * y[:, None]) + phase)
    return Terrain(
        name="hills",
        heights=heights,
        posting_x=0.25,
        posting_y=0.25,
        x_west=-12.0,
        y_north=10.0,
        soil=SOIL.name,
        soils=(SOIL,),
        pairs=(MaterialPair(response="bekker_wong", soil=SOIL.name),),
    )


def _rover() -> Subject:
    """The six-wheel rover of the examples, without its meshes, short and coarse."""
    built = cad.build(ROVER)
    rover = replace(built, parts=(), instances=(), collision_shapes=(), materials=(), sensors=(), sources=())
    rover = replace(rover, wheels=tuple(replace(wheel, material=None) for wheel in rover.wheels))
    # A speed that is held exactly jumps with its command, in an effort that depends on the step; a controller's does not.
    drives = tuple(replace(drive, speed_gain=4.0) if drive.mode == "speed" else drive for drive in rover.drives)
    rover = replace(rover, drives=drives)
    wheels = tuple(wheel.name for wheel in rover.wheels)
    driven = tuple(drive.joint for drive in rover.drives)
    targets = {
        "joint": driven,
        "driven": driven,
        "body": ("chassis", "bogie_left"),
        "wheel": ("*", *wheels),
        "terrain": ("*",),
        "world": ("*",),
    }
    return Subject(name="rover", rover=rover, gravity=(0, 0, -MOON), terrain=_hilly(), targets=targets, step=2e-3, duration=6.0)


def _bench() -> Subject:
    """A wheel with grousers on a rig: carriage on a rail, post that slides up and down, driven wheel."""
    centre = (0.0, 0.0, 0.15)
    bodies = tuple(_rod(n, m, centre, (0.15, 0.15, 0.15)) for n, m in (("carriage", 5.0), ("post", 3.5), ("wheel", 1.5)))
    joints = (
        Joint(name="rail", kind="prismatic", parent=None, child="carriage", point=centre, axis=(1, 0, 0)),
        Joint(name="slide", kind="prismatic", parent="carriage", child="post", point=centre, axis=(0, 0, 1)),
        Joint(name="axle", kind="hinge", parent="post", child="wheel", point=centre, axis=(0, 1, 0)),
    )
    drives = (
        Drive(name="rail", joint="rail", mode="speed", max_torque=1e5),
        Drive(name="axle", joint="axle", mode="speed", max_torque=1e4),
    )
    grouser = Grouser(count=24, height=0.01, thickness=0.002)
    wheel = Wheel(name="wheel", joint="axle", center=centre, radius=0.15, width=0.165, grouser=grouser)
    rover = Rover(bodies=bodies, joints=joints, drives=drives, wheels=(wheel,))
    targets = {"wheel": ("wheel",)}
    return Subject(name="bench", rover=rover, gravity=(0, 0, -EARTH), terrain=_hilly(), targets=targets, kind="points")


MAKERS = {"pendulum": _pendulum, "arm": _arm, "free_body": _free_body, "rover": _rover, "bench": _bench}


@cache
def subject(name: str) -> Subject:
    """The machine of that name."""
    return MAKERS[name]()
