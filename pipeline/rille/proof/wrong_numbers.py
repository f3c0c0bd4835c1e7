"""A machine of which one number is not what its model says."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rille.proof.subject import Subject


def wrong_number(machine: Subject, number: str, target: str, share: float) -> Subject:
    """The machine with a number of ``target`` times (1 + share); of a friction angle its tangent."""
    return _CHANGES[number](machine, target, share)


def _mass(machine: Subject, target: str, share: float) -> Subject:
    def heavier(body: Any) -> Any:
        p = body.properties
        return replace(body, properties=replace(p, mass=p.mass * (1 + share), inertia=p.inertia * (1 + share)))

    bodies = tuple(heavier(body) if body.name == target else body for body in machine.rover.bodies)
    return replace(machine, rover=replace(machine.rover, bodies=bodies))


def _gravity(machine: Subject, target: str, share: float) -> Subject:
    x, y, z = machine.gravity
    return replace(machine, gravity=(x * (1 + share), y * (1 + share), z * (1 + share)))


def _of_drive(number: str) -> Callable[[Subject, str, float], Subject]:
    def change(machine: Subject, target: str, share: float) -> Subject:
        drives = tuple(
            replace(drive, **{number: getattr(drive, number) * (1 + share)}) if drive.name == target else drive
            for drive in machine.rover.drives
        )
        return replace(machine, rover=replace(machine.rover, drives=drives))

    return change


def _of_soil(number: str) -> Callable[[Subject, str, float], Subject]:
    def change(machine: Subject, target: str, share: float) -> Subject:
        assert machine.terrain is not None
        soils = []
        for soil in machine.terrain.soils:
            value = getattr(soil, number)
            new = float(np.arctan(np.tan(value) * (1 + share))) if number == "friction_angle" else value * (1 + share)
            soils.append(replace(soil, **{number: new}))
        return replace(machine, terrain=replace(machine.terrain, soils=tuple(soils)))

    return change


def _known_friction(machine: Subject, target: str, share: float) -> Subject:
    effects = tuple(
        replace(e, parameters={name: float(value) * (1 + share) for name, value in e.parameters.items()}) if e.target == target else e  # type: ignore[arg-type]
        for e in machine.effects
    )
    return replace(machine, effects=effects)


_CHANGES: Mapping[str, Callable[[Subject, str, float], Subject]] = {
    "mass": _mass,
    "gravity": _gravity,
    "speed_gain": _of_drive("speed_gain"),
    "position_gain": _of_drive("position_gain"),
    "cohesion": _of_soil("cohesion"),
    "friction_angle": _of_soil("friction_angle"),
    "frictional_modulus": _of_soil("frictional_modulus"),
    "shear_modulus": _of_soil("shear_modulus"),
    "sinkage_exponent": _of_soil("sinkage_exponent"),
    "viscous_friction": _known_friction,
}


def value_of(machine: Subject, number: str, target: str) -> float:
    """What the model says of a number of ``target``; a friction by its coefficient, gravity by its size."""
    if number == "mass":
        return next(b.properties.mass for b in machine.rover.bodies if b.name == target)
    if number == "gravity":
        return float(np.linalg.norm(machine.gravity))
    if number == "viscous_friction":
        return next(float(e.parameters["coefficient"]) for e in machine.effects if e.target == target)  # type: ignore[arg-type]
    owners = [d for d in machine.rover.drives if d.name == target] or list(machine.terrain.soils if machine.terrain else ())
    return float(getattr(owners[0], number))
