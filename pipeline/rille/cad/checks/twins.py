"""Do the two sides of a machine agree? Twins are found by name and by shape; no plane needs to be told."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.cad.checks.body_shape import BodyShape, Surface
from rille.cad.checks.finding import Finding
from rille.model import Body, Joint, Rover, Wheel
from rille.model.severity import Severity

Array = NDArray[np.float64]

AGREE = 5e-3
"""Relative difference that twins may have: pairs of machined parts weigh within 0.5 %."""
AXIS_ANGLE = np.deg2rad(0.1)

_SIDES = [("left", "right"), ("lh", "rh"), ("l", "r"), ("fl", "fr"), ("ml", "mr"), ("rl", "rr"), ("bl", "br"), ("port", "starboard")]
_OTHER = {a: b for pair in _SIDES for a, b in (pair, pair[::-1])}
_WORD = re.compile(r"(?<![^\W\d_])(?i:" + "|".join(sorted(_OTHER, key=len, reverse=True)) + r")(?![^\W\d_])|(?:Left|Right)(?![a-z])")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mirror:
    """Plane n . x = offset [m]."""

    normal: Array
    offset: float

    def point(self, p: Array) -> Array:
        """Mirror image of a point."""
        return p - 2 * (self.normal @ p - self.offset) * self.normal

    @property
    def matrix(self) -> Array:
        """Reflection of directions, E - 2 n n^T."""
        return np.eye(3) - 2 * np.outer(self.normal, self.normal)


def other_name(name: str) -> str | None:
    """The name with left for right, and the other way round; None for a name that tells no side."""

    def turn(match: re.Match[str]) -> str:
        word = match.group(0)
        made = _OTHER[word.lower()]
        return made.upper() if word.isupper() else made.capitalize() if word[0].isupper() else made

    made = _WORD.sub(turn, name)
    return None if made == name else made


def check_twins(rover: Rover, shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """Mass, centre, inertia, axes, limits, drives and wheels of mirrored twins."""
    bodies = {body.name: body for body in rover.bodies}
    named = [(a, b) for a in bodies if (b := other_name(a)) in bodies and a < str(b)]
    for name in bodies:
        twin = other_name(name)
        if twin is not None and twin not in bodies:
            yield _finding(
                "twins.missing",
                "note",
                name,
                None,
                None,
                "",
                f"body '{name}' is named after one side, but there is no '{twin}'; add it, or rename the body if it has no twin",
            )
    named = [(str(a), str(b)) for a, b in named]
    loose = [name for name in bodies if other_name(name) not in bodies]
    size = _model_size(rover, shapes)
    mirror = _plane([(_middle(bodies[a], shapes[a]), _middle(bodies[b], shapes[b])) for a, b in named], 1e-3 * size, 1)
    if mirror is None:
        alike = [(a, b) for k, a in enumerate(loose) for b in loose[:k] if _congruent(shapes[a], shapes[b])]
        mirror = _plane([(_middle(bodies[a], shapes[a]), _middle(bodies[b], shapes[b])) for a, b in alike], 1e-3 * size, 2)
    if mirror is None:
        return
    pairs = [(a, b) for a, b in named]
    pairs += [(b, a) for k, a in enumerate(loose) for b in loose[:k] if _mirrored(shapes[a], shapes[b], mirror)]
    for a, b in pairs:
        yield from _masses(bodies[a], bodies[b], shapes, mirror)
        yield from _joints(a, b, rover, mirror, max(shapes[a].size, shapes[b].size) or size)


def _finding(code: str, severity: Severity, subject: str, value: float | None, bound: float | None, unit: str, sentence: str) -> Finding:
    return Finding(code=code, severity=severity, subject=subject, value=value, bound=bound, unit=unit, sentence=sentence)


def _model_size(rover: Rover, shapes: Mapping[str, BodyShape]) -> float:
    points = [shape.vertices for shape in shapes.values() if shape.pieces] + [np.array([b.properties.com for b in rover.bodies])]
    cloud = np.concatenate(points)
    return float(np.linalg.norm(cloud - cloud.mean(axis=0), axis=1).max())


def _middle(body: Body, shape: BodyShape) -> Array:
    return shape.surface.centroid if shape.pieces else np.asarray(body.properties.com, float)


def _plane(pairs: list[tuple[Array, Array]], tolerance: float, least: int) -> Mirror | None:
    """The plane that most pairs of points are mirrored in; None if fewer than ``least`` agree."""
    best: list[Mirror] = []
    for a, b in pairs:
        normal = b - a
        if np.linalg.norm(normal) < tolerance:
            continue
        normal = normal / np.linalg.norm(normal)
        guess = Mirror(normal=normal, offset=float(normal @ (a + b) / 2))
        agreeing = [(p, q) for p, q in pairs if np.linalg.norm(q - p) > tolerance and np.linalg.norm(guess.point(p) - q) < tolerance]
        if len(agreeing) > len(best):
            best = [_through(p, q, normal) for p, q in agreeing]
    if len(best) < least:
        return None
    normal = np.mean([m.normal for m in best], axis=0)
    return Mirror(normal=normal / np.linalg.norm(normal), offset=float(np.mean([m.offset for m in best])))


def _through(p: Array, q: Array, along: Array) -> Mirror:
    normal = (q - p) / np.linalg.norm(q - p)
    normal = normal if normal @ along > 0 else -normal
    return Mirror(normal=normal, offset=float(normal @ (p + q) / 2))


def _alike(a: Surface, b: Surface) -> bool:
    return a.area > 0 and b.area > 0 and abs(a.area - b.area) <= 0.01 * max(a.area, b.area)


def _congruent(a: BodyShape, b: BodyShape) -> bool:
    """Same area and the same principal moments of the surface."""
    if not a.pieces or not b.pieces or not _alike(a.surface, b.surface):
        return False
    first, second = np.linalg.eigvalsh(a.surface.second), np.linalg.eigvalsh(b.surface.second)
    return float(np.abs(first - second).max()) <= 0.01 * float(first.max())


def _mirrored(a: BodyShape, b: BodyShape, mirror: Mirror) -> bool:
    """Area, its centroid and its second moments are mirror images."""
    if not a.pieces or not b.pieces or not _alike(a.surface, b.surface):
        return False
    tolerance = AGREE * max(a.size, b.size) + a.tolerance + b.tolerance
    turned = mirror.matrix @ a.surface.second @ mirror.matrix
    return (
        float(np.linalg.norm(a.surface.centroid - b.surface.centroid)) > tolerance
        and float(np.linalg.norm(mirror.point(a.surface.centroid) - b.surface.centroid)) <= tolerance
        and float(np.abs(turned - b.surface.second).max()) <= 0.01 * float(np.trace(turned))
    )


def _masses(a: Body, b: Body, shapes: Mapping[str, BodyShape], mirror: Mirror) -> Iterator[Finding]:
    known = bool(shapes[a.name].pieces and shapes[b.name].pieces)
    is_mirrored = not known or _mirrored(shapes[a.name], shapes[b.name], mirror)
    pair = f"'{a.name}' and '{b.name}'"
    subject = f"{a.name}, {b.name}"
    if not is_mirrored and not _congruent(shapes[a.name], shapes[b.name]):
        apart = float(np.linalg.norm(mirror.point(shapes[a.name].surface.centroid) - shapes[b.name].surface.centroid))
        bound = AGREE * max(shapes[a.name].size, shapes[b.name].size)
        yield _finding(
            "twins.geometry",
            "note",
            subject,
            apart,
            bound,
            "m",
            f"bodies {pair} are named as twins, but their shapes are neither mirrored nor congruent (middles {apart * 1e3:.4g} mm from "
            "mirrored, "
            f"allowed {bound * 1e3:.3g} mm), so their masses are not compared; check that each has the right parts, or rename them",
        )
        return
    ma, mb = a.properties.mass, b.properties.mass
    if not abs(ma - mb) <= AGREE * max(ma, mb):
        yield _finding(
            "twins.mass",
            "warning",
            subject,
            abs(ma - mb),
            AGREE * max(ma, mb),
            "kg",
            f"twins {pair} weigh {ma:.6g} kg and {mb:.6g} kg, a difference of {abs(ma - mb) / max(ma, mb):.3%} (allowed {AGREE:.1%}); "
            "state the same masses or materials on both sides",
        )
    first, second = np.asarray(a.properties.inertia, float), np.asarray(b.properties.inertia, float)
    moments = np.linalg.eigvalsh(first) - np.linalg.eigvalsh(second)
    scale = max(float(np.abs(first).max()), float(np.abs(second).max()))
    difference = float(np.abs(moments).max())
    if is_mirrored:
        size = max(shapes[a.name].size, shapes[b.name].size) or 1.0
        bound = AGREE * size + shapes[a.name].tolerance
        apart = float(np.linalg.norm(mirror.point(np.asarray(a.properties.com, float)) - b.properties.com))
        if apart > bound:
            yield _finding(
                "twins.com",
                "warning",
                subject,
                apart,
                bound,
                "m",
                f"centre of mass of '{b.name}' is {apart * 1e3:.4g} mm away from the mirror image of that of its twin '{a.name}' "
                f"(allowed {bound * 1e3:.3g} mm); correct a stated `com`, or the density of a part on one side",
            )
        difference = max(difference, float(np.abs(mirror.matrix @ first @ mirror.matrix - second).max()))
    if difference > AGREE * scale:
        yield _finding(
            "twins.inertia",
            "warning",
            subject,
            difference,
            AGREE * scale,
            "kg m^2",
            f"inertias of the twins {pair} differ by {difference:.4g} kg m^2 after mirroring (allowed {AGREE * scale:.3g}: {AGREE:.1%}); "
            "a mirrored part that was weighed like its original? correct the stated inertia (products change their sign across the plane)",
        )


def _joints(a: str, b: str, rover: Rover, mirror: Mirror, size: float) -> Iterator[Finding]:
    carrier = {joint.child: joint for joint in rover.joints}
    if a not in carrier or b not in carrier or carrier[a].kind != carrier[b].kind:
        return
    first, second = carrier[a], carrier[b]
    if first.kind not in ("hinge", "prismatic"):
        return
    subject = f"{first.name}, {second.name}"
    image = mirror.matrix @ np.array(first.axis)
    axis = np.array(second.axis)
    angle = float(np.arctan2(np.linalg.norm(np.cross(image, axis)), abs(image @ axis)))
    offset = mirror.point(np.array(first.point)) - np.array(second.point)
    apart = float(np.linalg.norm(np.cross(offset, axis))) if first.kind == "hinge" else 0.0
    if angle > AXIS_ANGLE or apart > AGREE * size:
        yield _finding(
            "joint.axis_pair",
            "warning",
            subject,
            angle if angle > AXIS_ANGLE else apart,
            AXIS_ANGLE if angle > AXIS_ANGLE else AGREE * size,
            "rad" if angle > AXIS_ANGLE else "m",
            f"axes of the twin joints '{first.name}' and '{second.name}' are {np.rad2deg(angle):.3g} deg and {apart * 1e3:.4g} mm from "
            "mirrored "
            f"(allowed 0.1 deg and {AGREE * size * 1e3:.3g} mm); correct axis or point of one of them",
        )
        return
    same = float(image @ axis) * (-1 if first.kind == "hinge" else 1) > 0  # a hinge's axis is a pseudovector
    yield from _limits(first, second, same)
    yield from _drives(first, second, rover)
    wheels = {wheel.joint: wheel for wheel in rover.wheels}
    if first.name in wheels and second.name in wheels:
        yield from _wheels(wheels[first.name], wheels[second.name])


def _limits(a: Joint, b: Joint, same: bool) -> Iterator[Finding]:
    unit = "m" if a.kind == "prismatic" else "rad"
    if a.limit is None and b.limit is None:
        return
    if a.limit is None or b.limit is None:
        value, bound, how = None, None, "one has limits, the other has none"
    else:
        expected = (a.limit.lower, a.limit.upper) if same else (-a.limit.upper, -a.limit.lower)
        value = max(abs(b.limit.lower - expected[0]), abs(b.limit.upper - expected[1]))
        bound = AGREE * max(a.limit.upper - a.limit.lower, 1e-9)
        if value <= bound:
            return
        show = np.rad2deg if unit == "rad" else (lambda v: v * 1e3)
        shown = "deg" if unit == "rad" else "mm"
        how = (
            f"those of '{b.name}' are {show(b.limit.lower):.4g} .. {show(b.limit.upper):.4g} {shown}, "
            f"mirrored they would be {show(expected[0]):.4g} .. {show(expected[1]):.4g} {shown}"
        )
    yield _finding(
        "twins.limit",
        "warning",
        f"{a.name}, {b.name}",
        value,
        bound,
        unit,
        f"limits of the twin joints '{a.name}' and '{b.name}' do not mirror each other: {how}; correct one of them",
    )


def _drives(a: Joint, b: Joint, rover: Rover) -> Iterator[Finding]:
    drives = {drive.joint: drive for drive in rover.drives}
    first, second = drives.get(a.name), drives.get(b.name)
    if first is None and second is None:
        return
    if first is None or second is None:
        value, bound, how = None, None, "one of them has no drive"
    elif first.mode != second.mode:
        value, bound, how = None, None, f"modes {first.mode} and {second.mode}"
    elif abs(first.max_torque - second.max_torque) > AGREE * max(first.max_torque, second.max_torque):
        value, bound = abs(first.max_torque - second.max_torque), AGREE * max(first.max_torque, second.max_torque)
        how = f"largest efforts {first.max_torque:.4g} and {second.max_torque:.4g}"
    elif (first.max_speed or 0.0) != (second.max_speed or 0.0):
        value, bound = abs((first.max_speed or 0.0) - (second.max_speed or 0.0)), 0.0
        how = f"largest speeds {first.max_speed} and {second.max_speed}"
    else:
        return
    yield _finding(
        "twins.drive",
        "warning",
        f"{a.name}, {b.name}",
        value,
        bound,
        "",
        f"drives of the twin joints '{a.name}' and '{b.name}' differ: {how}; give both the same drive",
    )


def _wheels(a: Wheel, b: Wheel) -> Iterator[Finding]:
    for what in ("radius", "width"):
        va, vb = getattr(a, what), getattr(b, what)
        if abs(va - vb) > AGREE * max(va, vb):
            yield _finding(
                "twins.wheel",
                "warning",
                f"{a.name}, {b.name}",
                abs(va - vb),
                AGREE * max(va, vb),
                "m",
                f"{what} of the twin wheels '{a.name}' and '{b.name}' is {va * 1e3:.5g} mm and {vb * 1e3:.5g} mm (allowed difference "
                f"{AGREE:.1%}); "
                "correct one of them",
            )
    if (a.grouser and a.grouser.count) != (b.grouser and b.grouser.count):
        counts = [w.grouser.count if w.grouser else 0 for w in (a, b)]
        yield _finding(
            "twins.wheel",
            "warning",
            f"{a.name}, {b.name}",
            float(abs(counts[0] - counts[1])),
            0.0,
            "",
            f"twin wheels '{a.name}' and '{b.name}' have {counts[0]} and {counts[1]} grousers; correct one of them",
        )
