"""Mass properties of parts and bodies, with the provenance of every value."""

import fnmatch
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.cad.geometry import VolumeProperties, compose
from rille.cad.sheet import PartSheet, RoverSheet
from rille.model import InputRefused, MassProperties, Material, Provenance, nearest_names
from rille.model.quantity import to_si

STRENGTH: tuple[Provenance, ...] = ("measured", "stated", "geometry", "cad_material", "default")  # strongest first


def part_properties(
    name: str, volume: VolumeProperties, sheet: RoverSheet, cad_material: Material | None = None
) -> tuple[MassProperties, str | None]:
    """Mass properties of a prototype, and its material.

    Precedence: stated mass and inertia > stated mass (the exact inertia of the geometry is rescaled) > density of the
    material that the sheet names > material of the CAD file > default material of the sheet > refusal.

    Raises
    ------
    InputRefused : for a part without solid or mass, a mass that is not positive, an inertia that no body can have.
    """
    rules = [rule for rule in sheet.part if fnmatch.fnmatchcase(name, rule.match)]
    mass_rule = next((r for r in rules if r.mass is not None), None)
    material = next((r.material for r in rules if r.material is not None), None)
    if mass_rule is not None:
        return _stated(name, volume, mass_rule), material
    if any(rule.inertia is not None for rule in rules):
        raise InputRefused(f"part '{name}' has a stated inertia but no stated mass; state its mass in the same [[part]]")
    provenance: Provenance
    if material is not None:
        used, density, provenance = material, density_of(material, f"part '{name}'", sheet), "geometry"
    elif cad_material is not None:
        used, density, provenance = cad_material.name, cad_material.density, "cad_material"
    elif sheet.default_material is not None:
        used, provenance = sheet.default_material, "default"
        density = density_of(used, "default_material", sheet)
    else:
        raise InputRefused(f"part '{name}' has neither a mass nor a material; add a [[part]] or a default_material to the sheet")
    properties = MassProperties(
        mass=density * volume.volume,
        com=volume.com,
        inertia=density * volume.inertia,
        mass_provenance=provenance,
        inertia_provenance=provenance,
    )
    return properties, used


def density_of(material: str, subject: str, sheet: RoverSheet) -> float:
    """Density [kg/m^3] of a material of the sheet."""
    known = {m.name: m for m in sheet.material}
    if material not in known:
        raise InputRefused(f"{subject} names the material '{material}', which is not on the sheet; {nearest_names(material, known)}")
    density = to_si(known[material].density, "density", f"density of material '{material}'")
    if density <= 0:
        raise InputRefused(f"density of material '{material}' is {density:g} kg/m^3; it must be above 0")
    return density


def positive_mass(value: float | int | str, what: str) -> float:
    """Mass [kg], refused unless it is above zero."""
    mass = to_si(value, "mass", what)
    if mass <= 0:
        raise InputRefused(f"{what} is {mass:g} kg; it must be above 0 (list what has no mass under `ignore`)")
    return mass


def _stated(name: str, volume: VolumeProperties, rule: PartSheet) -> MassProperties:
    mass = positive_mass(rule.mass or 0.0, f"mass of part '{name}'")
    provenance: Provenance = "geometry" if rule.inertia is None else "stated"
    if rule.inertia is None:
        inertia = volume.inertia * (mass / volume.volume)
    else:
        xx, yy, zz, xy, xz, yz = (to_si(v, "inertia", f"inertia of part '{name}'") for v in rule.inertia)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        check_inertia(inertia, f"part '{name}'")
    return MassProperties(mass=mass, com=volume.com, inertia=inertia, mass_provenance="stated", inertia_provenance=provenance)


def check_inertia(inertia: NDArray[np.float64], subject: str) -> None:
    """Refuse an inertia that no distribution of mass has: principal moments are positive and obey A + B >= C."""
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] <= 0:
        raise InputRefused(f"inertia of {subject} has the principal moment {moments[0]:g} kg m^2; all must be above 0")
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        raise InputRefused(
            f"inertia of {subject} breaks the triangle inequality: {moments[2]:g} > {moments[0]:g} + {moments[1]:g} "
            "kg m^2; no body has such moments, correct the inertia"
        )


def placed(properties: MassProperties, matrix: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Mass, centre and inertia of a part, seen from the frame that ``matrix`` (4, 4) places it in."""
    rotation = matrix[:3, :3]
    return properties.mass, rotation @ properties.com + matrix[:3, 3], rotation @ properties.inertia @ rotation.T


def body_properties(parts: Sequence[tuple[MassProperties, NDArray[np.float64]]], stated_mass: float | None) -> MassProperties:
    """Composite of placed parts; a stated mass of the body rescales it. The weakest provenance of the parts is kept."""
    mass, com, inertia = compose([placed(properties, matrix) for properties, matrix in parts])
    mass_source = STRENGTH[max(STRENGTH.index(p.mass_provenance) for p, _ in parts)]
    inertia_source = STRENGTH[max(STRENGTH.index(p.inertia_provenance) for p, _ in parts)]
    if stated_mass is not None:
        inertia, mass, mass_source = inertia * (stated_mass / mass), stated_mass, "stated"
    return MassProperties(
        mass=mass,
        com=com,
        inertia=(inertia + inertia.T) / 2,
        mass_provenance=mass_source,
        inertia_provenance=inertia_source,
    )
