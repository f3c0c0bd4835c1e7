"""Drivers of a profile that names none: its sizes, which default to what was drawn."""

from typing import Any

import numpy as np

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.terrain.landform import Driver
from rille.terrain.own.profile import point_array
from rille.terrain.own.sheet import OwnSheet
from rille.terrain.own.term import term

TIMES = 100.0  # how much it may be enlarged or reduced in plan
STRETCH = 10 * TIMES  # and in height


def own_size(sheet: OwnSheet, subject: str) -> tuple[Driver, ...]:
    """``diameter`` (or ``width`` and ``length``) and ``height`` of points in metres; none for a formula.

    Raises
    ------
    InputRefused : if the points have another unit, or no size.
    """
    if sheet.radial is not None:
        table, across = sheet.radial, "diameter"
    elif sheet.section is not None:
        table, across = sheet.section, "width"
    else:
        return ()
    if getattr(table, "radius", "1 m") != "1 m" or getattr(table, "width", "1 m") != "1 m" or table.height != "1 m":
        raise InputRefused(f"{subject} states the unit of its points but has no driver; write the points in metres, or add a [[driver]]")
    wide, high = _extent(table.points, f"points of {subject}", centred=across == "diameter")
    if not (wide > 0 and high > 0):
        raise InputRefused(f"the points of {subject} span {wide:g} m and a height of {high:g} m; both must be above 0")
    drivers = [size_driver(across, "size across", wide)]
    if sheet.section is not None:
        drivers.append(size_driver("length", "size along y", to_si(sheet.section.length, "length", f"length of {subject}")))
    drivers.append(height_driver("largest height or depth; negative: upside down", high, across, wide, mirrored=True))
    return tuple(drivers)


def in_own_size(points: list[list[Any]], *, centred: bool) -> dict[str, str]:
    """Units of the points, as formulas of the drivers of :func:`own_size`."""
    wide, high = _extent(points, "points", centred=centred)
    across = {"radius": f"diameter / {wide!r}"} if centred else {"width": f"width / {wide!r}"}
    return across | {"height": f"height / {high!r}"}


def size_driver(name: str, meaning: str, size: float) -> Driver:
    """A length that may be changed ``TIMES`` times either way."""
    return Driver(
        name=name,
        unit="m",
        meaning=meaning,
        lower=size / TIMES,
        upper=TIMES * size,
        default=size,
        reason=f"at most {TIMES:g} times larger or smaller than its own",
        source="its own size",
    )


def height_driver(meaning: str, size: float, across: str, wide: float, *, mirrored: bool) -> Driver:
    """A height that follows the driver ``across``, which is ``wide`` as drawn; ``mirrored``: it may be below zero."""
    law = f"{size!r} * {across} / {wide!r}"
    return Driver(
        name="height",
        unit="m",
        meaning=meaning,
        lower=-STRETCH * size if mirrored else size / STRETCH,
        upper=STRETCH * size,
        link=term(law, "length", [across], "link of height"),
        law=law,
        reason=f"at most {STRETCH:g} times " + ("its own" if mirrored else "larger or smaller than its own"),
        source="its own shape",
    )


def _extent(points: list[list[Any]], what: str, *, centred: bool) -> tuple[float, float]:
    values = point_array(points, what)
    wide = 2 * values[-1, 0] if centred else values[-1, 0] - values[0, 0]
    return float(wide), float(np.abs(values[:, 1]).max())
