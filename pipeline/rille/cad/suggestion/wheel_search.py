"""Wheels among the groups of an assembly: round, balanced, on a hinge, and free to touch a ground."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.cad.collision.symmetry import RotationalSymmetry, rotational_symmetry
from rille.cad.files.assembly import Assembly
from rille.cad.suggestion.contact import COAXIAL, PlacedSolid
from rille.cad.suggestion.grouping import SMALL, Grouping, Line, outer_radius
from rille.cad.suggestion.mobility import positive
from rille.cad.suggestion.wording import mm

Array = NDArray[np.float64]

BALANCED = 0.02  # of a part's size: a wheel's centre of volume is nearer to its axis
ALIKE = 0.01  # relative: radii of wheels that are meant to be the same
_WHEEL = re.compile(r"wheel|tyre|tire|rad(?![a-z])|rim(?![a-z])|roue", re.IGNORECASE)


@dataclass(slots=True, kw_only=True, eq=False)
class Wheel:
    """A wheel of a group: the instance that is its rim, its symmetry, centre [m] and axis in the assembly's frame."""

    group: int
    instance: int
    symmetry: RotationalSymmetry
    center: Array
    axis: Array
    evidence: list[str]
    confidence: float = 0.0

    @property
    def line(self) -> Line:
        """Its axis."""
        return Line(point=self.center, axis=self.axis)


class WheelSearch:
    """Looks for wheels; symmetries are found once per part. before : a search in other groups of the same assembly."""

    def __init__(self, assembly: Assembly, grouping: Grouping, before: "WheelSearch | None" = None) -> None:
        self.assembly = assembly
        self.g = grouping
        self.symmetries: dict[int, RotationalSymmetry | None] = before.symmetries if before else {}

    def find(self, group: int, holder: int, line: Line, radius: float) -> Wheel | None:
        """The wheel of a group that is hinged to ``holder`` on a line by a shaft of some radius [m]; None if it has none."""
        best = max(self._round_parts(group, line), key=lambda one: one.symmetry.radius, default=None)
        if best is None or best.symmetry.rim_radius < 1.5 * radius or not self.is_wheel_sized(best.symmetry):
            return None
        return best if self._is_free(best, holder) else None

    def is_wheel_sized(self, symmetry: RotationalSymmetry) -> bool:
        """Whether something round is neither tiny beside its machine nor a roller."""
        return symmetry.rim_radius >= 0.02 * self.g.size and symmetry.width <= 3 * symmetry.radius

    def on_its_axle(self, wheel: Wheel) -> list[Wheel]:
        """Other parts of a wheel's group that are as large and far along its axis: wheels that are fixed to one axle with it."""
        return [
            one
            for one in self._round_parts(wheel.group, wheel.line)
            if abs(one.symmetry.radius - wheel.symmetry.radius) < ALIKE * wheel.symmetry.radius
            and float(np.linalg.norm(one.center - wheel.center)) > 2 * wheel.symmetry.radius
        ]

    def _round_parts(self, group: int, line: Line) -> Iterator[Wheel]:
        """Parts of a group that are round about a line and balanced."""
        for instance in sorted({self.g.bodies[i].instance for i in self.g.members[group] if self.g.bodies[i].size > SMALL * self.g.size}):
            if self._middle_off(instance, line) > BALANCED:
                continue
            wheel = self.round_part(group, instance)
            if wheel is not None and np.linalg.norm(np.cross(wheel.axis, line.axis)) < 5e-3 and line.distance(wheel.center) < 5 * COAXIAL:
                yield wheel

    def round_part(self, group: int, instance: int) -> Wheel | None:
        """An instance as a wheel of a group, if it is round about an axis and balanced."""
        placed = self.assembly.instances[instance]
        symmetry = self._symmetry(placed.prototype)
        if symmetry is None or not symmetry.round:
            return None
        center = placed.matrix[:3, :3] @ symmetry.point + placed.matrix[:3, 3]
        axis = positive(placed.matrix[:3, :3] @ symmetry.axis)
        wheel = Wheel(group=group, instance=instance, symmetry=symmetry, center=center, axis=axis, evidence=[])
        return wheel if self._middle_off(instance, wheel.line) <= BALANCED else None

    def _middle_off(self, instance: int, line: Line) -> float:
        """Distance of the centre of volume from a line, over the part's size."""
        placed = self.assembly.instances[instance]
        prototype = self.assembly.prototypes[placed.prototype]
        middle = placed.matrix[:3, :3] @ prototype.volume.com + placed.matrix[:3, 3]
        return line.distance(middle) / float(np.linalg.norm(prototype.bounds[1] - prototype.bounds[0]))

    def _symmetry(self, prototype: int) -> RotationalSymmetry | None:
        if prototype not in self.symmetries:
            self.symmetries[prototype] = rotational_symmetry(self.assembly.prototypes[prototype].shape)
        return self.symmetries[prototype]

    def _is_free(self, wheel: Wheel, holder: int) -> bool:
        """Whether the rim is the outermost of its group, touches nothing else, and can reach a ground on some side."""
        if any(other != holder for other in self.g.neighbours[wheel.group]):
            return False
        rim = wheel.line
        if any(outer_radius(self.g.bodies[i], rim) > 1.02 * wheel.symmetry.radius for i in self.g.members[wheel.group]):
            return False
        outside = [i for i in range(len(self.g.bodies)) if self.g.group[i] != wheel.group]
        if any(self._meshes(i, rim, wheel) for i in outside):
            return False
        rest = [self.g.bodies[i] for i in outside]
        basis = np.linalg.svd(wheel.axis[None])[2][1:]
        for angle in np.linspace(0, 2 * math.pi, 24, endpoint=False):
            down = math.cos(angle) * basis[0] + math.sin(angle) * basis[1]
            reach = float(down @ wheel.center) + wheel.symmetry.radius
            if not any(_crosses(b, wheel, down, reach) for b in rest):
                return True
        return False

    def _meshes(self, i: int, rim: Line, wheel: Wheel) -> bool:
        """Whether the circle of another turned part on a parallel axis cuts the rim's: gears, friction wheels."""
        body, spin = self.g.bodies[i], self.g.spin[i]
        if spin is None or np.linalg.norm(np.cross(spin.axis, rim.axis)) > 5e-3 or rim.same(spin):
            return False
        reach = (body.high - body.low) @ np.abs(rim.axis) / 2
        apart = abs(float(((body.low + body.high) / 2 - wheel.center) @ rim.axis))
        beside = apart > reach + wheel.symmetry.width / 2
        outer = outer_radius(body, spin)
        return not beside and abs(outer - wheel.symmetry.radius) < rim.distance(spin.point) < outer + wheel.symmetry.radius

    def judge(self, wheel: Wheel, others: list[Wheel]) -> None:
        """Set the evidence and the confidence of a wheel, seen beside all wheels."""
        s = wheel.symmetry
        kind = "a body of revolution" if s.order == 0 else f"{s.order}-fold symmetric" if s.order > 1 else "round outside"
        wheel.evidence.append(f"{kind} about the hinge axis, rim {mm(2 * s.rim_radius)} x {mm(s.width)}, free to touch a ground")
        weights = [0.3]
        twins = [w for w in others if abs(w.symmetry.radius - s.radius) < ALIKE * s.radius and abs(abs(w.axis @ wheel.axis) - 1) < 0.01]
        if len(twins) > 1:
            wheel.evidence.append(f"{len(twins)} of this size have parallel axes")
            weights.append(0.4 if len(twins) < 4 else 0.55)
        if s.grouser_count:
            wheel.evidence.append(f"{s.grouser_count} grousers {mm(s.grouser_height)} high and {mm(s.grouser_thickness)} thick")
            weights.append(0.35)
        path = self.assembly.instances[wheel.instance].path
        if _WHEEL.search(path.rsplit("/", 1)[-1]) or _WHEEL.search(
            self.assembly.prototypes[self.assembly.instances[wheel.instance].prototype].name
        ):
            wheel.evidence.append("it is called a wheel")
            weights.append(0.4)
        wheel.confidence = 1 - math.prod(1 - w for w in weights)


def _crosses(body: PlacedSolid, wheel: Wheel, down: Array, reach: float) -> bool:
    """Whether a solid's box reaches below the tangent plane at ``down`` within the wheel's own width and length."""
    corners = body.corners
    if float((corners @ down).max()) < reach - 1e-6:
        return False
    along = (corners - wheel.center) @ wheel.axis
    across = (corners - wheel.center) @ np.cross(wheel.axis, down)
    half = wheel.symmetry.width / 2
    beside = along.max() < -half or along.min() > half
    ahead = across.max() < -wheel.symmetry.radius or across.min() > wheel.symmetry.radius
    return not beside and not ahead
