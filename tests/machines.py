"""Small machines and grounds for tests, as model values."""

from typing import Literal

import numpy as np

from rille.model import (
    Body,
    Drive,
    Joint,
    MassProperties,
    MaterialPair,
    Rover,
    Soil,
    Terrain,
    Wheel,
)


def box(name: str, mass: float, com: tuple[float, float, float], size: tuple[float, float, float]) -> Body:
    """Homogeneous box; its body frame stands at the origin of the model."""
    x, y, z = (s * s for s in size)
    return Body(
        name=name,
        properties=MassProperties(
            mass=mass,
            com=np.array(com),
            inertia=np.diag([y + z, x + z, x + y]) * mass / 12,
            mass_provenance="stated",
            inertia_provenance="stated",
        ),
    )


def chain(lengths: list[float], masses: list[float]) -> Rover:
    """Slender rods hanging one below the other on hinges along y, the first one held by the world at the origin."""
    bodies, joints, top = [], [], 0.0
    for k, (length, mass) in enumerate(zip(lengths, masses, strict=True)):
        bodies.append(box(f"link{k + 1}", mass, (0, 0, top - length / 2), (0.01, 0.02, length)))
        joints.append(
            Joint(
                name=f"hinge{k + 1}",
                kind="hinge",
                parent=None if k == 0 else f"link{k}",
                child=f"link{k + 1}",
                point=(0, 0, top),
                axis=(0, 1, 0),
            )
        )
        top -= length
    return Rover(bodies=tuple(bodies), joints=tuple(joints))


def free_arm() -> Rover:
    """A free body that carries two skew hinges: everything rotates about everything."""
    bodies = (
        box("base", 4.0, (0.02, -0.01, 0.03), (0.3, 0.2, 0.1)),
        box("upper", 1.5, (0.3, 0.05, 0.1), (0.4, 0.05, 0.08)),
        box("lower", 0.8, (0.6, 0.1, 0.2), (0.05, 0.07, 0.3)),
    )
    joints = (
        Joint(name="shoulder", kind="hinge", parent="base", child="upper", point=(0.1, 0, 0.05), axis=(0, 0.6, 0.8)),
        Joint(name="elbow", kind="hinge", parent="upper", child="lower", point=(0.5, 0.1, 0.1), axis=(1, 0, 0)),
    )
    return Rover(bodies=bodies, joints=joints)


Law = Literal["bekker", "bekker_wong", "reece"]

LUNAR_SOIL = Soil(
    name="lunar_sourcebook",
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


def cart(load_kg: float, radius: float, width: float) -> Rover:
    """Cart with four driven wheels, each of which carries exactly ``load_kg`` including itself."""
    wheel_mass = 0.3 * load_kg
    bodies = [box("chassis", 4 * (load_kg - wheel_mass), (0, 0, radius + 0.05), (0.8, 0.5, 0.2))]
    joints, drives, wheels = [], [], []
    for end, x in (("front", 0.5), ("rear", -0.5)):
        for side, y in (("left", 0.4), ("right", -0.4)):
            name = f"wheel_{end}_{side}"
            bodies.append(box(name, wheel_mass, (x, y, radius), (1.6 * radius, width, 1.6 * radius)))
            point = (x, y, radius)
            joints.append(Joint(name=name, kind="hinge", parent="chassis", child=name, point=point, axis=(0, 1, 0)))
            drives.append(Drive(name=name, joint=name, mode="speed", max_torque=100.0))
            wheels.append(Wheel(name=name, joint=name, center=point, radius=radius, width=width))
    return Rover(bodies=tuple(bodies), joints=tuple(joints), drives=tuple(drives), wheels=tuple(wheels))


def plane(slope_x: float = 0.0, slope_y: float = 0.0, soil: Soil = LUNAR_SOIL, law: Law = "bekker_wong") -> Terrain:
    """Plane of 24 m x 16 m (non-square) with different postings, z = slope_x x + slope_y y."""
    n_rows, n_cols, posting_x, posting_y = 33, 25, 1.0, 0.5
    x_west, y_north = -12.0, 8.0
    x = x_west + posting_x * np.arange(n_cols)
    y = y_north - posting_y * np.arange(n_rows)
    return Terrain(
        name="plane",
        heights=slope_x * x[None, :] + slope_y * y[:, None],
        posting_x=posting_x,
        posting_y=posting_y,
        x_west=x_west,
        y_north=y_north,
        soil=soil.name,
        soils=(soil,),
        pairs=(MaterialPair(response=law, soil=soil.name),),
    )
