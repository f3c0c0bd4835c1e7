"""The machines of the benchmark: what is known of them, and everything on them that an effect can be put at."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from rille import cad
from rille.model import Drive, Effect, Gear, Grouser, Joint, Rover, Soil, Wheel
from rille.proof.machines import EARTH, MOON, box, hills
from rille.proof.subject import Subject

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


def _pendulum() -> Subject:
    """Two links that hang from the world; the upper joint is driven by torque."""
    rover = Rover(
        bodies=(box("upper", 0.6, (0, 0, -0.15), (0.03, 0.03, 0.3)), box("lower", 0.35, (0, 0, -0.425), (0.025, 0.025, 0.25))),
        joints=(
            Joint(name="shoulder", kind="hinge", parent=None, child="upper", point=(0, 0, 0), axis=(0, 1, 0)),
            Joint(name="elbow", kind="hinge", parent="upper", child="lower", point=(0, 0, -0.3), axis=(0, 1, 0)),
        ),
        drives=(Drive(name="shoulder", joint="shoulder", mode="torque", max_torque=4.0),),
    )
    targets = {"joint": ("shoulder", "elbow"), "driven": ("shoulder",), "body": ("upper", "lower"), "world": ("*",)}
    return Subject(name="pendulum", rover=rover, gravity=(0, 0, -EARTH), targets=targets, efforts={"shoulder": 0.6})


def _arm() -> Subject:
    """Three hinges held by the world: a waist under speed control, a shoulder under torque, an elbow that a geared motor turns."""
    rover = Rover(
        bodies=(
            box("column", 1.2, (0, 0, -0.05), (0.12, 0.12, 0.1)),
            box("upper", 0.8, (0.02, 0, -0.25), (0.05, 0.04, 0.3)),
            box("rotor", 0.12, (0, 0.05, -0.2), (0.04, 0.03, 0.04)),
            box("fore", 0.4, (0, 0.03, -0.52), (0.035, 0.03, 0.25)),
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
    efforts = {"waist": 1.5, "shoulder": 1.2, "motor": 0.025}
    return Subject(name="arm", rover=rover, gravity=(0, 0, -EARTH), effects=effects, targets=targets, efforts=efforts)


def _free_body() -> Subject:
    """A body that was thrown, with a flywheel on a skew axis."""
    rover = Rover(
        bodies=(box("body", 4.0, (0.01, -0.01, 0.02), (0.3, 0.2, 0.15)), box("flywheel", 0.6, (0.1, 0.05, 0.05), (0.15, 0.15, 0.03))),
        joints=(Joint(name="spin", kind="hinge", parent="body", child="flywheel", point=(0.1, 0.05, 0.05), axis=(0.6, 0.0, 0.8)),),
        drives=(Drive(name="spin", joint="spin", mode="torque", max_torque=0.5),),
    )
    targets = {"joint": ("spin",), "driven": ("spin",), "body": ("body", "flywheel"), "world": ("*",)}
    return Subject(name="free_body", rover=rover, gravity=(0, 0, -MOON), targets=targets, duration=4.0, efforts={"spin": 0.08})


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
    return Subject(
        name="rover",
        rover=rover,
        gravity=(0, 0, -MOON),
        terrain=hills(np.random.default_rng(4), SOIL),
        targets=targets,
        efforts=dict.fromkeys((d.name for d in drives if d.mode == "speed"), 2.8),
        step=2e-3,
        duration=6.0,
    )


def _bench() -> Subject:
    """A wheel with grousers on a rig: carriage on a rail, post that slides up and down, driven wheel."""
    centre = (0.0, 0.0, 0.15)
    bodies = tuple(box(n, m, centre, (0.15, 0.15, 0.15)) for n, m in (("carriage", 5.0), ("post", 3.5), ("wheel", 1.5)))
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
    return Subject(
        name="bench", rover=rover, gravity=(0, 0, -EARTH), terrain=hills(np.random.default_rng(4), SOIL), targets=targets, kind="points"
    )


MAKERS = {"pendulum": _pendulum, "arm": _arm, "free_body": _free_body, "rover": _rover, "bench": _bench}


@cache
def subject(name: str) -> Subject:
    """The machine of that name."""
    return MAKERS[name]()
