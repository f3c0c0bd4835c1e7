"""Profiles of a TOML file as functions: radial, section, formula."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.terrain.landform import Profile, Radial, Values, smooth_step
from rille.terrain.own.curve import check_points, curve
from rille.terrain.own.formula import parse_formula
from rille.terrain.own.sheet import FormulaSheet, RadialSheet, SectionSheet
from rille.terrain.own.term import Term, positive, term

Array = NDArray[np.float64]
Footprint = Callable[[Values], tuple[float, float]]

LARGEST = 1e9  # coordinate of a point, in its unit
CORNERS = 48  # of the outline of a round form


def radial_form(sheet: RadialSheet, names: list[str], subject: str, *, steep: bool, faded: bool) -> tuple[Radial, Footprint]:
    """z = height * curve(r / radius), r the distance from the origin [m]; the points hold no drivers, so a population is stamped fast."""
    what = f"points of {subject}"
    points = check_points(point_array(sheet.points, what), what, centred=True, steep=steep, flat=faded)
    radius = positive(term(sheet.radius, "length", names, f"radius of {subject}"), f"radius of {subject}")
    height = term(sheet.height, "length", names, f"height of {subject}")
    shape = curve(points, sheet.interpolation, centred=True)
    reach = float(points[-1, 0])

    def semi_axes(drivers: Mapping[str, Any]) -> tuple[Any, Any]:
        return radius(drivers), radius(drivers)

    def footprint(drivers: Values) -> tuple[float, float]:
        half = reach * float(radius(drivers))
        return half, half

    return Radial(semi_axes=semi_axes, amplitude=height, shape=lambda r, state: shape(r), reach=reach), footprint


def circle(footprint: Footprint) -> Callable[[Values], Array]:
    """Outline of a round form."""
    around = np.arange(CORNERS) * (2 * np.pi / CORNERS)
    return lambda drivers: footprint(drivers)[0] * np.column_stack([np.cos(around), np.sin(around)])


def section_form(sheet: SectionSheet, names: list[str], subject: str, *, steep: bool, faded: bool) -> tuple[Profile, Footprint]:
    """z = height * curve(x / width) * s((length / 2 - |y|) / fade), s the smooth step; fade: a fifth of the length unless given."""
    what = f"points of {subject}"
    points = check_points(point_array(sheet.points, what), what, centred=False, steep=steep, flat=faded)
    length, width = (
        positive(term(value, "length", names, f"{key} of {subject}"), f"{key} of {subject}")
        for key, value in (("length", sheet.length), ("width", sheet.width))
    )
    height = term(sheet.height, "length", names, f"height of {subject}")
    given = None if sheet.fade is None else positive(term(sheet.fade, "length", names, f"fade of {subject}"), f"fade of {subject}")
    fade: Term = given or (lambda drivers: 0.2 * length(drivers))
    shape = curve(points, sheet.interpolation, centred=False)
    reach = float(np.abs(points[:, 0]).max())

    def profile(x: Array, y: Array, drivers: Values) -> Array:
        ends = smooth_step((length(drivers) / 2 - np.abs(y)) / fade(drivers))
        return height(drivers) * shape(x / width(drivers)) * ends

    return profile, lambda drivers: (reach * float(width(drivers)), float(length(drivers)) / 2)


def formula_form(sheet: FormulaSheet, names: list[str], subject: str) -> tuple[Profile, Footprint, bool]:
    """z = formula(x, y, r, drivers) inside the footprint, r = |(x, y)|; over ``fade`` inside its border it goes to zero smoothly.

    Returns
    -------
    profile, footprint, and whether it is round.
    """
    clash = sorted({"x", "y", "r"} & set(names))
    if clash:
        raise InputRefused(f"{subject} has a driver '{clash[0]}', which is a coordinate in its formula; rename the driver")
    formula = parse_formula(sheet.height, [*names, "x", "y", "r"], f"height of {subject}")
    fade = term(sheet.fade, "length", names, f"fade of {subject}")
    round_ = sheet.radius is not None
    if round_ == (sheet.half_x is not None) or (sheet.half_x is None) != (sheet.half_y is None):
        raise InputRefused(f"[formula] of {subject} needs its footprint: either `radius`, or `half_x` and `half_y`")
    stated = {"radius": sheet.radius} if round_ else {"half_x": sheet.half_x, "half_y": sheet.half_y}
    halves = [
        positive(term(value, "length", names, f"{key} of {subject}"), f"{key} of {subject}")
        for key, value in stated.items()
        if value is not None
    ]

    def footprint(drivers: Values) -> tuple[float, float]:
        return float(halves[0](drivers)), float(halves[-1](drivers))

    def profile(x: Array, y: Array, drivers: Values) -> Array:
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        half_x, half_y = footprint(drivers)
        r = np.hypot(x, y)
        across = half_x - r if round_ else np.minimum(half_x - np.abs(x), half_y - np.abs(y))
        inside = across >= 0
        heights = np.zeros(x.shape)
        heights[inside] = formula({**drivers, "x": x[inside], "y": y[inside], "r": r[inside]})
        if not np.isfinite(heights).all():
            k = int(np.argmin(np.isfinite(heights)))
            where = f"x = {x.flat[k]:g} m, y = {y.flat[k]:g} m"
            raise InputRefused(f'height of {subject}, "{sheet.height}", is not finite at {where}; change the formula or its footprint')
        over = float(fade(drivers))
        return heights * smooth_step(across / over) if over > 0 else heights

    return profile, footprint, round_


def point_array(points: list[list[Any]], what: str) -> Array:
    """Points (n, 2); refused unless each is two numbers that can be reckoned with."""
    for k, point in enumerate(points):
        if len(point) != 2 or not all(isinstance(v, int | float) for v in point):
            raise InputRefused(f"{what} have {point!r} at point {k + 1}; give two numbers, and the unit by `radius`, `width` and `height`")
    values = np.array(points, np.float64)
    if not (np.abs(values) <= LARGEST).all():
        k = int(np.argmin(np.abs(values) <= LARGEST))
        raise InputRefused(f"{what} hold {values.flat[k]:g} at point {k // 2 + 1}; give numbers up to {LARGEST:.0e}")
    return values
