"""Drawing a population from its law: how many, how large, where, how worn."""

import math
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, LandformInstance, Population, nearest_names
from rille.model.quantity import to_si
from rille.terrain.landform import Landform
from rille.terrain.population.chronology import relief_of
from rille.terrain.population.density import Frame, make_density
from rille.terrain.population.drivers import Range, evaluate, ranges, value_range
from rille.terrain.population.field import Extent, Field
from rille.terrain.population.laws import Law, make_law
from rille.terrain.population.record import record
from rille.terrain.population.sheet import PopulationSheet
from rille.terrain.population.sizes import KNOTS, Sizes
from rille.terrain.population.zones import region, zones

Array = NDArray[np.float64]

Streams = tuple[np.random.Generator, np.random.Generator, np.random.Generator]  # of numbers and sizes, of places, of thinning

MOST = 5_000_000  # forms of one population: beyond, stamping takes minutes and the database gigabytes
ROUNDS = 60  # of drawing until a stated count has found room


def draw(
    sheet: PopulationSheet,
    extent: Extent,
    landforms: Mapping[str, Landform],
    *,
    placed: Iterable[LandformInstance] = (),
    frame: Frame | None = None,
    folder: Path | None = None,
) -> Population:
    """Draw a population: a Poisson process whose density per area and diameter is the law's.

    Each form is independent of the others: its number is Poisson-distributed about the law's, or exactly ``count``; positions are
    uniform but for zones and densities, which thin them out. Equal sheet, extent and placed landforms: equal bytes; a changed zone
    or density removes or brings back single forms and leaves the others where they are (not with ``count``).

    Parameters
    ----------
    extent : x_min, y_min, x_max, y_max [m] in W of the grid. landforms : the register.
    placed : landforms of the scene, which zones and densities may name. frame : of a density map. folder : of the scene file.

    Returns
    -------
    Population with all drivers, the oldest first where the law knows ages. ``law`` holds what was asked for, and under ``expected``
    how many are to be expected with their centres in ``box`` (the extent, or the region's part of it) from each diameter on.

    Raises
    ------
    InputRefused : for an unknown landform, one that is not radial or has no diameter, and whatever else cannot be used.
    """
    asked = _asked(sheet, extent, landforms, {instance.name: instance for instance in placed}, frame or Frame(), folder or Path())
    law, subject = asked.law, asked.subject
    streams = np.random.SeedSequence([sheet.seed, zlib.crc32(sheet.name.encode())]).spawn(6)
    count, where, chance, turned, various, aging = (np.random.Generator(np.random.PCG64DXSM(stream)) for stream in streams)
    if sheet.count is None:
        candidates, stays = _poisson((count, where, chance), asked)
    else:
        candidates = _exactly(sheet.count, (count, where, chance), asked)
        stays = np.ones(sheet.count, bool)
    diameter, x, y = candidates[:, stays]
    values: dict[str, Array] = {"diameter": diameter}
    order = np.arange(len(x))
    if law.surface_age is not None:
        u = aging.random(len(stays))[stays]
        values |= asked.aged(diameter, u)
        order = np.argsort(-law.exposure(diameter, u)[0], kind="stable")
    for name, (lower, upper) in asked.given.items():
        values[name] = lower + (upper - lower) * various.random(len(stays))[stays]
    heading = _heading(sheet, subject, turned.random(len(stays))[stays])
    return Population(
        name=sheet.name,
        landform=sheet.landform,
        x=x[order],
        y=y[order],
        heading=heading[order],
        drivers=evaluate(asked.landform, {name: v[order] for name, v in values.items()}, len(x), subject),
        law=record(sheet, law, asked.sizes, asked.reach, asked.field),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """What a sheet asks for, checked. given : drivers by the scene. aged : see :func:`_aging`. reach (KNOTS,) [m]: see :func:`_reach`."""

    subject: str
    landform: Landform
    law: Law
    sizes: Sizes
    given: dict[str, Range]
    aged: Callable[[Array, Array], dict[str, Array]]
    reach: Array
    field: Field


def _asked(
    sheet: PopulationSheet,
    extent: Extent,
    landforms: Mapping[str, Landform],
    placed: Mapping[str, LandformInstance],
    frame: Frame,
    folder: Path,
) -> _Asked:
    """Check a sheet against the register and what is placed."""
    subject = f"population '{sheet.name}'"
    landform = _landform(sheet.landform, landforms, subject)
    law = _law(sheet, subject)
    sizes = _sizes(sheet, law, subject)
    given = ranges(landform, sheet.drivers, subject)
    aged = _aging(landform, law, given, subject)
    largest = float(sizes.knots[-1])
    field = Field(
        region=region(sheet.region, subject) if sheet.region is not None else None,
        extent=extent,
        zones=zones(sheet.exclude, subject, placed, landforms),
        clear=sheet.clear == "footprint",
        density=None if sheet.density is None else make_density(sheet.density, subject, largest, placed, frame, folder),
        margin=sheet.count is None,
    )
    reach = _reach(landform, sizes.knots, given, aged, subject)
    return _Asked(subject=subject, landform=landform, law=law, sizes=sizes, given=given, aged=aged, reach=reach, field=field)


def _sizes(sheet: PopulationSheet, law: Law, subject: str) -> Sizes:
    low, high = (to_si(v, "length", f"diameter of {subject}") for v in sheet.diameter)
    if not 0 < low < high:
        raise InputRefused(f"the diameters of {subject} are [{low:g}, {high:g}] m; write [smallest, largest], both above 0")
    knots = np.geomspace(low, high, KNOTS)
    number = law.number(knots)
    if not number[0] > number[-1] >= 0:
        raise InputRefused(f"the law '{law.name}' of {subject} holds no forms from {low:g} to {high:g} m; take other diameters")
    return Sizes(knots, number - number[-1])


def _poisson(streams: Streams, asked: _Asked) -> tuple[Array, NDArray[np.bool_]]:
    """As many as the law asks for at its densest. Returns diameter, x, y (3, n) [m] of all, and which of them stay (n,)."""
    sizes, reach, field = asked.sizes, asked.reach, asked.field
    width, height = field.sides(reach)
    with np.errstate(over="ignore"):  # too many forms are refused below
        area = width * height
    weight = (area[:-1] + area[1:]) / 2
    steps = (sizes.number[:-1] - sizes.number[1:]) * weight * field.peak
    expected = float(steps.sum())
    if expected > MOST:
        smallest = sizes.knots[int(np.argmax(np.cumsum(steps[::-1])[::-1] <= MOST))]
        raise InputRefused(
            f"{asked.subject} would have about {expected:.2g} forms, more than {MOST:.0e}; raise its smallest diameter "
            f"to {smallest:.2g} m or give it a smaller region"
        )
    count, where, chance = streams
    n = int(count.poisson(expected))
    diameter = sizes.draw(count.random(n), weight)
    r = np.interp(diameter, sizes.knots, reach)
    x, y = field.place(r, where.random(n), where.random(n))
    stays = field.stays(x, y, r, chance.random(n))
    if field.region is None:
        x0, y0, x1, y1 = field.extent
        stays &= np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0.0), np.maximum(np.maximum(y0 - y, y - y1), 0.0)) < r
    return np.array([diameter, x, y]), stays


def _exactly(wanted: int, streams: Streams, asked: _Asked) -> Array:
    """So many, of sizes by the law. Returns diameter, x, y (3, wanted) [m]."""
    sizes, reach, field, subject = asked.sizes, asked.reach, asked.field, asked.subject
    if wanted > MOST:
        raise InputRefused(f"the count of {subject} is {wanted}; at most {MOST:.0e} forms can be placed in one population")
    count, where, chance = streams
    found: list[Array] = []
    missing = wanted
    for _ in range(ROUNDS):
        n = min(max(2 * missing, 1000), MOST)
        diameter = sizes.draw(count.random(n), np.ones(KNOTS - 1))
        r = np.interp(diameter, sizes.knots, reach)
        x, y = field.place(r, where.random(n), where.random(n))
        stays = field.stays(x, y, r, chance.random(n))
        found.append(np.array([diameter[stays], x[stays], y[stays]]))
        missing -= int(stays.sum())
        if missing <= 0:
            return np.concatenate(found, axis=1)[:, :wanted]
    raise InputRefused(
        f"{subject} asks for {wanted} forms, but its region, zones and density leave room for {wanted - missing} of {ROUNDS} rounds of "
        "drawing; widen its region or lower its count"
    )


def _landform(name: str, landforms: Mapping[str, Landform], subject: str) -> Landform:
    if name not in landforms:
        raise InputRefused(f"{subject} is of '{name}', which is not registered; {nearest_names(name, landforms)}")
    landform = landforms[name]
    fit = [n for n, form in landforms.items() if _fits(form)]
    if name not in fit:
        known = nearest_names("", fit)
        raise InputRefused(f"{subject} is of '{name}', which is not a radial form with a diameter that adds to the ground; {known}")
    return landform


def _fits(form: Landform) -> bool:
    return form.radial is not None and form.blend == "add" and any(driver.name == "diameter" for driver in form.drivers)


def _law(sheet: PopulationSheet, subject: str) -> Law:
    if isinstance(sheet.law, str):
        return make_law(sheet.law, {}, subject)
    given = {name: value for name, value in sheet.law.model_dump().items() if name != "name" and value is not None}
    return make_law(sheet.law.name, given, subject)


def _aging(landform: Landform, law: Law, given: Mapping[str, Range], subject: str) -> Callable[[Array, Array], dict[str, Array]]:
    """(diameter, u) -> the driver that shows how long a form has lain there, u in [0, 1] the share of its time; empty if there is none.

    ``age`` where the landform has it, else ``relief``, unless the scene sets them.
    """
    drivers = {driver.name: driver for driver in landform.drivers}
    if law.surface_age is None:
        return lambda diameter, u: {}
    if "age" in drivers and "age" not in given:
        unit = to_si(f"1 {drivers['age'].unit}", "s", f"driver 'age' of {subject}")
        return lambda diameter, u: {"age": law.exposure(diameter, u)[0] / unit}
    if "relief" in drivers and "relief" not in given:
        relief = drivers["relief"]
        return lambda diameter, u: {"relief": np.clip(relief_of(law.exposure(diameter, u)[1]), relief.lower, relief.upper)}
    return lambda diameter, u: {}


def _reach(
    landform: Landform,
    knots: Array,
    given: dict[str, Range],
    aged: Callable[[Array, Array], dict[str, Array]],
    subject: str,
) -> Array:
    """Largest distance [m] from its centre that a form of each diameter may change, over the lowest and highest other drivers."""
    assert landform.radial is not None
    reach = np.zeros_like(knots)
    for end in (0, 1):
        fixed = {name: np.full_like(knots, bounds[end]) for name, bounds in given.items()}
        fixed |= aged(knots, np.full_like(knots, float(end)))
        drivers: dict[str, Any] = evaluate(landform, {"diameter": knots, **fixed}, len(knots), subject)
        a, b = landform.radial.semi_axes(drivers)
        reach = np.maximum(reach, landform.radial.reach * np.maximum(a, b))
    return reach


def _heading(sheet: PopulationSheet, subject: str, u: Array) -> Array:
    if sheet.heading is None:
        return 2 * math.pi * u
    low, high = value_range(sheet.heading, "rad", f"heading of {subject}")
    return low + (high - low) * u
