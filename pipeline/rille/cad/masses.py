"""Mass properties of parts and bodies, with the provenance of every value."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rille.cad.component import Component
from rille.cad.entries import is_named, symmetric_matrix, triple_of
from rille.cad.geometry import compose
from rille.cad.materials import Materials
from rille.cad.sheet import BodySheet, PartSheet, RoverSheet
from rille.model import InputRefused, MassProperties, Material, Provenance
from rille.model.quantity import to_si

Matrix = NDArray[np.float64]
LARGEST = 1e15  # [kg m^2] of an inertia; squares of numbers beyond it may overflow

STRENGTH: tuple[Provenance, ...] = ("measured", "stated", "geometry", "cad_material", "default")  # strongest first

MASSLESS = MassProperties(
    mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3)), mass_provenance="geometry", inertia_provenance="geometry"
)  # free surfaces: seen, not weighed


def part_properties(part: Component, sheet: RoverSheet, materials: Materials) -> tuple[MassProperties, Material | None]:
    """Mass properties of a part, and its material.

    Precedence: stated mass and inertia > stated mass (the exact inertia of the geometry is rescaled) > density of the
    material that the sheet names > mass of a part that comes from a database > material of the CAD file > default material of the
    sheet > refusal; of several [[part]] that match, the first that states it. A part without solids has no mass unless the sheet states
    one with its inertia.

    Raises
    ------
    InputRefused : for a part without mass, a mass that is not positive, an inertia that no body can have.
    """
    rules = [rule for rule in sheet.part if is_named(part.drawn_as, rule.match)]
    mass_rule = next((r for r in rules if r.mass is not None), None)
    name = next((r.material for r in rules if r.material is not None), None)
    material = None if name is None else materials.find(name, f"part '{part.name}'")
    if mass_rule is not None:
        return _stated(part, mass_rule), material
    if part.ready is not None and material is None:
        return part.ready.properties, part.material
    if part.volume.n_solids == 0:
        return MASSLESS, material
    provenance: Provenance = "geometry"
    if material is None and part.material is not None:
        material, provenance = part.material, "cad_material"
    elif material is None and sheet.default_material is not None:
        material, provenance = materials.find(sheet.default_material, "default_material"), "default"
    if material is None:
        raise InputRefused(f"part '{part.name}' has neither a mass nor a material; add a [[part]] or a default_material to the sheet")
    properties = MassProperties(
        mass=material.density * part.volume.volume,
        com=part.volume.com,
        inertia=material.density * part.volume.inertia,
        mass_provenance=provenance,
        inertia_provenance=provenance,
    )
    return properties, material


def positive_mass(value: float | int | str, what: str) -> float:
    """Mass [kg], refused unless it is above zero."""
    mass = to_si(value, "mass", what)
    if mass <= 0:
        raise InputRefused(f"{what} is {mass:g} kg; it must be above 0 (list what has no mass under `ignore`)")
    return mass


def box_inertia(mass: float, size: Matrix) -> Matrix:
    """Inertia of a homogeneous box of the full lengths ``size`` (3,) about its centre: m/12 (|l|^2 E - diag(l^2))."""
    squares = np.asarray(size) ** 2
    return mass / 12 * np.diag(squares.sum() - squares)


def _stated(part: Component, rule: PartSheet) -> MassProperties:
    subject = f"part '{part.name}'"
    mass = positive_mass(rule.mass or 0.0, f"mass of {subject}")
    volume = part.volume
    com = volume.com if rule.com is None else triple_of(rule.com, "length", f"com of {subject}")
    if rule.inertia is None:
        if volume.volume <= 0:
            raise InputRefused(f"{subject} has a stated mass but no solid to take its inertia from; state its `inertia` and `com`, too")
        inertia, provenance = volume.inertia * (mass / volume.volume), "geometry"
    else:
        inertia, provenance = symmetric_matrix(rule.inertia, f"inertia of {subject}"), "stated"
        check_inertia(inertia, subject)
    return MassProperties(mass=mass, com=com, inertia=inertia, mass_provenance="stated", inertia_provenance=provenance)


def principal_moments(inertia: Matrix, subject: str) -> NDArray[np.float64]:
    """Principal moments [kg m^2], ascending; numbers that no machine has are refused before they overflow."""
    largest = float(np.abs(inertia).max())
    if not largest <= LARGEST:
        raise InputRefused(f"inertia of {subject} has a number of {largest:g} kg m^2; it must be at most {LARGEST:g}, check its unit")
    return np.asarray(np.linalg.eigvalsh(inertia), dtype=np.float64)


def check_inertia(inertia: Matrix, subject: str) -> None:
    """Refuse an inertia that no distribution of mass has: principal moments are positive and obey A + B >= C."""
    moments = principal_moments(inertia, subject)
    if moments[0] <= 0:
        raise InputRefused(f"inertia of {subject} has the principal moment {moments[0]:g} kg m^2; all must be above 0")
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        raise InputRefused(
            f"inertia of {subject} breaks the triangle inequality: {moments[2]:g} > {moments[0]:g} + {moments[1]:g} "
            "kg m^2; no body has such moments, correct the inertia"
        )


def placed(properties: MassProperties, matrix: Matrix) -> tuple[float, Matrix, Matrix]:
    """Mass, centre and inertia of a part, seen from the frame that ``matrix`` (4, 4) places it in."""
    rotation = matrix[:3, :3]
    return properties.mass, rotation @ properties.com + matrix[:3, 3], rotation @ properties.inertia @ rotation.T


def body_properties(parts: Sequence[tuple[MassProperties, Matrix]], sheet: BodySheet, up: Matrix) -> MassProperties:
    """Composite of placed parts in M; what the sheet states of the body overrides it. The weakest provenance of the parts is kept.

    up : rotation from the drawing, in which the sheet speaks, to M.

    Raises
    ------
    InputRefused : for a body without mass, a stated centre or inertia without a stated mass, and an inertia that no body has.
    """
    subject = f"body '{sheet.name}'"
    heavy = [(properties, matrix) for properties, matrix in parts if properties.mass > 0]
    if sheet.mass is None and (sheet.com is not None or sheet.inertia is not None):
        raise InputRefused(f"{subject} has a stated centre or inertia but no stated mass; state its `mass`, too")
    if sheet.mass is None and not heavy:
        raise InputRefused(
            f"{subject} has no mass: none of its parts has a solid; state its `mass`, `com` and `inertia`, or add a [[mass]]"
        )
    if sheet.mass is not None and not heavy and (sheet.com is None or sheet.inertia is None):
        raise InputRefused(f"{subject} has no solids to take centre and inertia from; state its `com` and `inertia`, too")
    mass, com, inertia = compose([placed(properties, matrix) for properties, matrix in heavy])
    made = MassProperties(
        mass=mass,
        com=com,
        inertia=(inertia + inertia.T) / 2,
        mass_provenance=STRENGTH[max((STRENGTH.index(p.mass_provenance) for p, _ in heavy), default=0)],
        inertia_provenance=STRENGTH[max((STRENGTH.index(p.inertia_provenance) for p, _ in heavy), default=0)],
    )
    if sheet.mass is not None:
        stated = positive_mass(sheet.mass, f"mass of {subject}")
        made = replace(made, mass=stated, mass_provenance="stated", inertia=made.inertia * (stated / mass if mass > 0 else 1.0))
    if sheet.com is not None:
        made = replace(made, com=up @ triple_of(sheet.com, "length", f"com of {subject}"))
    if sheet.inertia is not None:
        inertia = up @ symmetric_matrix(sheet.inertia, f"inertia of {subject}") @ up.T
        made = replace(made, inertia=inertia, inertia_provenance="stated")
    check_inertia(made.inertia, subject)
    return made
