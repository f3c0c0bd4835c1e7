"""Wheels that no bearing holds: what a machine evidently stands on, drawn beside its leg, against it or into it.

Many drawings leave bearings out. Contacts then show no hinge, or make wheel and leg one body. A part is taken for such a wheel if it is
round and balanced, reaches as far as anything else of the machine on one side along an axis of the drawing, turns about a line across
that direction, and shape, twins, grousers and name make it a wheel (``WheelSearch.judge``) though no hinge was found on its axis.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.cad.suggestion.contact import PARALLEL, Contact
from rille.cad.suggestion.grouping import LARGER, SMALL, Grouping, Line, outer_radius
from rille.cad.suggestion.values import SuggestedJoint
from rille.cad.suggestion.wheel_search import Wheel, WheelSearch

Array = NDArray[np.float64]

SURE = 0.6  # confidence of a wheel that stands for itself: four alike, or two that are called so
REACH = 0.1  # of its radius: how far a wheel may stay behind what reaches furthest
DIRECTIONS = np.array([[0, 0, -1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0], [0, 0, 1]], dtype=float)  # the likeliest down first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnheldWheel:
    """A wheel without a bearing: its axis, and the solids (indices) that turn with it."""

    line: Line
    solids: frozenset[int]


def unheld_wheels(search: WheelSearch, found: Iterable[SuggestedJoint]) -> list[UnheldWheel]:
    """Wheels on which a machine stands and which none of the joints ``found`` turns about their axis."""
    held = [(set(j.moving), Line(point=j.point, axis=j.axis)) for j in found if j.kind == "hinge"]

    def is_held(wheel: Wheel) -> bool:
        return any(wheel.instance in moving and line.same(wheel.line) for moving, line in held)

    return [UnheldWheel(line=w.line, solids=_turning(search.g, w)) for w in _standing(search) if not is_held(w)]


def without_holders(wheels: Sequence[UnheldWheel], contacts: Iterable[Contact]) -> list[Contact]:
    """Contacts without those between a wheel and what does not turn with it."""
    return [c for c in contacts if not any((c.first in w.solids) != (c.second in w.solids) for w in wheels)]


def _standing(search: WheelSearch) -> list[Wheel]:
    """What the machine stands on, on the side on which most wheels stand."""
    best: list[Wheel] = []
    for down in DIRECTIONS:
        wheels = list(_lowest(search, down))
        for wheel in wheels:
            search.judge(wheel, wheels)
        sure = [w for w in wheels if w.confidence >= SURE]
        best = max(best, sure, key=len)
    return best


def _lowest(search: WheelSearch, down: Array) -> Iterable[Wheel]:
    """Round parts on level axes that reach as far down as anything."""
    bodies = search.g.bodies
    reach = [float((b.corners @ down).max()) for b in bodies]
    lowest = max(reach)
    low = [i for i, b in enumerate(bodies) if b.size > SMALL * search.g.size and reach[i] > lowest - REACH * b.size]
    for instance, group in sorted({bodies[i].instance: search.g.group[i] for i in low}.items()):
        wheel = search.round_part(group, instance)
        if wheel is None or not search.is_wheel_sized(wheel.symmetry) or abs(float(wheel.axis @ down)) > PARALLEL:
            continue
        if float(wheel.center @ down) + wheel.symmetry.radius > lowest - REACH * wheel.symmetry.radius:
            yield wheel


def _turning(grouping: Grouping, wheel: Wheel) -> frozenset[int]:
    """Solids of a wheel, and what touches them and lies within its rim: tyre, spokes, hub, axle."""
    line, half = wheel.line, wheel.symmetry.width / 2
    inside = {
        i
        for i, body in enumerate(grouping.bodies)
        if body.instance == wheel.instance
        or (outer_radius(body, line) < LARGER * wheel.symmetry.radius and abs(float((body.center - wheel.center) @ wheel.axis)) < half)
    }
    found = {i for i in inside if grouping.bodies[i].instance == wheel.instance}
    while True:
        beside = {one for c in grouping.contacts for one in (c.first, c.second) if {c.first, c.second} & found} & inside
        if beside <= found:
            return frozenset(found)
        found |= beside
