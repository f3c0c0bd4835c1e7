"""Where a population may stand: its region, and the zones that are kept clear."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, LandformInstance, nearest_names
from rille.model.polygon import is_simple
from rille.model.quantity import to_si
from rille.terrain.landform import Landform

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Disc:
    """x, y, radius [m] in W."""

    x: float
    y: float
    radius: float

    def distance(self, x: Array, y: Array) -> Array:
        """Distance [m] of points (n,) to it; 0 inside."""
        return np.maximum(np.hypot(x - self.x, y - self.y) - self.radius, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polygon:
    """corners (n, 2) [m] in W."""

    corners: Array

    @property
    def box(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max [m]."""
        (x0, y0), (x1, y1) = self.corners.min(axis=0), self.corners.max(axis=0)
        return float(x0), float(y0), float(x1), float(y1)

    def distance(self, x: Array, y: Array) -> Array:
        """Distance [m] of points (n,) to it; 0 inside."""
        nearest, inside = np.full(np.shape(x), np.inf), np.zeros(np.shape(x), bool)
        for (x0, y0), (x1, y1) in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            dx, dy = x1 - x0, y1 - y0
            along = np.clip(((x - x0) * dx + (y - y0) * dy) / max(dx * dx + dy * dy, 1e-300), 0.0, 1.0)
            nearest = np.minimum(nearest, (x - x0 - along * dx) ** 2 + (y - y0 - along * dy) ** 2)
            if dy != 0:  # even-odd rule: edges that cross the point's parallel to x, east of it
                inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (dx / dy))
        return np.where(inside, 0.0, np.sqrt(nearest))


Zone = Disc | Polygon


def box(x_min: float, y_min: float, x_max: float, y_max: float) -> Polygon:
    """A rectangle along the axes of W."""
    return Polygon(corners=np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]]))


def region(given: list[Any], subject: str) -> Polygon:
    """The region of a population: four numbers are a box, pairs are corners.

    Raises
    ------
    InputRefused : if it is neither, or has no area.
    """
    if len(given) == 4 and not any(isinstance(v, list) for v in given):
        x0, y0, x1, y1 = (to_si(v, "length", f"region of {subject}") for v in given)
        if x0 >= x1 or y0 >= y1:
            raise InputRefused(f"the region of {subject} is [{x0:g}, {y0:g}, {x1:g}, {y1:g}]; write [x_min, y_min, x_max, y_max] in metres")
        return box(x0, y0, x1, y1)
    return _polygon(given, f"the region of {subject}")


def zones(given: Iterable[Any], subject: str, placed: Mapping[str, LandformInstance], register: Mapping[str, Landform]) -> list[Zone]:
    """The zones to be kept clear: discs, polygons, and footprints of landforms placed by name.

    Raises
    ------
    InputRefused : for a zone that is none of these, or a name that no landform has.
    """
    found: list[Zone] = []
    for number, zone in enumerate(given, 1):
        what = f"zone {number} of {subject}"
        if isinstance(zone, str):
            if zone not in placed:
                raise InputRefused(f"{what} is '{zone}', and no landform is called so; {nearest_names(zone, placed)}")
            found.append(_footprint(placed[zone], register))
        elif isinstance(zone, list) and len(zone) == 3 and not any(isinstance(v, list) for v in zone):
            x, y, radius = (to_si(v, "length", what) for v in zone)
            if radius <= 0:
                raise InputRefused(f"{what} has the radius {radius:g} m; it must be above 0 in [x, y, radius]")
            found.append(Disc(x=x, y=y, radius=radius))
        else:
            found.append(_polygon(zone, what))
    return found


def _polygon(given: Any, what: str) -> Polygon:
    if not isinstance(given, list) or len(given) < 3 or any(not isinstance(p, list) or len(p) != 2 for p in given):
        raise InputRefused(f"{what} is {given!r}; write at least three corners [[x, y], [x, y], [x, y]] in metres")
    corners = np.array([[to_si(x, "length", what), to_si(y, "length", what)] for x, y in given])
    if not is_simple(corners):
        raise InputRefused(f"{what} crosses itself or has no area; list its corners in order around it")
    return Polygon(corners=corners)


def _footprint(instance: LandformInstance, register: Mapping[str, Landform]) -> Polygon:
    half_x, half_y = (half * instance.scale for half in register[instance.landform].footprint(instance.drivers))
    c, s = math.cos(instance.heading), math.sin(instance.heading)
    corners = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    return Polygon(corners=corners @ np.array([[c, s], [-s, c]]) + [instance.x, instance.y])
