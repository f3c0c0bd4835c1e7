"""What geometry tells about a mechanism: bodies, joints and wheels, each with its evidence and a confidence.

Confidence: independent pieces of evidence each remove a share w_k of the doubt, and every doubt d_k leaves a share of what they found,

    c = (1 - Prod (1 - w_k)) Prod d_k,

read as "of a hundred such findings, a person who knows the machine would confirm about 100 c". The weights are judgements; they are
named in ``WEIGHTS`` and ``DOUBTS`` and are the same for every file. At ``THRESHOLD`` a finding is likelier right than wrong.
"""

import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.cad.assembly import Assembly
from rille.cad.contact import (
    COAXIAL,
    WRAP,
    FaceContact,
    Fit,
    PlacedSolid,
    coaxial,
    facing,
    find_contacts,
    near_pairs,
    opposed_faces,
    place_solids,
    seat_balls,
)
from rille.cad.grouping import SMALL, Between, Grouping, Line, outer_radius
from rille.cad.symmetry import RotationalSymmetry, rotational_symmetry

Array = NDArray[np.float64]

THRESHOLD = 0.5

WEIGHTS = {
    "close fit": 0.55,  # a shaft in a hole with a running clearance
    "loose fit": 0.25,  # a clearance as that of a screw in its hole
    "wide fit": 0.20,  # a shaft in a hole that is much wider
    "shoulder": 0.30,  # faces across the axis stop the slide
    "long": 0.15,  # engaged over more than the radius
    "two bearings": 0.30,  # held at two places of the axis
    "bearing": 0.35,  # a ring with a shaft inside and a seat outside
    "round ends": 0.45,  # two concentric round faces on each other
    "round end": 0.25,  # a round end before a flat
    "rotor": 0.50,  # the round end stands in an annular gap of its own part: the output of an actuator
    "bolt circle": 0.30,  # bolted about the axis of a turned part or a round face
    "nothing else": 0.30,  # what it carries is held by nothing else
    "sub-assemblies": 0.15,  # drawn as separate sub-assemblies
    "repeated": 0.20,  # the same joint is there several times
    "wheel": 0.60,  # it carries a wheel on its axis
    "words": 0.35,  # the parts are called motor, servo, bearing, ...
    "ball": 0.60,  # a ball in a socket
    "guides": 0.60,  # two or more parallel guides
    "long guide": 0.30,  # guided over more than its width
    "slot": 0.40,  # faces on both sides in two directions
}
DOUBTS = {
    "slides": 0.75,  # nothing stops the slide along the axis
    "screw": 0.45,  # only one screw holds it: a pivot or a clamp
    "pressed": 0.35,  # the shaft is drawn thicker than the hole
    "spins idly": 0.40,  # the part is turned about this axis and carries nothing: its turning changes nothing
    "touches": 0.70,  # the bodies also touch where geometry does not say how
    "small": 0.60,  # the moving part is small
    "end of the chain": 0.60,  # a round end that carries nothing: a pillar, a foot, a cap
}
_ACTUATOR = re.compile(r"motor|servo|actuator|gearbox|getriebe|harmonic|dynamixel", re.IGNORECASE)
_TURNING = re.compile(r"bearing|hinge|pivot|axle|bush(?!ing tool)|lager|gelenk|achse|trunnion|spindle|horn", re.IGNORECASE)
_WHEEL = re.compile(r"wheel|tyre|tire|rad(?![a-z])|rim(?![a-z])|roue", re.IGNORECASE)

JointKind = Literal["hinge", "prismatic", "spherical"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SuggestedBody:
    """Instances (indices into the assembly's) that move together. notes : what was assumed."""

    name: str
    instances: tuple[int, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SuggestedJoint:
    """A joint: point [m] and unit axis, shape (3,), in the assembly's frame.

    parent, child : names of bodies. Under the threshold both sides are one body, ``parent == child``, and ``moving`` says which instances
    would be the moving body. evidence, doubts : sentences. loop : it closes a circle of joints.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    point: Array
    axis: Array
    confidence: float
    evidence: tuple[str, ...]
    doubts: tuple[str, ...]
    moving: tuple[int, ...]
    loop: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SuggestedWheel:
    """A wheel on a hinge. center [m], axis : unit, shapes (3,). radius of the rim without grousers, width, grouser sizes [m]."""

    name: str
    joint: str
    body: str
    instance: int
    center: Array
    axis: Array
    radius: float
    width: float
    grouser_count: int
    grouser_height: float
    grouser_thickness: float
    confidence: float
    evidence: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Suggestions:
    """What was found in an assembly. root : name of the body that carries the others."""

    bodies: tuple[SuggestedBody, ...]
    joints: tuple[SuggestedJoint, ...]
    wheels: tuple[SuggestedWheel, ...]
    root: str
    notes: tuple[str, ...] = ()
    threshold: float = THRESHOLD

    @property
    def accepted(self) -> tuple[SuggestedJoint, ...]:
        """The joints above the threshold that make a tree."""
        return tuple(j for j in self.joints if j.confidence >= self.threshold and not j.loop and j.parent != j.child)


@dataclass(slots=True, kw_only=True, eq=False)
class _Candidate:
    """A joint between two groups while it is judged."""

    a: int
    b: int
    kind: JointKind
    point: Array
    axis: Array
    radius: float = 0.0
    found: list[tuple[str, str]] = field(default_factory=list)
    doubts: list[tuple[str, str]] = field(default_factory=list)
    wheel: "_Wheel | None" = None

    @property
    def confidence(self) -> float:
        doubt = math.prod(1 - WEIGHTS[k] for k in {k for k, _ in self.found})
        return (1 - doubt) * math.prod(DOUBTS[k] for k in {k for k, _ in self.doubts})

    def other(self, group: int) -> int:
        return self.b if group == self.a else self.a


@dataclass(slots=True, kw_only=True, eq=False)
class _Wheel:
    group: int
    instance: int
    symmetry: RotationalSymmetry
    center: Array
    axis: Array
    evidence: list[str]
    confidence: float = 0.0


def suggest(assembly: Assembly, progress: Callable[[str, float], None] | None = None) -> Suggestions:
    """Suggest bodies, joints and wheels of an assembly from its geometry alone; the same file gives the same suggestions."""
    say = progress or (lambda what, fraction: None)
    solids = place_solids(assembly, lambda what, f: say(what, 0.4 * f))
    if not solids:
        return Suggestions(bodies=(), joints=(), wheels=(), root="", notes=("no part has a solid, so nothing has a mass or can move",))
    contacts = seat_balls(solids, find_contacts(solids, lambda what, f: say(what, 0.4 + 0.4 * f)))
    say("grouping", 0.8)
    grouping = Grouping(solids, contacts)
    grouping.solve()
    result = _Judge(assembly, grouping).result(lambda what, f: say(what, 0.85 + 0.15 * f))
    say("done", 1.0)
    return result


class _Judge:
    """From rigid groups to suggestions."""

    def __init__(self, assembly: Assembly, grouping: Grouping) -> None:
        self.assembly = assembly
        self.g = grouping
        self.notes: list[str] = []
        self.assumed: dict[int, list[str]] = defaultdict(list)
        self.symmetries: dict[int, RotationalSymmetry | None] = {}
        self.candidates: list[_Candidate] = []

    def result(self, say: Callable[[str, float], None]) -> Suggestions:
        self.candidates = [c for a, b in self.g.pairs() if (c := self._candidate(a, b)) is not None]
        self._hold_floating()
        say("wheels", 0.3)
        self._wheels()
        self._compare()
        say("tree", 0.9)
        return self._suggestions()

    # --- joints that contacts show

    def _candidate(self, a: int, b: int) -> _Candidate | None:
        between = self.g.between(a, b)
        butt = self.g.butt(a, b)
        if butt is not None and butt.round_axis is not None:
            return self._butt_candidate(a, b, butt)
        motion = self.g.mobility(a, b)
        if motion.kind in ("hinge", "cylindrical"):
            return self._hinge(a, b, between, motion.kind == "cylindrical")
        if motion.kind == "prismatic":
            return self._guide(a, b, between, motion.axis)
        if motion.kind == "spherical":
            ball = max(between.balls, key=lambda x: x.radius)
            text = f"a ball of diameter {_mm(2 * ball.radius)} of one in a socket of the other, {self._names(a, b)}"
            return _Candidate(a=a, b=b, kind="spherical", point=ball.center, axis=_Z, radius=ball.radius, found=[("ball", text)])
        return None

    def _hinge(self, a: int, b: int, between: Between, slides: bool) -> _Candidate | None:
        line = between.flange or next((x for x in between.lines if x.fits), None)
        if line is None:
            return None
        fits = [f for x in between.lines if x.same(line) for f in x.fits if f.sweep > WRAP]
        found, doubts = [], []
        point, axis, radius = line.point, line.axis, 0.0
        if fits:
            best = max(fits, key=lambda f: (f.clearance >= -1e-6, f.length))
            axis, radius = best.axis, best.hole
            heights = [float((f.point - best.point) @ axis) + s * f.length / 2 for f in fits for s in (-1, 1)]
            point = best.point + (max(heights) + min(heights)) / 2 * axis
            found += self._fit_evidence(best, fits, between)
            if best.clearance < -1e-5:
                doubts.append(("pressed", f"the shaft is drawn {_mm(-2 * best.clearance)} thicker than its hole (thread or press fit)"))
        if between.flange is not None:
            count, circle = between.bolt_circle
            radius = radius or circle
            text = f"{count} bolts or holes on a circle of diameter {_mm(2 * circle)} about the axis of a round part"
            found.append(("bolt circle", f"{text}, as on the output of an actuator ({self._names(a, b)})"))
        elif all(x.bolts for x in between.lines):
            doubts.append(("screw", "the only shaft is that of a screw: it may be a clamp as well as a pivot"))
        shoulders = [f for f in between.faces if abs(float(f.normal @ axis)) > 0.999]
        if shoulders and between.flange is None:
            best_face = max(shoulders, key=lambda f: f.area)
            found.append(("shoulder", f"faces across the axis touch at {_at(best_face.point)} over {best_face.area * 1e6:.0f} mm^2"))
        if slides:
            play = self._play(a, b, axis, 0.5 * max([radius, *(f.length for f in fits)]))
            if play is None:
                doubts.append(("slides", "nothing stops a slide along the axis"))
            else:
                found.append(("shoulder", f"captive between faces across the axis, with {_mm(play)} of play"))
        return self._common(_Candidate(a=a, b=b, kind="hinge", point=point, axis=axis, radius=radius, found=found, doubts=doubts), between)

    def _play(self, a: int, b: int, axis: Array, reach: float) -> float | None:
        """How far one side can slide along the axis until faces of the other stop it both ways [m]; None if they do not."""
        gaps: dict[bool, float] = {}
        inside = set(self.g.members[a])
        for i, j in near_pairs([self.g.bodies[k] for k in (*self.g.members[a], *self.g.members[b])], reach):
            one, other = ([*self.g.members[a], *self.g.members[b]][k] for k in (i, j))
            if (one in inside) == (other in inside):
                continue
            one, other = (one, other) if one in inside else (other, one)
            for face in opposed_faces(self.g.bodies[one], self.g.bodies[other], reach):
                along = float(face.normal @ axis)
                if abs(along) > 0.999:
                    gaps[along > 0] = min(gaps.get(along > 0, math.inf), max(face.gap, 0.0))
        return sum(gaps.values()) if len(gaps) == 2 else None

    def _fit_evidence(self, best: Fit, fits: list[Fit], between: Between) -> list[tuple[str, str]]:
        contact = next(c for c in between.contacts if best in c.fits)
        shaft_owner = contact.second if contact.first == best.hole_owner else contact.first
        text = (
            f"hole {_mm(2 * best.hole)} of {self._path(best.hole_owner)} around shaft {_mm(2 * best.shaft)} of {self._path(shaft_owner)}, "
            f"coaxial within {best.offset * 1e3:.3f} mm, engaged over {_mm(best.length)}"
        )
        if best.rolling:
            text += f", {best.rolling} balls roll between them"
        close = best.rolling or best.clearance <= 0.03 * best.hole + 2e-5
        found = [("close fit" if close else "loose fit", text)]
        heights = [float((f.point - best.point) @ best.axis) for f in fits]
        apart = max(heights) - min(heights)
        if apart > 2 * best.hole:
            found.append(("two bearings", f"held at {len(fits)} places of the axis, up to {_mm(apart)} apart"))
        ring = next((i for i in (best.hole_owner, shaft_owner) if self._is_ring(i, best)), None)
        if ring is not None:
            found.append(("bearing", f"{self._path(ring)} is a ring between shaft and seat, as a bearing is"))
        if sum(f.length for f in fits) > best.hole:
            found.append(("long", f"engaged over {sum(f.length for f in fits) / best.hole:.1f} radii"))
        return found

    def _is_ring(self, i: int, fit: Fit) -> bool:
        """Whether a turned solid has a shaft in its bore and sits in a bore itself, on the axis of a fit."""
        spin, axis = self.g.spin[i], Line(point=fit.point, axis=fit.axis)
        if spin is None or not spin.same(axis):
            return False
        own = [f for c in self.g.contacts if i in (c.first, c.second) for f in c.fits if Line(point=f.point, axis=f.axis).same(axis)]
        return any(f.hole_owner == i for f in own) and any(f.hole_owner != i for f in own)

    def _guide(self, a: int, b: int, between: Between, axis: Array) -> _Candidate | None:
        lines = [x for x in between.lines if x.fits and not x.bolts]
        if len(lines) >= 2:
            sizes = ", ".join(sorted({_mm(2 * x.fits[0].hole) for x in lines}))
            apart = max(x.distance(lines[0].point) for x in lines)
            text = f"{len(lines)} parallel guides (holes {sizes}, up to {_mm(apart)} apart) and no face across them: {self._names(a, b)}"
            made = _Candidate(
                a=a, b=b, kind="prismatic", point=lines[0].point, axis=axis, radius=lines[0].fits[0].hole, found=[("guides", text)]
            )
            return self._common(made, between)
        if between.lines or any(abs(float(f.normal @ axis)) > 0.01 for f in between.faces) or between.unexplained:
            return None
        area = sum(f.area for f in between.faces)
        point = sum((f.area * f.point for f in between.faces), np.zeros(3)) / area
        text = f"{len(between.faces)} faces on both sides in two directions and none across, {area * 1e6:.0f} mm^2: {self._names(a, b)}"
        made = _Candidate(a=a, b=b, kind="prismatic", point=point, axis=axis, found=[("slot", text)])
        length, across = self._guided_length(a, b, axis), self._spread(between.faces, axis)
        if length > 1.5 * across:
            made.found.append(("long guide", f"guided over {_mm(length)}, {length / across:.1f} times its width"))
        return self._common(made, between)

    def _guided_length(self, a: int, b: int, axis: Array) -> float:
        """How far two groups overlap along an axis [m]."""
        ends = []
        for group in (a, b):
            boxes = [self.g.bodies[i] for i in self.g.members[group]]
            along = np.concatenate([_corners_of(body) for body in boxes]) @ axis
            ends.append((float(along.min()), float(along.max())))
        return min(ends[0][1], ends[1][1]) - max(ends[0][0], ends[1][0])

    def _spread(self, faces: list[FaceContact], axis: Array) -> float:
        """Distance of the outermost faces from each other across an axis [m]."""
        points = np.array([f.point for f in faces])
        points = points - np.outer(points @ axis, axis)
        return max(float(np.linalg.norm(p - q)) for p in points for q in points)

    def _butt_candidate(self, a: int, b: int, face: FaceContact) -> _Candidate:
        gap = f", {_mm(face.gap)} apart" if face.gap > COAXIAL else ", touching"
        if face.rotor:
            evidence = (
                "rotor",
                f"round end {_mm(2 * face.round_radius)} at {_at(face.point)} stands in an annular gap of its own part{gap}",
            )
        elif face.both_round:
            evidence = ("round ends", f"two concentric round ends, the smaller {_mm(2 * face.round_radius)}, at {_at(face.point)}{gap}")
        else:
            evidence = ("round end", f"round end {_mm(2 * face.round_radius)} before a flat at {_at(face.point)}{gap}")
        point = face.round_axis if face.round_axis is not None else face.point
        made = _Candidate(a=a, b=b, kind="hinge", point=point, axis=face.normal, radius=face.round_radius, found=[evidence])
        made.found[0] = (evidence[0], f"{evidence[1]}: {self._names(a, b)}")
        return self._common(made, self.g.between(a, b))

    def _common(self, c: _Candidate, between: Between) -> _Candidate:
        """Evidence that every kind of joint may have."""
        if self.g.kinship(c.a, c.b) < min(self._depth(c.a), self._depth(c.b)) or self._depth(c.a) != self._depth(c.b):
            c.found.append(("sub-assemblies", "the two sides are drawn as separate sub-assemblies"))
        names = {self.g.bodies[i].prototype for k in between.contacts for i in (k.first, k.second)}
        names |= {
            self.assembly.instances[self.g.bodies[i].instance].path.split("/")[-2] for i in self._touching(between) if self._nested(i)
        }
        words = sorted(n for n in names if _ACTUATOR.search(n) or _TURNING.search(n))
        if words:
            c.found.append(("words", f"a part is called '{words[0]}'"))
        if between.unexplained and c.kind != "prismatic":
            c.doubts.append(("touches", "the two sides also touch where neither a cylinder nor a plane says how"))
        return c

    def _touching(self, between: Between) -> set[int]:
        return {i for k in between.contacts for i in (k.first, k.second)}

    def _nested(self, i: int) -> bool:
        return self.g.bodies[i].path.count("/") >= 2

    def _depth(self, group: int) -> int:
        return max(self.g.bodies[i].path.count("/") for i in self.g.members[group])

    # --- what nothing holds

    def _hold_floating(self) -> None:
        """Find for every part of the machine that nothing touches what holds it across a gap, else join it to its nearest neighbour."""
        while True:
            islands = self._islands()
            if len(islands) < 2:
                return
            main = max(islands, key=lambda groups: sum(self.g.volume(k) for k in groups))
            for island in sorted((x for x in islands if x is not main), key=lambda x: (sum(self.g.volume(k) for k in x), min(x))):
                if not self._bridge(island, islands):
                    self._join_nearest(island)
                break

    def _islands(self) -> list[set[int]]:
        """Groups that contacts or candidates hold together."""
        linked: dict[int, set[int]] = defaultdict(set)
        for c in self.candidates:
            linked[c.a].add(c.b)
            linked[c.b].add(c.a)
        for a, b in self.g.pairs():
            linked[a].add(b)
            linked[b].add(a)
        return self._connected(linked)

    def _connected(self, linked: dict[int, set[int]]) -> list[set[int]]:
        left, found = set(self.g.members), []
        while left:
            todo, island = [min(left)], set()
            while todo:
                group = todo.pop()
                if group in left:
                    left.remove(group)
                    island.add(group)
                    todo += linked[group]
            found.append(island)
        return found

    def _bridge(self, island: set[int], islands: list[set[int]]) -> bool:
        """A shaft in a wider hole, or a round end before a flat, across a gap: what is between is not drawn."""
        mine = [i for k in island for i in self.g.members[k]]
        size = max(self.g.extent(k) for k in island)
        if size < SMALL * self.g.size:
            return False
        near = [(i, j) for i, j in near_pairs(self.g.bodies, 0.1 * size) if (i in set(mine)) != (j in set(mine))]
        best: tuple[float, _Candidate] | None = None
        for i, j in near:
            a, b = self.g.group[i], self.g.group[j]
            one, other = self.g.bodies[i], self.g.bodies[j]
            for fit in coaxial(self.g.bodies, i, j):
                score = 2.0 - fit.clearance / fit.hole
                if best is None or score > best[0]:
                    best = (score, self._wide_fit(a, b, i, j, fit))
            for face in facing(one, other, 0.1 * size):
                if face.gap > 0.3 * face.round_radius or face.area < 0.5 * math.pi * face.round_radius**2:
                    continue
                score = (1.0 if face.both_round else 0.5) - face.gap / face.round_radius
                if best is None or score > best[0]:
                    best = (score, self._butt_candidate(a, b, face))
        if best is None:
            return False
        best[1].found.append(("nothing else", "nothing touches what it carries, so it must be held here, by something that is not drawn"))
        self.candidates.append(best[1])
        return True

    def _wide_fit(self, a: int, b: int, i: int, j: int, fit: Fit) -> _Candidate:
        shaft_owner = j if fit.hole_owner == i else i
        text = (
            f"hole {_mm(2 * fit.hole)} of {self._path(fit.hole_owner)} around shaft {_mm(2 * fit.shaft)} of {self._path(shaft_owner)}, "
            f"coaxial within {fit.offset * 1e3:.3f} mm; what fills the gap of {_mm(fit.clearance)} is not drawn"
        )
        made = _Candidate(a=a, b=b, kind="hinge", point=fit.point, axis=fit.axis, radius=fit.hole, found=[("wide fit", text)])
        return self._common(made, self.g.between(a, b))

    def _join_nearest(self, island: set[int]) -> None:
        mine = [i for k in island for i in self.g.members[k]]
        inside = set(mine)
        others = [i for i in range(len(self.g.bodies)) if i not in inside]
        nearest = min(((self._apart(i, j), -self._common_path(i, j), i, j) for i in mine for j in others), default=None)
        if nearest is None:
            return
        gap, _, i, j = nearest
        kept = self.g.group[j]
        sentence = f"nothing holds {self._path(i)}; it was put with {self._path(j)}, its nearest neighbour ({_mm(gap)} between their boxes)"
        self._merge(self.g.group[i], kept)
        self.assumed[self.g.group[j]].append(sentence)
        self.notes.append(sentence)

    def _common_path(self, i: int, j: int) -> int:
        one, other = self.g.bodies[i].path.split("/"), self.g.bodies[j].path.split("/")
        return next((k for k, (x, y) in enumerate(zip(one, other, strict=False)) if x != y), min(len(one), len(other)))

    def _apart(self, i: int, j: int) -> float:
        one, other = self.g.bodies[i], self.g.bodies[j]
        return float(np.linalg.norm(np.maximum(0, np.maximum(one.low - other.high, other.low - one.high))))

    def _merge(self, a: int, b: int) -> None:
        """Make two groups one, and keep the candidates right."""
        one, other = self.g.group[a], self.g.group[b]
        kept = self.g.merge(one, other)
        gone = other if kept == one else one
        if gone in self.assumed:
            self.assumed[kept] += self.assumed.pop(gone)
        for c in self.candidates:
            c.a, c.b = (kept if c.a == gone else c.a), (kept if c.b == gone else c.b)
        self.candidates = [c for c in self.candidates if c.a != c.b]

    # --- wheels

    def _wheels(self) -> None:
        degree = Counter(k for c in self.candidates for k in (c.a, c.b))
        found: list[tuple[_Candidate, _Wheel]] = []
        for c in self.candidates:
            if c.kind != "hinge":
                continue
            leaves = [k for k in (c.a, c.b) if degree[k] == 1]
            wheels = [w for k in leaves if (w := self._wheel(c, k)) is not None]
            if wheels:
                best = max(wheels, key=lambda w: (w.symmetry.radius, -self.g.volume(w.group)))
                found.append((c, best))
        for c, wheel in found:
            self._judge_wheel(wheel, [w for _, w in found])
            if wheel.confidence >= THRESHOLD:
                c.found.append(("wheel", f"carries a wheel of diameter {_mm(2 * wheel.symmetry.rim_radius)} on its axis"))
                c.point = wheel.center
            c.wheel = wheel

    def _wheel(self, c: _Candidate, group: int) -> _Wheel | None:
        line = Line(point=c.point, axis=c.axis)
        best: _Wheel | None = None
        for instance in sorted({self.g.bodies[i].instance for i in self.g.members[group] if self.g.bodies[i].size > SMALL * self.g.size}):
            placed = self.assembly.instances[instance]
            prototype = self.assembly.prototypes[placed.prototype]
            middle = placed.matrix[:3, :3] @ prototype.volume.com + placed.matrix[:3, 3]
            if line.distance(middle) > 0.02 * float(np.linalg.norm(prototype.bounds[1] - prototype.bounds[0])):
                continue  # a wheel is balanced
            symmetry = self._symmetry(placed.prototype)
            if symmetry is None or not symmetry.round:
                continue
            center = placed.matrix[:3, :3] @ symmetry.point + placed.matrix[:3, 3]
            axis = placed.matrix[:3, :3] @ symmetry.axis
            if np.linalg.norm(np.cross(axis, line.axis)) > 5e-3 or line.distance(center) > 5 * COAXIAL:
                continue
            if best is None or symmetry.radius > best.symmetry.radius:
                best = _Wheel(group=group, instance=instance, symmetry=symmetry, center=center, axis=_positive(axis), evidence=[])
        if (
            best is None
            or best.symmetry.rim_radius < max(1.5 * c.radius, 0.02 * self.g.size)
            or best.symmetry.width > 3 * best.symmetry.radius
        ):
            return None
        return best if self._is_free(best, c) else None

    def _symmetry(self, prototype: int) -> RotationalSymmetry | None:
        if prototype not in self.symmetries:
            self.symmetries[prototype] = rotational_symmetry(self.assembly.prototypes[prototype].shape)
        return self.symmetries[prototype]

    def _is_free(self, wheel: _Wheel, c: _Candidate) -> bool:
        """Whether the rim is the outermost of its group, touches nothing else, and can reach a ground on some side."""
        if any(other != c.other(wheel.group) for other in self.g.neighbours[wheel.group]):
            return False
        rim = Line(point=wheel.center, axis=wheel.axis)
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

    def _meshes(self, i: int, rim: Line, wheel: _Wheel) -> bool:
        """Whether the circle of another turned part on a parallel axis cuts the rim's: gears, friction wheels."""
        body, spin = self.g.bodies[i], self.g.spin[i]
        if spin is None or np.linalg.norm(np.cross(spin.axis, rim.axis)) > 5e-3 or rim.same(spin):
            return False
        reach = (body.high - body.low) @ np.abs(rim.axis) / 2
        apart = abs(float(((body.low + body.high) / 2 - wheel.center) @ rim.axis))
        beside = apart > reach + wheel.symmetry.width / 2
        outer = outer_radius(body, spin)
        return not beside and abs(outer - wheel.symmetry.radius) < rim.distance(spin.point) < outer + wheel.symmetry.radius

    def _judge_wheel(self, wheel: _Wheel, others: list[_Wheel]) -> None:
        s = wheel.symmetry
        kind = "a body of revolution" if s.order == 0 else f"{s.order}-fold symmetric" if s.order > 1 else "round outside"
        wheel.evidence.append(f"{kind} about the hinge axis, rim {_mm(2 * s.rim_radius)} x {_mm(s.width)}, free to touch a ground")
        weights = [0.3]
        twins = [w for w in others if abs(w.symmetry.radius - s.radius) < 0.01 * s.radius and abs(abs(w.axis @ wheel.axis) - 1) < 0.01]
        if len(twins) > 1:
            wheel.evidence.append(f"{len(twins)} of this size have parallel axes")
            weights.append(0.4 if len(twins) < 4 else 0.55)
        if s.grouser_count:
            wheel.evidence.append(f"{s.grouser_count} grousers {_mm(s.grouser_height)} high and {_mm(s.grouser_thickness)} thick")
            weights.append(0.35)
        path = self.assembly.instances[wheel.instance].path
        if _WHEEL.search(path.rsplit("/", 1)[-1]) or _WHEEL.search(
            self.assembly.prototypes[self.assembly.instances[wheel.instance].prototype].name
        ):
            wheel.evidence.append("it is called a wheel")
            weights.append(0.4)
        wheel.confidence = 1 - math.prod(1 - w for w in weights)

    # --- what the joints say about each other

    def _compare(self) -> None:
        degree = Counter(k for c in self.candidates for k in (c.a, c.b))
        total = sum(b.volume for b in self.g.bodies)
        signatures = Counter(self._signature(c) for c in self.candidates)
        for c in self.candidates:
            count = signatures[self._signature(c)]
            if count > 1:
                c.found.append(("repeated", f"the same joint is there {count} times"))
            is_wheel = c.wheel is not None and c.wheel.confidence >= THRESHOLD
            line = Line(point=c.point, axis=c.axis)
            idle = [k for k in (c.a, c.b) if degree[k] == 1 and (spin := self.g.group_spin(k)) is not None and spin.same(line)]
            if c.kind == "hinge" and idle and not is_wheel:
                c.doubts.append(("spins idly", "the part is turned about this axis and carries nothing, so its turning changes nothing"))
            small = min(self.g.extent(c.a), self.g.extent(c.b)) < 2 * SMALL * self.g.size
            if small or min(self.g.volume(c.a), self.g.volume(c.b)) < 1e-3 * total:
                c.doubts.append(("small", "the moving part is small"))
            ends = {k for k, _ in c.found} & {"round end", "round ends"}
            if ends and not is_wheel and 1 in (degree[c.a], degree[c.b]):
                c.doubts.append(("end of the chain", "it carries nothing: it may be a pillar, a foot or a cap"))
            if (
                c.kind == "hinge"
                and "nothing else" not in {k for k, _ in c.found}
                and (is_wheel or {"rotor", "round ends"} & {k for k, _ in c.found})
            ):
                c.found.append(("nothing else", "the two sides meet nowhere else"))

    def _signature(self, c: _Candidate) -> tuple:
        volumes = sorted(round(20 * math.log(max(self.g.volume(k), 1e-12))) for k in (c.a, c.b) if self.g.volume(k) > 0)
        return c.kind, round(c.radius, 5), c.found[0][0], volumes[0]

    # --- the tree

    def _suggestions(self) -> Suggestions:
        order = sorted(self.candidates, key=lambda c: (-c.confidence, c.a, c.b))
        moving_of = self._weak_sides(order)
        self._merge_weak(order)
        self._attach_rest(order)
        owner = self._owners()
        groups = sorted(set(owner.values()), key=lambda k: (-self.g.volume(k), k))
        strong = [c for c in order if c.confidence >= THRESHOLD and self.g.group[c.a] != self.g.group[c.b]]
        root = groups[0]  # the largest volume
        tree, loops = self._span(strong, root)
        names = self._names_of(groups, owner)
        assumed = {self.g.group[k]: text for k, text in self.assumed.items()}
        bodies = tuple(
            SuggestedBody(name=names[k], instances=tuple(i for i, g in sorted(owner.items()) if g == k), notes=tuple(assumed.get(k, ())))
            for k in self._ordered(groups, root, tree)
        )
        joints, wheels = self._joints(tree, loops, [c for c in order if c not in strong], names, owner, moving_of)
        return Suggestions(bodies=bodies, joints=joints, wheels=wheels, root=names[root], notes=tuple(self.notes))

    def _merge_weak(self, order: list[_Candidate]) -> None:
        """Join both sides of what is under the threshold, the least sure first, unless they are the two sides of a sure joint."""
        strong = [c for c in order if c.confidence >= THRESHOLD]
        for c in reversed(order):
            a, b = self.g.group[c.a], self.g.group[c.b]
            if c.confidence < THRESHOLD and not any({self.g.group[s.a], self.g.group[s.b]} == {a, b} for s in strong):
                self.g.merge(a, b)

    def _weak_sides(self, order: list[_Candidate]) -> dict[_Candidate, tuple[int, ...]]:
        """For every candidate under the threshold the instances of its smaller side, before both become one body."""
        sides = {}
        for c in order:
            if c.confidence < THRESHOLD:
                small = min((c.a, c.b), key=lambda k: (self.g.volume(k), k))
                sides[c] = tuple(sorted({self.g.bodies[i].instance for i in self.g.members[small]}))
        return sides

    def _owners(self) -> dict[int, int]:
        """Group of every instance: that of most of its volume; parts without a solid go with the parts drawn beside them."""
        weight: dict[int, dict[int, float]] = defaultdict(lambda: defaultdict(float))
        for i, body in enumerate(self.g.bodies):
            weight[body.instance][self.g.group[i]] += body.volume
        owner = {i: max(sorted(w), key=lambda k: w[k]) for i, w in weight.items()}
        for i, instance in enumerate(self.assembly.instances):
            if i in owner:
                continue
            parts = instance.path.split("/")
            for depth in range(len(parts) - 1, -1, -1):
                beside = "/".join(parts[:depth])
                near = [k for k in weight if not beside or self.assembly.instances[k].path.startswith(beside + "/")]
                if near:
                    place = instance.matrix[:3, 3]
                    owner[i] = owner[min(near, key=lambda k: (float(np.linalg.norm(self.assembly.instances[k].matrix[:3, 3] - place)), k))]
                    break
        return owner

    def _attach_rest(self, order: list[_Candidate]) -> None:
        """What touches the machine but hangs on no sure joint moves with what it touches."""
        while True:
            linked: dict[int, set[int]] = defaultdict(set)
            for c in order:
                linked[self.g.group[c.a]].add(self.g.group[c.b])
                linked[self.g.group[c.b]].add(self.g.group[c.a])
            islands = self._connected(linked)
            if len(islands) < 2:
                return
            small = min(islands, key=lambda groups: (sum(self.g.volume(k) for k in groups), min(groups)))
            touching = [(self.g.between(k, n).area, self.g.volume(n), k, n) for k in small for n in self.g.neighbours[k] if n not in small]
            if not touching:
                self._join_nearest(small)
                continue
            *_, own, other = max(touching)
            sentence = f"{self._path(self._largest(own))} only touches {self._path(self._largest(other))}; it was put with it"
            self.notes.append(sentence)
            self._merge(own, other)
            self.assumed[self.g.group[other]].append(sentence)

    def _span(self, strong: list[_Candidate], root: int) -> tuple[list[tuple[_Candidate, int, int]], list[_Candidate]]:
        """Spanning tree of the surest joints (Kruskal 1956), directed away from the root, and the joints that close loops."""
        parent: dict[int, int] = {}

        def find(k: int) -> int:
            while parent.get(k, k) != k:
                k = parent[k]
            return k

        kept, loops = [], []
        for c in strong:
            a, b = find(self.g.group[c.a]), find(self.g.group[c.b])
            if a == b:
                loops.append(c)
            else:
                parent[b] = a
                kept.append(c)
        directed, reached = [], {root}
        while True:
            step = next((c for c in kept if (self.g.group[c.a] in reached) != (self.g.group[c.b] in reached)), None)
            if step is None:
                rest = [c for c in kept if self.g.group[c.a] not in reached]
                if not rest:
                    return directed, loops
                reached.add(max((self.g.group[rest[0].a], self.g.group[rest[0].b]), key=self.g.volume))
                continue
            a, b = self.g.group[step.a], self.g.group[step.b]
            up, down = (a, b) if a in reached else (b, a)
            directed.append((step, up, down))
            reached.add(down)

    def _ordered(self, groups: list[int], root: int, tree: list[tuple[_Candidate, int, int]]) -> list[int]:
        """Root first, then as the tree reaches them."""
        found = [root, *(down for _, _, down in tree)]
        return found + [k for k in groups if k not in found]

    def _joints(
        self,
        tree: list[tuple[_Candidate, int, int]],
        loops: list[_Candidate],
        weak: list[_Candidate],
        names: dict[int, str],
        owner: dict[int, int],
        moving_of: dict[_Candidate, tuple[int, ...]],
    ) -> tuple[tuple[SuggestedJoint, ...], tuple[SuggestedWheel, ...]]:
        joints, wheels = [], []
        taken: Counter = Counter()

        def unique(name: str) -> str:
            taken[name] += 1
            return name if taken[name] == 1 else f"{name}_{taken[name]}"

        for c, up, down in tree:
            moving = tuple(i for i, k in sorted(owner.items()) if k == down)
            joints.append(self._joint(c, unique(names[down]), names[up], names[down], moving, False))
            if c.wheel is not None and c.wheel.confidence >= THRESHOLD and self.g.group[c.wheel.group] == down:
                wheels.append(self._wheel_of(c.wheel, joints[-1].name, names[down]))
        for c in loops:
            a, b = names[self.g.group[c.a]], names[self.g.group[c.b]]
            joints.append(self._joint(c, unique(f"{a}_{b}_closure"), a, b, (), True))
        for c in weak:
            name = names[self.g.group[c.a]]
            other = names[self.g.group[c.b]]
            if name != other:
                joints.append(self._joint(c, unique(f"{name}_{other}_closure"), name, other, (), True))
                continue
            moving = moving_of.get(c, ())
            child = _slug(self.assembly.instances[moving[0]].path.rsplit("/", 1)[-1]) if moving else name
            joints.append(self._joint(c, unique(child or "joint"), name, name, moving, False))
        return tuple(joints), tuple(wheels)

    def _joint(self, c: _Candidate, name: str, parent: str, child: str, moving: tuple[int, ...], loop: bool) -> SuggestedJoint:
        return SuggestedJoint(
            name=name,
            kind=c.kind,
            parent=parent,
            child=child,
            point=_clean(c.point),
            axis=_clean(_positive(c.axis)),
            confidence=round(c.confidence, 2),
            evidence=tuple(text for _, text in c.found),
            doubts=tuple(text for _, text in c.doubts),
            moving=moving,
            loop=loop,
        )

    def _wheel_of(self, w: _Wheel, joint: str, body: str) -> SuggestedWheel:
        s = w.symmetry
        return SuggestedWheel(
            name=joint,
            joint=joint,
            body=body,
            instance=w.instance,
            center=_clean(w.center),
            axis=_clean(w.axis),
            radius=s.rim_radius,
            width=s.width,
            grouser_count=s.grouser_count,
            grouser_height=s.grouser_height,
            grouser_thickness=s.grouser_thickness,
            confidence=round(w.confidence, 2),
            evidence=tuple(w.evidence),
        )

    # --- names

    def _names_of(self, groups: list[int], owner: dict[int, int]) -> dict[int, str]:
        taken: Counter = Counter()
        names = {}
        for k in groups:
            members = [i for i, g in sorted(owner.items()) if g == k]
            name = _slug(self._title(members)) or f"body_{len(names) + 1}"
            taken[name] += 1
            names[k] = name if taken[name] == 1 else f"{name}_{taken[name]}"
        return names

    def _title(self, members: list[int]) -> str:
        """The sub-assembly that holds just these instances, else the largest part's name, else its prototype's."""
        paths = [self.assembly.instances[i].path for i in members]
        parts = [p.split("/") for p in paths]
        common = []
        for level in zip(*parts, strict=False):
            if len(set(level)) > 1:
                break
            common.append(level[0])
        if len(common) > 1:
            return common[-1]
        sizes: dict[int, float] = {}
        for body in self.g.bodies:
            if body.instance in members:
                sizes[body.instance] = max(sizes.get(body.instance, 0.0), body.size)
        largest = max(sorted(sizes) or members, key=lambda i: sizes.get(i, 0.0))
        return paths[members.index(largest)].rsplit("/", 1)[-1]

    def _path(self, i: int) -> str:
        path = self.g.bodies[i].path.split("/")
        return "'" + "/".join(path[1:] or path) + "'"

    def _names(self, a: int, b: int) -> str:
        contacts = self.g.between(a, b).contacts
        if contacts:
            best = max(contacts, key=lambda k: sum(f.area for f in k.faces) + 1e-9 * len(k.fits))
            return f"{self._path(best.first)} and {self._path(best.second)}"
        return f"{self._path(self._largest(a))} and {self._path(self._largest(b))}"

    def _largest(self, group: int) -> int:
        return max(self.g.members[group], key=lambda i: self.g.bodies[i].volume)


_Z = np.array([0.0, 0.0, 1.0])


def _crosses(body: PlacedSolid, wheel: _Wheel, down: Array, reach: float) -> bool:
    """Whether a solid's box reaches below the tangent plane at ``down`` within the wheel's own width and length."""
    corners = _corners_of(body)
    if float((corners @ down).max()) < reach - 1e-6:
        return False
    along = (corners - wheel.center) @ wheel.axis
    across = (corners - wheel.center) @ np.cross(wheel.axis, down)
    half = wheel.symmetry.width / 2
    beside = along.max() < -half or along.min() > half
    ahead = across.max() < -wheel.symmetry.radius or across.min() > wheel.symmetry.radius
    return not beside and not ahead


def _corners_of(body: PlacedSolid) -> Array:
    """Corners of a solid's bounding box [m], shape (8, 3)."""
    return np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (body.high - body.low) + body.low


def _mm(length: float) -> str:
    return f"{length * 1e3:.2f} mm"


def _at(point: Array) -> str:
    return "(" + ", ".join(f"{v * 1e3:.1f}" for v in point) + ") mm"


def _positive(axis: Array) -> Array:
    axis = axis / np.linalg.norm(axis)
    return axis if axis[np.argmax(np.abs(axis) > np.abs(axis).max() - 1e-6)] > 0 else -axis


def _clean(values: Array) -> Array:
    """Rounded to 1e-9, without negative zeros."""
    return np.round(values, 9) + 0.0


def _slug(name: str) -> str:
    """A name for a sheet: letters, digits, underscores; without the counters that CAD programs append."""
    name = re.sub(r"(:\d+|#\d+)$", "", name.strip())
    name = re.sub(r"\s+v\d+$", "", name)
    name = re.sub(r"\W+", "_", name, flags=re.UNICODE).strip("_")
    return name[:40].rstrip("_") if re.search(r"[^\W_]", name) else ""
