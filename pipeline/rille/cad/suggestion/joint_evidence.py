"""What speaks for a joint between two rigid groups, and what against it.

Confidence: independent pieces of evidence each remove a share w_k of the doubt, and every doubt d_k leaves a share of what they found,

    c = (1 - Prod (1 - w_k)) Prod d_k,

read as "of a hundred such findings, a person who knows the machine would confirm about 100 c". The weights are judgements, not measured
frequencies; they are the same for every file.
"""

import math
import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rille.cad.files.assembly import Assembly
from rille.cad.suggestion.contact import COAXIAL, WRAP, FaceContact, Fit, near_pairs, opposed_faces
from rille.cad.suggestion.grouping import Between, Grouping, Line
from rille.cad.suggestion.values import JointKind
from rille.cad.suggestion.wheel_search import Wheel
from rille.cad.suggestion.wording import at, mm

Array = NDArray[np.float64]

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
    "stands": 0.15,  # the machine stands on it, and its bearing is not drawn
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
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(slots=True, kw_only=True, eq=False)
class Candidate:
    """A joint between two groups while it is judged."""

    a: int
    b: int
    kind: JointKind
    point: Array
    axis: Array
    radius: float = 0.0
    found: list[tuple[str, str]] = field(default_factory=list)
    doubts: list[tuple[str, str]] = field(default_factory=list)
    wheel: "Wheel | None" = None

    @property
    def confidence(self) -> float:
        doubt = math.prod(1 - WEIGHTS[k] for k in {k for k, _ in self.found})
        return (1 - doubt) * math.prod(DOUBTS[k] for k in {k for k, _ in self.doubts})

    def other(self, group: int) -> int:
        return self.b if group == self.a else self.a


class JointEvidence:
    """Judges what is between two groups."""

    def __init__(self, assembly: Assembly, grouping: Grouping) -> None:
        self.assembly = assembly
        self.g = grouping

    def candidate(self, a: int, b: int) -> Candidate | None:
        """The joint that the contacts of two groups show, if they show one."""
        between = self.g.between(a, b)
        butt = self.g.butt(a, b)
        if butt is not None and butt.round_axis is not None:
            return self.butt(a, b, butt)
        motion = self.g.mobility(a, b)
        if motion.kind in ("hinge", "cylindrical"):
            return self._hinge(a, b, between, motion.kind == "cylindrical")
        if motion.kind == "prismatic":
            return self._guide(a, b, between, motion.axis)
        if motion.kind == "spherical":
            ball = max(between.balls, key=lambda x: x.radius)
            text = f"a ball of diameter {mm(2 * ball.radius)} of one in a socket of the other, {self._names(a, b)}"
            return Candidate(a=a, b=b, kind="spherical", point=ball.center, axis=_Z, radius=ball.radius, found=[("ball", text)])
        return None

    def _hinge(self, a: int, b: int, between: Between, slides: bool) -> Candidate | None:
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
                doubts.append(("pressed", f"the shaft is drawn {mm(-2 * best.clearance)} thicker than its hole (thread or press fit)"))
        if between.flange is not None:
            count, circle = between.bolt_circle
            radius = radius or circle
            text = f"{count} bolts or holes on a circle of diameter {mm(2 * circle)} about the axis of a round part"
            found.append(("bolt circle", f"{text}, as on the output of an actuator ({self._names(a, b)})"))
        elif all(x.bolts for x in between.lines):
            doubts.append(("screw", "the only shaft is that of a screw: it may be a clamp as well as a pivot"))
        shoulders = [f for f in between.faces if abs(float(f.normal @ axis)) > 0.999]
        if shoulders and between.flange is None:
            best_face = max(shoulders, key=lambda f: f.area)
            found.append(("shoulder", f"faces across the axis touch at {at(best_face.point)} over {best_face.area * 1e6:.0f} mm^2"))
        if slides:
            play = self._play(a, b, axis, 0.1 * max([radius, *(f.length for f in fits)]))
            if play is None:
                doubts.append(("slides", "nothing stops a slide along the axis"))
            else:
                found.append(("shoulder", f"captive between faces across the axis, with {mm(play)} of play"))
        return self._common(Candidate(a=a, b=b, kind="hinge", point=point, axis=axis, radius=radius, found=found, doubts=doubts), between)

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
            f"hole {mm(2 * best.hole)} of {self.path(best.hole_owner)} around shaft {mm(2 * best.shaft)} of {self.path(shaft_owner)}, "
            f"coaxial within {best.offset * 1e3:.3f} mm, engaged over {mm(best.length)}"
        )
        if best.rolling:
            text += f", {best.rolling} balls roll between them"
        close = best.rolling or best.clearance <= 0.03 * best.hole + 2e-5
        found = [("close fit" if close else "loose fit", text)]
        heights = [float((f.point - best.point) @ best.axis) for f in fits]
        apart = max(heights) - min(heights)
        if apart > 2 * best.hole:
            found.append(("two bearings", f"held at {len(fits)} places of the axis, up to {mm(apart)} apart"))
        ring = next((i for i in (best.hole_owner, shaft_owner) if self._is_ring(i, best)), None)
        if ring is not None:
            found.append(("bearing", f"{self.path(ring)} is a ring between shaft and seat, as a bearing is"))
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

    def _guide(self, a: int, b: int, between: Between, axis: Array) -> Candidate | None:
        lines = [x for x in between.lines if x.fits and not x.bolts]
        if len(lines) >= 2:
            sizes = ", ".join(sorted({mm(2 * x.fits[0].hole) for x in lines}))
            apart = max(x.distance(lines[0].point) for x in lines)
            text = f"{len(lines)} parallel guides (holes {sizes}, up to {mm(apart)} apart) and no face across them: {self._names(a, b)}"
            made = Candidate(
                a=a, b=b, kind="prismatic", point=lines[0].point, axis=axis, radius=lines[0].fits[0].hole, found=[("guides", text)]
            )
            return self._common(made, between)
        if between.lines or any(abs(float(f.normal @ axis)) > 0.01 for f in between.faces) or between.unexplained:
            return None
        area = sum(f.area for f in between.faces)
        point = sum((f.area * f.point for f in between.faces), np.zeros(3)) / area
        text = f"{len(between.faces)} faces on both sides in two directions and none across, {area * 1e6:.0f} mm^2: {self._names(a, b)}"
        made = Candidate(a=a, b=b, kind="prismatic", point=point, axis=axis, found=[("slot", text)])
        length, across = self._guided_length(a, b, axis), self._spread(between.faces, axis)
        if length > 1.5 * across:
            made.found.append(("long guide", f"guided over {mm(length)}, {length / across:.1f} times its width"))
        return self._common(made, between)

    def _guided_length(self, a: int, b: int, axis: Array) -> float:
        """How far two groups overlap along an axis [m]."""
        ends = []
        for group in (a, b):
            boxes = [self.g.bodies[i] for i in self.g.members[group]]
            along = np.concatenate([body.corners for body in boxes]) @ axis
            ends.append((float(along.min()), float(along.max())))
        return min(ends[0][1], ends[1][1]) - max(ends[0][0], ends[1][0])

    def _spread(self, faces: list[FaceContact], axis: Array) -> float:
        """Distance of the outermost faces from each other across an axis [m]."""
        points = np.array([f.point for f in faces])
        points = points - np.outer(points @ axis, axis)
        return max(float(np.linalg.norm(p - q)) for p in points for q in points)

    def butt(self, a: int, b: int, face: FaceContact) -> Candidate:
        """A hinge about a round end that faces the other side."""
        gap = f", {mm(face.gap)} apart" if face.gap > COAXIAL else ", touching"
        if face.rotor:
            evidence = (
                "rotor",
                f"round end {mm(2 * face.round_radius)} at {at(face.point)} stands in an annular gap of its own part{gap}",
            )
        elif face.both_round:
            evidence = ("round ends", f"two concentric round ends, the smaller {mm(2 * face.round_radius)}, at {at(face.point)}{gap}")
        else:
            evidence = ("round end", f"round end {mm(2 * face.round_radius)} before a flat at {at(face.point)}{gap}")
        point = face.round_axis if face.round_axis is not None else face.point
        made = Candidate(a=a, b=b, kind="hinge", point=point, axis=face.normal, radius=face.round_radius, found=[evidence])
        made.found[0] = (evidence[0], f"{evidence[1]}: {self._names(a, b)}")
        return self._common(made, self.g.between(a, b))

    def _common(self, c: Candidate, between: Between) -> Candidate:
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

    def wide_fit(self, a: int, b: int, i: int, j: int, fit: Fit) -> Candidate:
        """A hinge about a shaft in a much wider hole."""
        shaft_owner = j if fit.hole_owner == i else i
        text = (
            f"hole {mm(2 * fit.hole)} of {self.path(fit.hole_owner)} around shaft {mm(2 * fit.shaft)} of {self.path(shaft_owner)}, "
            f"coaxial within {fit.offset * 1e3:.3f} mm; what fills the gap of {mm(fit.clearance)} is not drawn"
        )
        made = Candidate(a=a, b=b, kind="hinge", point=fit.point, axis=fit.axis, radius=fit.hole, found=[("wide fit", text)])
        return self._common(made, self.g.between(a, b))

    def unheld(self, a: int, b: int, line: Line, i: int, j: int) -> Candidate:
        """A hinge about the axis of a wheel that no bearing holds, between its solid i and j of what carries it."""
        text = f"the machine stands on {self.path(i)}; a bearing on its axis is not drawn, its holder would be {self.path(j)}"
        made = Candidate(a=a, b=b, kind="hinge", point=line.point, axis=line.axis, found=[("stands", text)])
        return self._common(made, self.g.between(a, b))

    def path(self, i: int) -> str:
        """Path of a solid below the root, quoted."""
        path = self.g.bodies[i].path.split("/")
        return "'" + "/".join(path[1:] or path) + "'"

    def _names(self, a: int, b: int) -> str:
        """The two solids with the largest contact."""
        contacts = self.g.between(a, b).contacts
        if contacts:
            best = max(contacts, key=lambda k: sum(f.area for f in k.faces) + 1e-9 * len(k.fits))
            return f"{self.path(best.first)} and {self.path(best.second)}"
        return f"{self.path(self.largest(a))} and {self.path(self.largest(b))}"

    def largest(self, group: int) -> int:
        """The solid of a group with the most volume."""
        return max(self.g.members[group], key=lambda i: self.g.bodies[i].volume)
