"""Facts of machines for diagnosis, made of a rover's values: no database, no solver."""

from collections.abc import Sequence

import numpy as np

from rille.model import Effect, Rover, Soil
from rille.model.machine import Machine, MachineBody, MachineDrive, MachineJoint, MachineWheel

EARTH = 9.80665
SOIL_NUMBERS = ("sinkage_exponent", "cohesive_modulus", "frictional_modulus", "cohesion", "friction_angle", "shear_modulus")


def machine_of(rover: Rover, *, soil: Soil | None = None, gravity: float = EARTH, effects: Sequence[Effect] = ()) -> Machine:
    """The machine on flat ground of that soil; without one in free space, or held by the world."""
    parameters: dict[str, tuple[float, float, float]] = {f"gravity.{k}": (0.0, -1e308, 1e308) for k in "xy"}
    parameters["gravity.z"] = (-gravity, -1e308, 1e308)
    for number in SOIL_NUMBERS if soil is not None else ():
        parameters[f"soil.{soil.name}.{number}"] = (getattr(soil, number), 0.0, 1e15)  # type: ignore[union-attr]
    for body in rover.bodies:
        parameters[f"body.{body.name}.mass"] = (body.properties.mass, 1e-300, 1e308)
        for word, value in zip(("ixx", "iyy", "izz"), np.diag(body.properties.inertia), strict=True):
            parameters[f"body.{body.name}.{word}"] = (float(value), 1e-300, 1e308)
    for wheel in rover.wheels:
        parameters[f"wheel.{wheel.name}.radius"] = (wheel.radius, 1e-3, 100.0)
        parameters[f"wheel.{wheel.name}.width"] = (wheel.width, 1e-3, 100.0)
    for drive in rover.drives:
        parameters[f"drive.{drive.name}.max_torque"] = (drive.max_torque, 1e-300, 1e308)
        parameters[f"drive.{drive.name}.position_gain"] = (drive.position_gain, 1e-300, 1e308)
    for effect in effects:
        for name, value in effect.parameters.items():
            parameters[f"effect.{effect.kind}.{effect.target}.{name}"] = (float(value), -1e308, 1e308)  # type: ignore[arg-type]
    held = any(j.parent is None for j in rover.joints)
    return Machine(
        root="" if held else rover.bodies[0].name,
        has_ground=soil is not None,
        soft_ground=soil is not None and bool(rover.wheels),
        gravity=gravity,
        joints=tuple(
            MachineJoint(name=j.name, kind=j.kind, parent=j.parent or "", child=j.child, point=j.point, axis=j.axis) for j in rover.joints
        ),
        drives=tuple(
            MachineDrive(name=d.name, joint=d.joint, mode=d.mode, max_torque=d.max_torque, speed_gain=d.speed_gain) for d in rover.drives
        ),
        wheels=tuple(
            MachineWheel(
                name=w.name,
                joint=w.joint,
                radius=w.radius,
                width=w.width,
                grouser_count=w.grouser.count if w.grouser else 0,
                grouser_height=w.grouser.height if w.grouser else 0.0,
            )
            for w in rover.wheels
        ),
        bodies=tuple(
            MachineBody(name=b.name, mass=b.properties.mass, com=tuple(b.properties.com.tolist()), frame=b.frame) for b in rover.bodies
        ),
        soils=(soil.name,) if soil is not None else (),
        effects=tuple(effects),
        parameters=parameters,
    )
