"""Machines drawn at random: lengths, masses, ratios, soils. The base model knows them exactly; only what is concealed is not in it."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from rille.model import (
    Body,
    Differential,
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
from rille.model.rover import Vector
from rille.proof.subject import Subject

EARTH, MOON, MARS = 9.80665, 1.62, 3.71  # [m/s^2]
GROUND, SOIL = "hills", "regolith"


def box(name: str, mass: float, middle: Vector, size: Vector) -> Body:
    """A homogeneous box: mass [kg], centre [m] in M, edges [m] along M."""
    x, y, z = (s * s for s in size)
    inertia = np.diag([y + z, x + z, x + y]) * mass / 12
    properties = MassProperties(mass=mass, com=np.array(middle), inertia=inertia, mass_provenance="stated", inertia_provenance="stated")
    return Body(name=name, properties=properties)


def _near(rng: np.random.Generator, value: float, factor: float = 1.4) -> float:
    """A value within a factor of another, as likely smaller as larger."""
    return float(value * np.exp(rng.uniform(-1, 1) * np.log(factor)))


def pendulum(rng: np.random.Generator) -> Subject:
    """Two links that hang from the world; a torque drives one of the joints."""
    first, second = _near(rng, 0.3), _near(rng, 0.25)
    upper, lower = _near(rng, 0.6, 1.8), _near(rng, 0.35, 1.8)
    driven = str(rng.choice(["shoulder", "elbow"]))
    rover = Rover(
        bodies=(
            box("upper", upper, (0.0, 0.0, -first * float(rng.uniform(0.4, 0.6))), (0.03, 0.03, first)),
            box("lower", lower, (0.0, 0.0, -first - second * float(rng.uniform(0.4, 0.6))), (0.025, 0.025, second)),
        ),
        joints=(
            Joint(name="shoulder", kind="hinge", parent=None, child="upper", point=(0, 0, 0), axis=(0, 1, 0)),
            Joint(name="elbow", kind="hinge", parent="upper", child="lower", point=(0, 0, -first), axis=(0, 1, 0)),
        ),
        drives=(Drive(name=driven, joint=driven, mode="torque", max_torque=4.0),),
    )
    weight = EARTH * (upper * first / 2 + lower * (first + second / 2)) if driven == "shoulder" else EARTH * lower * second / 2
    return Subject(
        name="pendulum",
        rover=rover,
        gravity=(0, 0, -EARTH),
        targets={"joint": ("shoulder", "elbow"), "driven": (driven,), "body": ("upper", "lower"), "world": ("*",)},
        efforts={driven: 0.35 * weight},
    )


def arm(rng: np.random.Generator) -> Subject:
    """Three hinges held by the world: a waist under speed control, a shoulder under torque, an elbow that a geared motor turns."""
    upper, fore, ratio = _near(rng, 0.3), _near(rng, 0.25), float(np.round(_near(rng, 12.0, 2.0), 1))
    top = -0.1
    elbow = top - upper
    side = float(rng.uniform(0.0, 0.05))
    heavy, light = _near(rng, 0.8, 1.5), _near(rng, 0.4, 1.5)
    rover = Rover(
        bodies=(
            box("column", _near(rng, 1.2), (0.0, 0.0, -0.05), (0.12, 0.12, 0.1)),
            box("upper", heavy, (0.02, 0.0, top - 0.5 * upper), (0.05, 0.04, upper)),
            box("rotor", 0.12, (0.0, 0.05, top - 0.3 * upper), (0.04, 0.03, 0.04)),
            box("fore", light, (0.0, side, elbow - 0.5 * fore), (0.035, 0.03, fore)),
        ),
        joints=(
            Joint(name="waist", kind="hinge", parent=None, child="column", point=(0, 0, 0), axis=(0, 0, 1)),
            Joint(name="shoulder", kind="hinge", parent="column", child="upper", point=(0, 0, top), axis=(0, 1, 0)),
            Joint(name="elbow", kind="hinge", parent="upper", child="fore", point=(0, 0, elbow), axis=(0, 1, 0)),
            Joint(name="motor", kind="hinge", parent="upper", child="rotor", point=(0, 0.05, top - 0.3 * upper), axis=(0, 1, 0)),
        ),
        gears=(Gear(name="gear", joint_a="elbow", joint_b="motor", ratio=ratio),),
        drives=(
            Drive(name="waist", joint="waist", mode="speed", max_torque=6.0, speed_gain=_near(rng, 1.5)),
            Drive(name="shoulder", joint="shoulder", mode="torque", max_torque=8.0),
            Drive(name="motor", joint="motor", mode="torque", max_torque=1.0),
        ),
    )
    known = (("waist", 0.05), ("shoulder", 0.15), ("elbow", 0.06))
    return Subject(
        name="arm",
        rover=rover,
        gravity=(0, 0, -EARTH),
        effects=tuple(
            Effect(kind="viscous_friction", target=name, parameters={"coefficient": _near(rng, value, 1.5)}) for name, value in known
        ),
        targets={
            "joint": ("waist", "shoulder", "elbow"),
            "driven": ("waist", "shoulder", "motor"),
            "body": ("upper", "fore"),
            "world": ("*",),
        },
        efforts={
            "waist": 1.5,
            "shoulder": 0.4 * EARTH * (heavy * upper / 2 + light * (upper + fore / 2)),
            "motor": 0.6 * EARTH * light * fore / 2 / ratio,
        },
    )


def free_body(rng: np.random.Generator) -> Subject:
    """A body that was thrown, with a flywheel on a skew axis."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    place: Vector = tuple(rng.uniform(-0.1, 0.1, 3).tolist())
    rover = Rover(
        bodies=(
            box(
                "body",
                _near(rng, 4.0, 1.6),
                tuple(rng.uniform(-0.02, 0.02, 3).tolist()),
                (_near(rng, 0.3), _near(rng, 0.2), _near(rng, 0.15)),
            ),
            box("flywheel", _near(rng, 0.6, 1.5), place, (0.15, 0.15, 0.03)),
        ),
        joints=(Joint(name="spin", kind="hinge", parent="body", child="flywheel", point=place, axis=tuple(axis.tolist())),),
        drives=(Drive(name="spin", joint="spin", mode="torque", max_torque=0.5),),
    )
    return Subject(
        name="free_body",
        rover=rover,
        gravity=(0, 0, -float(rng.choice([MOON, MARS]))),
        duration=4.0,
        targets={"joint": ("spin",), "driven": ("spin",), "body": ("body", "flywheel"), "world": ("*",)},
        efforts={"spin": 0.08},
    )


def soil(rng: np.random.Generator) -> Soil:
    """A soil about the lunar one of Carrier et al. 1991, Lunar Sourcebook ch. 9."""
    shear = _near(rng, 0.0178, 1.3)
    return Soil(
        name=SOIL,
        sinkage_exponent=float(rng.uniform(0.85, 1.15)),
        cohesive_modulus=_near(rng, 1400.0),
        frictional_modulus=_near(rng, 820e3, 1.3),
        cohesion=_near(rng, 250.0, 1.5),
        friction_angle=float(np.radians(rng.uniform(31, 38))),
        shear_modulus=shear,
        lateral_shear_modulus=shear,
        density=1700.0,
        exit_sinkage_ratio=float(rng.uniform(0.0, 0.3)),
        source="about Carrier et al. 1991, Lunar Sourcebook ch. 9",
    )


def hills(rng: np.random.Generator, ground: Soil, height: float = 0.006) -> Terrain:
    """Gentle hills, twelve waves of ``height`` [m] over 24 m x 20 m, on one soil."""
    x, y = np.arange(-12, 12.01, 0.25), np.arange(10, -10.01, -0.25)
    heights: NDArray[np.float64] = np.zeros((len(y), len(x)))
    for _ in range(12):
        wave, heading, phase = 2 * np.pi / rng.uniform(2, 7), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
        heights += height * np.sin(wave * (np.cos(heading) * x[None, :] + np.sin(heading) * y[:, None]) + phase)
    return Terrain(
        name=GROUND,
        heights=heights,
        posting_x=0.25,
        posting_y=0.25,
        x_west=-12.0,
        y_north=10.0,
        soil=ground.name,
        soils=(ground,),
        pairs=(MaterialPair(response="bekker_wong", soil=ground.name),),
    )


SIDES: Mapping[str, float] = {"left": 1.0, "right": -1.0}


def rover(rng: np.random.Generator) -> Subject:
    """A six-wheel rocker-bogie with differential and four steered wheels, on soft hills."""
    base, half, radius, width = _near(rng, 0.62, 1.15), _near(rng, 0.5, 1.15), _near(rng, 0.15, 1.15), _near(rng, 0.165, 1.2)
    chassis = _near(rng, 85.0, 1.3)
    bodies = [box("chassis", chassis, (0.025, 0.0, 0.6), (0.9, 0.6, 0.35))]
    joints, drives, wheels = [], [], []
    for side, sign in SIDES.items():
        y = sign * half
        inner = sign * 0.7 * half
        bodies += [
            box(f"rocker_{side}", 5.0, (0.28, inner, 0.47), (0.9, 0.05, 0.12)),
            box(f"bogie_{side}", 4.0, (-0.33, 0.8 * y, 0.4), (0.65, 0.05, 0.1)),
        ]
        joints += [
            Joint(name=f"rocker_{side}", kind="hinge", parent="chassis", child=f"rocker_{side}", point=(0, inner, 0.52), axis=(0, 1, 0)),
            Joint(
                name=f"bogie_{side}",
                kind="hinge",
                parent=f"rocker_{side}",
                child=f"bogie_{side}",
                point=(-base / 2, 0.8 * y, 0.44),
                axis=(0, 1, 0),
            ),
        ]
        for place, x, carrier in (("front", base, "rocker"), ("middle", 0.0, "bogie"), ("rear", -base, "bogie")):
            name, parent = f"wheel_{place}_{side}", f"{carrier}_{side}"
            if place != "middle":
                knuckle, steering = f"knuckle_{place}_{side}", f"steering_{place}_{side}"
                bodies.append(box(knuckle, 2.4, (x, 0.9 * y, 0.31), (0.1, 0.15, 0.3)))
                joints.append(Joint(name=steering, kind="hinge", parent=parent, child=knuckle, point=(x, y, 0.42), axis=(0, 0, 1)))
                drives.append(Drive(name=steering, joint=steering, mode="position", max_torque=30.0, max_speed=0.35))
                parent = knuckle
            bodies.append(_disc(name, 4.1, (x, y, radius), radius, width))
            joints.append(Joint(name=name, kind="hinge", parent=parent, child=name, point=(x, y, radius), axis=(0, 1, 0)))
            drives.append(Drive(name=name, joint=name, mode="speed", max_torque=15.0, max_speed=3.0, speed_gain=4.0))
            grouser = Grouser(count=24, height=0.01, thickness=0.006)
            wheels.append(Wheel(name=name, joint=name, center=(x, y, radius), radius=radius, width=width, grouser=grouser))
    names = tuple(wheel.name for wheel in wheels)
    driven = tuple(drive.joint for drive in drives)
    made = Rover(
        bodies=tuple(bodies),
        joints=tuple(joints),
        drives=tuple(drives),
        wheels=tuple(wheels),
        differentials=(Differential(name="differential", carrier="chassis", joint_a="rocker_left", joint_b="rocker_right"),),
    )
    return Subject(
        name="rover",
        rover=made,
        gravity=(0, 0, -MOON),
        step=2e-3,
        duration=6.0,
        terrain=hills(rng, soil(rng)),
        targets={
            "joint": driven,
            "driven": driven,
            "body": ("chassis", "bogie_left"),
            "wheel": ("*", *names),
            "terrain": ("*",),
            "world": ("*",),
        },
        efforts=dict.fromkeys((d.name for d in drives if d.mode == "speed"), 2.8),
    )


def _disc(name: str, mass: float, middle: Vector, radius: float, width: float) -> Body:
    """A thin-walled wheel about y."""
    across, about = mass * (radius**2 / 2 + width**2 / 12), 0.65 * mass * radius**2
    properties = MassProperties(
        mass=mass, com=np.array(middle), inertia=np.diag([across, about, across]), mass_provenance="stated", inertia_provenance="stated"
    )
    return Body(name=name, properties=properties)


def bench(rng: np.random.Generator) -> Subject:
    """A narrow and a wide wheel with grousers, each on a rig: carriage on a rail, post that slides up and down, driven wheel."""
    radius, narrow, slow = _near(rng, 0.15, 1.4), _near(rng, 0.12, 1.3), _near(rng, 0.03, 1.5)
    widths = {"narrow": narrow, "wide": narrow * float(rng.uniform(1.5, 2.0))}
    bodies, joints, drives, wheels = [], [], [], []
    for y, (name, width) in enumerate(widths.items()):
        centre = (0.0, float(y), radius)
        carriage, post = f"carriage_{name}", f"post_{name}"
        bodies += [box(part, mass, centre, (0.15, 0.15, 0.15)) for part, mass in ((carriage, 5.0), (post, 3.5), (name, 1.5))]
        joints += [
            Joint(name=f"rail_{name}", kind="prismatic", parent=None, child=carriage, point=centre, axis=(1, 0, 0)),
            Joint(name=f"slide_{name}", kind="prismatic", parent=carriage, child=post, point=centre, axis=(0, 0, 1)),
            Joint(name=f"axle_{name}", kind="hinge", parent=post, child=name, point=centre, axis=(0, 1, 0)),
        ]
        drives += [
            Drive(name=f"rail_{name}", joint=f"rail_{name}", mode="speed", max_torque=1e5),
            Drive(name=f"axle_{name}", joint=f"axle_{name}", mode="speed", max_torque=1e4),
        ]
        grouser = Grouser(count=int(rng.integers(12, 30)), height=float(rng.uniform(0.005, 0.015)), thickness=0.002)
        wheels.append(Wheel(name=name, joint=f"axle_{name}", center=centre, radius=radius, width=width, grouser=grouser))
    return Subject(
        name="bench",
        rover=Rover(bodies=tuple(bodies), joints=tuple(joints), drives=tuple(drives), wheels=tuple(wheels)),
        gravity=(0, 0, -EARTH),
        terrain=hills(rng, soil(rng)),
        targets={"wheel": ("*",)},
        speeds=(slow, slow * float(rng.uniform(2.0, 4.0))),
        kind="points",
    )


MAKERS: Mapping[str, Callable[[np.random.Generator], Subject]] = {
    "pendulum": pendulum,
    "arm": arm,
    "free_body": free_body,
    "rover": rover,
    "bench": bench,
}
