"""Which solids move together: rigid groups, found by mobility analysis of the contacts between them.

1. Solids that overlap, or are held by two or more aligned holes, are one group.
2. Two groups are one if their contacts leave nothing free (:mod:`rille.cad.suggestion.mobility`): two plates on two screws cannot move.
3. A screw, pin, shaft or bearing whose contacts all lie on one axis spins idly: it joins the neighbour that holds it tightest.
   Two hinges in a row on one axis through such a part are one hinge.
4. What only touches without anything analytic joins the neighbour with the largest contact, unless that would lock a joint.

A bolt circle about the axis of a round face is left open as a *flange*: that is how the output of an actuator looks whose rotor is
drawn as one with its housing.
"""

import itertools
import re
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rille.cad.suggestion.contact import COAXIAL, PARALLEL, AlignedHoles, Ball, Contact, FaceContact, Fit, PlacedSolid, is_ball
from rille.cad.suggestion.mobility import Mobility, ball_rows, cylinder_rows, face_rows, mobility

Array = NDArray[np.float64]

WELDED = 1e-4  # [m] solids that overlap thicker than this are drawn into each other: one piece
SMALL = 0.05  # of the assembly's size: what is smaller and carries nothing is no moving body of its own
LARGER = 1.02  # times: sizes that differ by less are alike
ACROSS = 0.999  # cosine: a face whose normal is nearer to an axis lies across it
TURNED = 0.6  # share of a solid's cylindrical area on one axis that makes it a turned part
FASTENER_WORDS = re.compile(
    r"screw|bolt|nut(?![a-z])|washer|rivet|dowel|circlip|schraube|mutter|scheibe|\bdin[ _]?\d|\biso[ _]?\d|\bm\d+ ?x ?\d", re.IGNORECASE
)


@dataclass(slots=True, kw_only=True, eq=False)
class Line:
    """Fits (or aligned holes) on one axis between two groups. bolts : whether each of them is a fastener's."""

    point: Array
    axis: Array
    fits: list[Fit] = field(default_factory=list)
    bolts: bool = True

    def distance(self, point: Array) -> float:
        """Of a point from the line [m]."""
        return float(np.linalg.norm(np.cross(point - self.point, self.axis)))

    def same(self, other: "Line") -> bool:
        """Whether two lines are one axis."""
        if np.linalg.norm(np.cross(self.axis, other.axis)) > PARALLEL:
            return False
        return max(self.distance(other.point), other.distance(self.point)) < 2 * COAXIAL


@dataclass(slots=True, kw_only=True, eq=False)
class Between:
    """Everything between two groups: axes of fits, faces, balls, flange (its axis, if the bolts are a circle about a round face)."""

    lines: list[Line] = field(default_factory=list)
    faces: list[FaceContact] = field(default_factory=list)
    balls: list[Ball] = field(default_factory=list)
    unexplained: int = 0
    flange: Line | None = None
    bolt_circle: tuple[int, float] = (0, 0.0)
    contacts: list[Contact] = field(default_factory=list)

    @property
    def area(self) -> float:
        """Area of the faces in contact [m^2]."""
        return sum(f.area for f in self.faces)


class Grouping:
    """Solids in rigid groups. ``group[i]`` is the group of solid i, a group is named by its first solid."""

    def __init__(self, bodies: list[PlacedSolid], contacts: list[Contact]) -> None:
        self.bodies = bodies
        self.contacts = contacts
        self.group = list(range(len(bodies)))
        self.members: dict[int, list[int]] = {i: [i] for i in range(len(bodies))}
        self.spin = [spin_axis(b) for b in bodies]
        self.neighbours: dict[int, dict[int, list[Contact]]] = defaultdict(dict)
        for c in contacts:
            self._link(c.first, c.second, [c])
        self.size = float(np.linalg.norm(np.max([b.high for b in bodies], axis=0) - np.min([b.low for b in bodies], axis=0)))
        self.fastener = [self._is_fastener(i) for i in range(len(bodies))]
        self._cache: dict[tuple[int, int], Between] = {}

    def _link(self, a: int, b: int, contacts: list[Contact]) -> None:
        self.neighbours[a].setdefault(b, []).extend(contacts)
        self.neighbours[b].setdefault(a, []).extend(contacts)

    def merge(self, a: int, b: int) -> int:
        """Make two groups one; returns its name."""
        a, b = self.group[a], self.group[b]
        if a == b:
            return a
        a, b = min(a, b), max(a, b)
        for i in self.members[b]:
            self.group[i] = a
        self.members[a] += self.members.pop(b)
        for other, contacts in self.neighbours.pop(b).items():
            self.neighbours[other].pop(b, None)
            if other != a:
                self._link(a, other, contacts)
        self._cache = {k: v for k, v in self._cache.items() if a not in k and b not in k}
        return a

    def pairs(self) -> list[tuple[int, int]]:
        """Groups that meet."""
        return sorted({(min(a, b), max(a, b)) for a, others in self.neighbours.items() for b in others})

    def between(self, a: int, b: int) -> Between:
        """Everything between two groups."""
        key = (min(a, b), max(a, b))
        if key not in self._cache:
            self._cache[key] = self._gather(a, b)
        return self._cache[key]

    def volume(self, group: int) -> float:
        """Of the solids of a group [m^3]."""
        return sum(self.bodies[i].volume for i in self.members[group])

    def extent(self, group: int) -> float:
        """Diagonal of a group's bounding box [m]."""
        low = np.min([self.bodies[i].low for i in self.members[group]], axis=0)
        high = np.max([self.bodies[i].high for i in self.members[group]], axis=0)
        return float(np.linalg.norm(high - low))

    def mobility(self, a: int, b: int) -> Mobility:
        """What the contacts between two groups leave free."""
        return mobility_of(self.between(a, b))

    # --- the steps

    def solve(self) -> None:
        """Merge until only joints and loose neighbours are left."""
        self._weld()
        self._lock_and_idle(small_only=True)
        self._glue(first=True)
        self._lock_and_idle(small_only=False)
        self._glue(first=False)
        self._lock_and_idle(small_only=False)
        self._join_axle_ends()
        self._drop_leaves()

    def _weld(self) -> None:
        for c in self.contacts:
            if self._is_weld(c):
                self.merge(c.first, c.second)

    def _is_weld(self, c: Contact) -> bool:
        if c.thickness < WELDED or c.overlap < 1e-3 * min(self.bodies[c.first].volume, self.bodies[c.second].volume):
            return False
        if any(f.clearance <= 0 for f in c.fits):
            return any(f.clearance < -0.01 * f.hole for f in c.fits) and (self.fastener[c.first] or self.fastener[c.second])
        return not self.is_rolling(c)

    def is_rolling(self, c: Contact) -> bool:
        """Two round parts on parallel axes beside each other: gears, rollers."""
        one, other = self.spin[c.first], self.spin[c.second]
        if one is None or other is None or np.linalg.norm(np.cross(one.axis, other.axis)) > PARALLEL:
            return False
        radii = sorted((outer_radius(self.bodies[c.first], one), outer_radius(self.bodies[c.second], other)))
        return radii[0] > 0.1 * radii[1] and one.distance(other.point) > 0.85 * sum(radii)

    def _lock_and_idle(self, small_only: bool) -> None:
        while self._merge_locked() or self._merge_idle(small_only):
            pass

    def _merge_locked(self) -> bool:
        merged = False
        for a, b in self.pairs():
            if b not in self.neighbours.get(a, {}):
                continue
            if self.mobility(a, b).kind == "locked":
                self.merge(a, b)
                merged = True
        return merged

    def _merge_idle(self, small_only: bool) -> bool:
        """Attach the smallest idle part to the neighbour that holds it tightest."""
        for group in sorted(self.members, key=self.extent):
            axis = self.group_spin(group)
            if axis is None or (small_only and not all(self.fastener[i] for i in self.members[group])):
                continue
            around = list(self.neighbours[group])
            held = [n for n in around if self.between(group, n).lines]
            beside = [n for n in around if n not in held]
            if not held or not all(self._spins_in(group, n, axis) for n in around) or (len(around) < 2 and not small_only):
                continue
            if any((spin := self.group_spin(n)) is None or not spin.same(axis) for n in beside):
                continue  # what lies on its face may turn with it: a bracket on a servo's horn
            best = max(held, key=lambda n: self._tightness(group, n))
            for other in [best, *self._as_tight(group, best, held)]:
                group = self.merge(group, other)
            return True
        return False

    def _as_tight(self, group: int, best: int, held: list[int]) -> list[int]:
        """Other holders that fit as close as the best one, where a larger part runs on the group with more clearance.

        A rod fits closely in both its end blocks, and the carriage runs on it.
        """
        limit = self._clearance(group, best) + 5e-6
        running = [n for n in held if self._clearance(group, n) > limit and self.group_spin(n) is None]
        large = max((self.volume(n) for n in running), default=0.0)
        return [n for n in held if n != best and self._clearance(group, n) <= limit and self.volume(n) < large]

    def _clearance(self, group: int, other: int) -> float:
        return min((f.clearance for line in self.between(group, other).lines for f in line.fits), default=0.0)

    def group_spin(self, group: int) -> Line | None:
        """The axis about which all members of a group (without its fasteners and balls) are turned, None if there is none."""
        found: Line | None = None
        for i in self._shape(group):
            own = self.spin[i]
            if own is None or (found is not None and not found.same(own)):
                return None
            found = own
        return found

    def is_round(self, group: int) -> bool:
        """Whether a group is turned about one axis and round outside, so that its turning changes nothing that is seen."""
        axis = self.group_spin(group)
        return axis is not None and all(round_outside(self.bodies[i], axis) for i in self._shape(group))

    def _shape(self, group: int) -> list[int]:
        """What gives a group its shape: its members without fasteners and balls, if there are others."""
        return [i for i in self.members[group] if not self.fastener[i] and not is_ball(self.bodies[i])] or self.members[group]

    def _spins_in(self, group: int, other: int, axis: Line) -> bool:
        """Whether a turned group can spin about its axis with all its contacts to another one."""
        between = self.between(group, other)
        if between.flange is not None:
            return between.flange.same(axis)
        if any(not line.same(axis) for line in between.lines) or between.balls or between.unexplained:
            return False
        return all(np.linalg.norm(np.cross(f.normal, axis.axis)) < 10 * PARALLEL for f in between.faces)

    def _tightness(self, group: int, other: int) -> tuple[float, ...]:
        """Order of preference: bolted or pressed, drawn in one sub-assembly, the closer fit, the larger faces."""
        between = self.between(group, other)
        clearance = self._clearance(group, other)
        pressed = between.flange is not None or clearance < -1e-5
        return float(pressed), float(self.kinship(group, other)), -round(max(clearance, 0.0) / 1e-5), between.area

    def kinship(self, a: int, b: int) -> int:
        """Depth of the sub-assembly that two groups share."""
        best = 0
        for one in {self.bodies[i].path.rsplit("/", 1)[0] for i in self.members[a]}:
            for other in {self.bodies[i].path.rsplit("/", 1)[0] for i in self.members[b]}:
                common = itertools.takewhile(lambda p: p[0] == p[1], zip(one.split("/"), other.split("/"), strict=False))
                best = max(best, sum(1 for _ in common))
        return best

    def _glue(self, first: bool) -> None:
        """Join groups whose contact neither locks nor guides, strongest contact first, unless that would lock a joint.

        The first time only what is drawn together (one part, one sub-assembly), or has flat contact and no third part that guides one
        of the two: a bracket on a servo's horn also lies on the servo's case.
        """
        while True:
            candidates = []
            for a, b in self.pairs():
                between = self.between(a, b)
                if between.lines or between.balls or self.mobility(a, b).kind != "free" or self.butt(a, b) is not None:
                    continue
                if all(self.is_rolling(c) for c in between.contacts) or self._rolls(a, b) or self._rolls(b, a):
                    continue
                close = self._same_branch(a, b)
                if first and not close and (not between.faces or self._guided(a, b)):
                    continue
                candidates.append((self._one_part(a, b), close, between.area, between.unexplained, a, b))
            merged = False
            for *_, a, b in sorted(candidates, reverse=True):
                a, b = self.group[a], self.group[b]
                if a != b and not self._would_lock(a, b):
                    self.merge(a, b)
                    merged = True
                    if not first:
                        break
            self._lock_and_idle(small_only=True)
            if not merged:
                return

    def _rolls(self, group: int, other: int) -> bool:
        """Whether a turned group is mounted on its axis elsewhere and touches another one off that axis: a roller on its track."""
        axis = self.group_spin(group)
        fastener = all(self.fastener[i] for i in self.members[group])
        balls = all(is_ball(self.bodies[i]) for i in self.members[other])
        if axis is None or fastener or balls or self._spins_in(group, other, axis):
            return False
        return any(n != other and self.between(group, n).lines and self._spins_in(group, n, axis) for n in self.neighbours[group])

    def _guided(self, a: int, b: int) -> bool:
        """Whether a third group meets both, one of them with fits."""
        common = set(self.neighbours[a]) & set(self.neighbours[b])
        return any(self.between(a, k).lines or self.between(b, k).lines for k in common)

    def _same_branch(self, a: int, b: int) -> bool:
        """Whether all solids of two groups are drawn in one sub-assembly below the root, or in one part."""
        branches = {tuple(self.bodies[i].path.split("/")[:-1]) for i in (*self.members[a], *self.members[b])}
        return self._one_part(a, b) or (len(branches) == 1 and len(next(iter(branches))) > 1)

    def _one_part(self, a: int, b: int) -> bool:
        """Whether two groups hold solids of one instance."""
        return not {self.bodies[i].instance for i in self.members[a]}.isdisjoint(self.bodies[i].instance for i in self.members[b])

    def _would_lock(self, a: int, b: int) -> bool:
        """Whether joining two groups would lock a joint that one of them has with a third."""
        for third in set(self.neighbours[a]) & set(self.neighbours[b]):
            one, other = self.between(a, third), self.between(b, third)
            kinds = {mobility_of(one).kind, mobility_of(other).kind} | ({"hinge"} if self.butt(a, third) or self.butt(b, third) else set())
            if not kinds & {"hinge", "cylindrical", "prismatic", "spherical"}:
                continue
            if mobility_of(_joined(one, other)).kind == "locked":
                return True
        return False

    def _join_axle_ends(self) -> None:
        """An idle part that carries nothing, on the axis of a joint of its only neighbour, is the other end of that axle."""
        for group in sorted(self.members, key=self.extent):
            axis = self.group_spin(group) if group in self.members else None
            if axis is None or len(self.neighbours[group]) != 1:
                continue
            holder = next(iter(self.neighbours[group]))
            for other in self.neighbours[holder]:
                motion = self.mobility(holder, other)
                on_axis = Line(point=motion.point, axis=motion.axis).same(axis)
                larger = self.extent(other) > LARGER * self.extent(group)  # two alike are two wheels, whatever rounding says
                if other != group and motion.kind in ("hinge", "cylindrical") and on_axis and larger:
                    self.merge(group, other)
                    break

    def _drop_leaves(self) -> None:
        """A small part that nothing else hangs on belongs to its only neighbour: a knob, a light, an unused horn, a pin's head."""
        total = sum(b.volume for b in self.bodies)
        for group in sorted(self.members, key=self.extent):
            if group not in self.members or len(self.neighbours[group]) != 1:
                continue
            other = next(iter(self.neighbours[group]))
            tiny = self.volume(group) < 2e-3 * total and self.extent(group) < 3 * SMALL * self.size
            if tiny or self.extent(group) < SMALL * self.size:
                self.merge(group, other)

    def butt(self, a: int, b: int) -> FaceContact | None:
        """The round end that two groups meet with, if they meet in nothing else: a pivot drawn without its bore."""
        between = self.between(a, b)
        if between.lines or between.balls or not between.faces:
            return None
        rounds = [f for f in between.faces if f.round_axis is not None]
        if not rounds or between.unexplained:
            return None
        best = max(rounds, key=lambda f: (f.rotor, f.both_round, f.area))
        if not (best.both_round or best.rotor):
            return None
        for face in between.faces:
            across = np.linalg.norm(np.cross(face.normal, best.normal))
            if across > PARALLEL or (face.round_axis is None and face.area > 0.5 * best.area):
                return None
        return best

    def _is_fastener(self, i: int) -> bool:
        """A small turned part that is threaded or pressed into another, or has a head on what it passes, or is called so."""
        body = self.bodies[i]
        if self.spin[i] is None or body.size > 0.3 * self.size:
            return False
        if FASTENER_WORDS.search(body.prototype):
            return True
        threaded = headed = False
        for other, contacts in self.neighbours[i].items():
            holder = self.bodies[other].size
            for c in contacts:
                threaded |= any(f.clearance < -0.02 * f.hole for f in c.fits) and body.size < holder
                shank = max((f.shaft for f in c.fits if f.hole_owner != i), default=0.0)
                if shank and body.size < 0.5 * holder and self._length(i) > 2.5 * shank:
                    headed |= any(f.round_axis is not None and 1.25 * shank < f.round_radius < 3 * shank for f in c.faces)
        return threaded or headed

    def _length(self, i: int) -> float:
        """Of a turned solid along its axis [m]."""
        axis = self.spin[i]
        if axis is None:
            return 0.0
        ends = [float((c.point + t * c.axis - axis.point) @ axis.axis) for c in self.bodies[i].cylinders for t in (c.low, c.high)]
        return max(ends) - min(ends)

    # --- what is between two groups

    def _gather(self, a: int, b: int) -> Between:
        between = Between(contacts=list(self.neighbours[a].get(b, [])))
        aligned: list[AlignedHoles] = []
        for c in between.contacts:
            bolted = self.fastener[c.first] or self.fastener[c.second]
            for fit in c.fits:
                line = _on(between.lines, Line(point=fit.point, axis=fit.axis))
                line.fits.append(fit)
                line.bolts &= bolted
            between.faces += c.faces
            between.balls += c.balls
            if not c.fits and not c.faces and not c.balls:
                between.unexplained += 1
            if c.faces:
                aligned += c.aligned
        _add_aligned(between, aligned)
        axes = [Line(point=f.round_axis, axis=f.normal) for f in sorted(between.faces, key=lambda f: -f.area) if f.round_axis is not None]
        axes += [spin for i in (*self.members[a], *self.members[b]) if (spin := self.spin[i]) is not None and not self.fastener[i]]
        between.flange, between.bolt_circle = _flange(between, axes)
        return between


def spin_axis(body: PlacedSolid) -> Line | None:
    """The axis of a turned part: most of its cylindrical area lies about it, and its centre of mass on it."""
    lines: list[tuple[Line, float]] = []
    total = 0.0
    for c in body.cylinders:
        total += c.area
        own = Line(point=c.point + (c.low + c.high) / 2 * c.axis, axis=c.axis)
        for k, (line, area) in enumerate(lines):
            if line.same(own):
                lines[k] = (line, area + c.area)
                break
        else:
            lines.append((own, c.area))
    balls = sum(s.area for s in body.spheres if not s.concave)
    if not lines or balls > total:
        return None
    line, area = max(lines, key=lambda pair: pair[1])
    if area < TURNED * total or line.distance(body.center) > 0.03 * body.size:
        return None
    return line


def outer_radius(body: PlacedSolid, axis: Line) -> float:
    """Largest distance of a solid's convex cylinders and faces from an axis [m]."""
    radii = [c.radius for c in body.cylinders if not c.concave and axis.distance(c.point) < COAXIAL]
    radii += [float(np.max(np.linalg.norm(np.cross(p.outline - axis.point, axis.axis), axis=1))) for p in body.planes]
    return max(radii, default=0.0)


def round_outside(body: PlacedSolid, axis: Line) -> bool:
    """Whether no flat beside the axis reaches further out than the solid's cylinders about it: a square plate on a shaft does."""
    beside = [p for p in body.planes if abs(float(p.normal @ axis.axis)) < ACROSS]
    reach = [float(np.max(np.linalg.norm(np.cross(p.outline - axis.point, axis.axis), axis=1))) for p in beside]
    radii = [c.radius for c in body.cylinders if not c.concave and axis.distance(c.point) < COAXIAL]
    return max(reach, default=0.0) <= LARGER * max(radii, default=0.0)


def mobility_of(between: Between) -> Mobility:
    """Mobility that everything between two groups leaves."""
    anchor = between.flange.point if between.flange else None
    points = [line.point for line in between.lines] or [b.center for b in between.balls] or [f.point for f in between.faces]
    if anchor is None and not points:
        return mobility([], np.zeros(3))
    center = anchor if anchor is not None else np.mean(points, axis=0)
    if between.flange is not None:
        return mobility([cylinder_rows(between.flange.point, between.flange.axis, center, slides=False)], center)
    rows = [cylinder_rows(x.point, x.axis, center, slides=not (x.bolts or any(f.rolling for f in x.fits))) for x in between.lines]
    rows += [ball_rows(ball.center, center) for ball in between.balls]
    rows += [face_rows(face.point, face.normal, center) for face in _holding(between)]
    return mobility(rows, center)


def _holding(between: Between) -> list[FaceContact]:
    """The faces that hold in both senses.

    Beside an axis, a face across it is a shoulder (it counts), a face along it near the axis is a flat or a key (it counts), one further
    away holds only with another one opposite: alone it is a stop that the part lies on.
    """
    if not between.lines:
        return [f for f in between.faces if _has_opposite(f, between.faces)]
    line = between.lines[0]
    radius = max((fit.hole for fit in line.fits), default=0.0)
    kept = []
    for face in between.faces:
        along = abs(float(face.normal @ line.axis))
        near = line.distance(face.point) < 1.5 * radius
        if along > 1 - PARALLEL or near or _has_opposite(face, between.faces):
            kept.append(face)
    return kept


def _has_opposite(face: FaceContact, faces: list[FaceContact]) -> bool:
    return any(float(face.normal @ other.normal) < -1 + PARALLEL for other in faces)


def _flange(between: Between, axes: list[Line]) -> tuple[Line | None, tuple[int, float]]:
    """Three or more bolts on a circle about the axis of a round face or a turned part: (axis, (number, radius)), else (None, (0, 0))."""
    bolts = [line for line in between.lines if line.bolts]
    if len(bolts) < 3:
        return None, (0, 0.0)
    for axis in axes:
        circle = [line for line in bolts if np.linalg.norm(np.cross(line.axis, axis.axis)) < PARALLEL and not line.same(axis)]
        others = [line for line in between.lines if not line.same(axis) and line not in circle]
        if others or len(circle) < 3:
            continue
        radii = [axis.distance(line.point) for line in circle]
        if max(radii) - min(radii) < COAXIAL and np.linalg.norm(np.mean([_foot(line, axis) for line in circle], axis=0)) < 0.2 * radii[0]:
            return axis, (len(circle), float(np.mean(radii)))
    return None, (0, 0.0)


def _foot(line: Line, axis: Line) -> Array:
    away = line.point - axis.point
    return away - (away @ axis.axis) * axis.axis


def _add_aligned(between: Between, aligned: list[AlignedHoles]) -> None:
    """Aligned holes beside the fits, if they are on two or more axes: one is a chance alignment."""
    found: list[Line] = []
    for hole in aligned:
        own = Line(point=hole.point, axis=hole.axis)
        if not any(line.same(own) for line in (*between.lines, *found)):
            found.append(own)
    if len(found) >= 2:
        between.lines += found


def _on(lines: list[Line], own: Line) -> Line:
    for line in lines:
        if line.same(own):
            return line
    lines.append(own)
    return own


def _joined(one: Between, other: Between) -> Between:
    lines: list[Line] = []
    for line in itertools.chain(one.lines, other.lines, (x.flange for x in (one, other) if x.flange is not None)):
        target = _on(lines, Line(point=line.point, axis=line.axis, bolts=line.bolts))
        target.fits += line.fits
    return Between(lines=lines, faces=one.faces + other.faces, balls=one.balls + other.balls)
