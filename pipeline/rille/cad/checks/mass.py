"""Checks of mass, centre and inertia."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from rille.cad.checks.body_shape import BodyShape
from rille.cad.checks.finding import Finding
from rille.model import Body, Rover

Array = NDArray[np.float64]

LIGHTEST, HEAVIEST = 5.0, 25_000.0
"""Densities [kg/m^3]. Silica aerogels begin near 3 and structural foams near 30; osmium has 22 590 (CRC Handbook, 97th ed., 2016)."""
IMPOSSIBLE = 10.0
"""A density this many times out of the range is an error, not a warning: no drawing is simplified that far."""
SMALLEST_GYRATION = 0.1
"""Least radius of gyration, of that of the filled hull; mass collected in the middle of a large shell comes to about 0.2."""


def check_masses(rover: Rover, shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """Positive mass, inertia that a body can have, centre inside the hull, magnitude against size, density."""
    for part in rover.parts:
        mass = part.properties.mass
        if not np.isfinite(mass) or mass < 0:
            yield _mass_finding(f"part '{part.name}'", part.name, mass)
    for body in rover.bodies:
        mass = body.properties.mass
        if not np.isfinite(mass) or mass <= 0:
            yield _mass_finding(f"body '{body.name}'", body.name, mass)
            continue
        broken = list(_inertia(body))
        yield from broken
        shape = shapes[body.name]
        if not shape.pieces:
            yield Finding(
                code="geometry.missing",
                severity="note",
                subject=body.name,
                value=None,
                bound=None,
                unit="",
                sentence=f"body '{body.name}' has no mesh and no collision shape, so its size cannot be checked; give one of its parts a "
                "shape",
            )
            continue
        yield from _center(body, shape)
        if not broken:
            yield from _gyration(body, shape)
    yield from _densities(rover)


def check_budget(rover: Rover, budget: float, tolerance: float) -> Iterator[Finding]:
    """Total mass against a budget [kg], with a relative tolerance."""
    total = sum(body.properties.mass for body in rover.bodies)
    if not abs(total - budget) <= tolerance * budget * (1 + 1e-12):
        yield Finding(
            code="budget.mass",
            severity="error",
            subject="total mass",
            value=total,
            bound=budget,
            unit="kg",
            sentence=f"total mass is {total:.6g} kg, {abs(total - budget):.3g} kg ({abs(total / budget - 1):.2%}) "
            f"{'above' if total > budget else 'below'} "
            f"the budget of {budget:.6g} kg +- {tolerance:.3%}; correct masses or densities on the sheet, or the budget",
        )


def _mass_finding(what: str, subject: str, mass: float) -> Finding:
    return Finding(
        code="mass.not_positive",
        severity="error",
        subject=subject,
        value=mass,
        bound=0.0,
        unit="kg",
        sentence=f"mass of {what} is {mass:.6g} kg; it must be above 0 kg, state its `mass` or give its parts a material",
    )


def _inertia(body: Body) -> Iterator[Finding]:
    inertia = np.asarray(body.properties.inertia, float)
    scale = float(np.abs(inertia).max()) if inertia.size else 0.0
    asymmetry = float(np.abs(inertia - inertia.T).max()) if np.isfinite(inertia).all() else np.nan

    def finding(code: str, value: float, bound: float, sentence: str) -> Finding:
        return Finding(code=code, severity="error", subject=body.name, value=value, bound=bound, unit="kg m^2", sentence=sentence)

    if not asymmetry <= 1e-9 * scale:
        yield finding(
            "inertia.not_finite",
            asymmetry,
            0.0,
            f"inertia of body '{body.name}' is not a finite symmetric tensor (largest difference across the diagonal {asymmetry:.3g} kg "
            "m^2, "
            "must be 0); state it as ixx, iyy, izz, ixy, ixz, iyz",
        )
        return
    a, b, c = np.linalg.eigvalsh(inertia)
    if a <= 1e-12 * max(c, 0.0) or c <= 0:
        yield finding(
            "inertia.not_positive",
            float(a),
            0.0,
            f"smallest principal moment of inertia of body '{body.name}' is {a:.4g} kg m^2; all must be above 0, correct the stated "
            "inertia "
            "(are the signs of the products right, is it about the centre of mass?)",
        )
    elif c > (a + b) * (1 + 1e-9):
        yield finding(
            "inertia.triangle",
            float(c),
            float(a + b),
            f"largest principal moment of inertia of body '{body.name}' is {c:.4g} kg m^2, more than the sum {a + b:.4g} kg m^2 of the "
            "two others; "
            "no distribution of mass has such moments, correct the stated inertia",
        )


def _center(body: Body, shape: BodyShape) -> Iterator[Finding]:
    com = np.asarray(body.properties.com, float)
    if not np.isfinite(com).all():
        yield Finding(
            code="com.outside_hull",
            severity="error",
            subject=body.name,
            value=float("nan"),
            bound=0.0,
            unit="m",
            sentence=f"centre of mass of body '{body.name}' is not finite ({com}); state its `com`",
        )
        return
    allowed = shape.tolerance + 1e-6 * shape.size
    distance = shape.hull.outside(com)
    if distance > allowed:
        yield Finding(
            code="com.outside_hull",
            severity="warning",
            subject=body.name,
            value=distance,
            bound=allowed,
            unit="m",
            sentence=f"centre of mass of body '{body.name}' lies {distance * 1e3:.4g} mm outside of the convex hull of its geometry "
            f"(allowed {allowed * 1e3:.3g} mm: the meshes' tolerance); correct the stated `com`, or draw what weighs there",
        )


def _gyration(body: Body, shape: BodyShape) -> Iterator[Finding]:
    """Radii of gyration about the principal axes against two bounds.

    Mass inside the hull cannot be farther from an axis than the farthest vertex: k <= r, a theorem. A lower bound does not exist; a
    tenth of the gyration of the filled hull is far below any machine's and far above a wrong unit's (kg mm^2 for kg m^2: 1e3).
    """
    mass, com = body.properties.mass, np.asarray(body.properties.com, float)
    moments, axes = np.linalg.eigh(np.asarray(body.properties.inertia, float))
    radii = np.sqrt(np.maximum(moments, 0) / mass)
    arms = shape.hull.points - com
    squared = (arms**2).sum(axis=1)[:, None] - (arms @ axes) ** 2
    largest = np.sqrt(np.maximum(squared.max(axis=0), 0)) + shape.tolerance
    _, _, tensor = shape.hull.moments()
    filled = np.sqrt(np.maximum(np.einsum("ik,ij,jk->k", axes, tensor, axes), 0))
    over = int(np.argmax(radii / largest))
    under = int(np.argmin(radii / np.maximum(filled, 1e-300)))
    name = body.name
    if radii[over] > largest[over] * (1 + 1e-6):
        ratio = radii[over] / largest[over]
        yield Finding(
            code="size.inertia_magnitude",
            severity="error" if ratio > 3 else "warning",
            subject=name,
            value=float(radii[over]),
            bound=float(largest[over]),
            unit="m",
            sentence=f"radius of gyration of body '{name}' is {radii[over]:.4g} m, {ratio:.3g} times the distance {largest[over]:.4g} m "
            "of its outermost "
            "point from the axis; mass inside of the geometry cannot have that, correct inertia (its unit is kg m^2) or mass",
        )
    elif radii[under] < SMALLEST_GYRATION * filled[under] - 1e-9:
        ratio = radii[under] / filled[under]
        yield Finding(
            code="size.inertia_magnitude",
            severity="error" if ratio < SMALLEST_GYRATION**2 else "warning",
            subject=name,
            value=float(radii[under]),
            bound=float(SMALLEST_GYRATION * filled[under]),
            unit="m",
            sentence=f"radius of gyration of body '{name}' is {radii[under]:.4g} m, {ratio:.3g} times the {filled[under]:.4g} m of its "
            "filled hull "
            f"(least {SMALLEST_GYRATION:g}); correct inertia (its unit is kg m^2, about the centre of mass) or mass",
        )


def _densities(rover: Rover) -> Iterator[Finding]:
    """Mass over volume of parts; of bodies where no part was named already."""
    parts = {part.name: part for part in rover.parts}
    named: set[str] = set()
    for part in rover.parts:
        for finding in _density(f"part '{part.name}'", part.name, part.properties.mass, part.volume):
            named.add(part.name)
            yield finding
    for body in rover.bodies:
        members = [i.part for i in rover.instances if i.body == body.name and i.part in parts]
        lumped = any(parts[m].volume <= 0 < parts[m].properties.mass for m in members)  # mass that is not drawn has no density
        if not lumped and not named.intersection(members):
            yield from _density(f"body '{body.name}'", body.name, body.properties.mass, sum(parts[m].volume for m in members))


def _density(what: str, subject: str, mass: float, volume: float) -> Iterator[Finding]:
    if not (mass > 0 and volume > 0):
        return
    density = mass / volume
    if LIGHTEST <= density <= HEAVIEST:
        return
    far = density > HEAVIEST * IMPOSSIBLE or density < LIGHTEST / IMPOSSIBLE
    high = density > HEAVIEST
    yield Finding(
        code="size.density",
        severity="error" if far else "warning",
        subject=subject,
        value=density,
        bound=HEAVIEST if high else LIGHTEST,
        unit="kg/m^3",
        sentence=f"{what} weighs {mass:.4g} kg in {volume * 1e6:.4g} cm^3, {density:.4g} kg/m^3, {'above' if high else 'below'} "
        f"{HEAVIEST if high else LIGHTEST:g} kg/m^3, {'denser than any metal' if high else 'lighter than any foam'}; "
        "correct its mass or density (units: kg, kg/m^3), or the unit of its drawing",
    )
