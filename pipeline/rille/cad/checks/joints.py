"""Checks of joints, limits, gears, differentials, loops, wheels and drives."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from rille.cad.checks.body_shape import BodyShape
from rille.cad.checks.finding import Finding
from rille.cad.checks.linkage import FREEDOM, Linkage
from rille.model import Joint, Rover, Wheel
from rille.model.severity import Severity

Array = NDArray[np.float64]

NEAR = 0.1
"""A joint is near a body if it is not farther away than this part of the larger body's size."""
GRAVITY = 9.81
STEEPEST = np.radians(30.0)
"""Largest angle [rad] between a wheel's axis and the ground in the pose as built; cambered wheels stay well below."""


def check_joints(rover: Rover, shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """Axes, places and limits."""
    for joint in rover.joints:
        yield from _axis(joint)
        yield from _near(joint, shapes)
        yield from _limits(joint)


def check_couplings(rover: Rover) -> Iterator[Finding]:
    """Gears and differentials: what they couple, and whether the limits fit."""
    joints = {joint.name: joint for joint in rover.joints}
    for gear in rover.gears:
        a, b = joints[gear.joint_a], joints[gear.joint_b]
        bad = next((j for j in (a, b) if FREEDOM[j.kind] != 1), None)
        if a is b or bad is not None or not np.isfinite(gear.ratio) or gear.ratio == 0:
            why = f"couples joint '{a.name}' with itself" if a is b else f"ratio is {gear.ratio:g}"
            why = why if bad is None else f"couples '{bad.name}', which is {bad.kind}"
            yield _finding(
                "gear.ratio",
                "error",
                gear.name,
                gear.ratio,
                0.0,
                "",
                f"gear '{gear.name}' {why}; it needs two different hinges or slides and a finite ratio other than 0",
            )
        else:
            yield from _coupled_limits("gear", gear.name, a, b, gear.ratio)
    for differential in rover.differentials:
        a, b = joints[differential.joint_a], joints[differential.joint_b]
        wrong = [j for j in (a, b) if j.kind != "hinge" or j.parent != differential.carrier]
        angle = _angle(np.array(a.axis), np.array(b.axis))
        if wrong or a is b or angle > 1e-3:
            how = (
                f"joint '{wrong[0].name}' is a {wrong[0].kind} joint carried by '{wrong[0].parent}'"
                if wrong
                else "both joints are the same"
                if a is b
                else f"its hinges are {np.rad2deg(angle):.3g} deg from parallel (allowed 0.06)"
            )
            yield _finding(
                "differential.axes",
                "error",
                differential.name,
                angle,
                1e-3,
                "rad",
                f"differential '{differential.name}': {how}; it needs two parallel hinges on its carrier '{differential.carrier}'",
            )
        else:
            yield from _coupled_limits("differential", differential.name, a, b, -1.0 if np.dot(a.axis, b.axis) >= 0 else 1.0)


def check_loops(rover: Rover, shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """Loops close at a point of both bodies, and the constraints leave the mechanism its freedom."""
    for loop in rover.loop_closures:
        for body in (loop.body_a, loop.body_b):
            if body is None or not shapes[body].pieces:
                continue
            distance = shapes[body].hull.outside(np.array(loop.point))
            bound = NEAR * shapes[body].size + shapes[body].tolerance
            if distance > bound:
                yield _finding(
                    "loop.open",
                    "error",
                    loop.name,
                    distance,
                    bound,
                    "m",
                    f"loop '{loop.name}' closes at a point {distance * 1e3:.4g} mm away from body '{body}' at the zero pose "
                    f"(allowed {bound * 1e3:.3g} mm); correct its point, or move the parts so that the loop is closed in the drawing",
                )
    if not (rover.loop_closures or rover.gears or rover.differentials):
        return
    count = Linkage(rover).mobility()
    extra = count.constraints - count.rank
    if count.joints > 0 and count.inner == 0:
        yield _finding(
            "mobility.locked",
            "error",
            "mechanism",
            0.0,
            1.0,
            "",
            f"{count.constraints} constraints leave 0 of the {count.joints} freedoms of the joints at the zero pose; at least 1 must be "
            "left: "
            "take out a gear, a differential or a loop, or add the joint that is missing in the loop",
        )
    elif extra > 0:
        yield _finding(
            "mobility.redundant",
            "note",
            "mechanism",
            float(extra),
            0.0,
            "",
            f"{extra} of {count.constraints} constraints depend on the others at the zero pose, {count.inner} motions of the joints are "
            "left; "
            "a planar loop has one too many by nature, otherwise take out a gear, a differential or a loop that says the same twice",
        )


def check_wheels(rover: Rover, shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """Level axis, centre on it, geometry and mass around the axis, radius and width as drawn, steering through the centre."""
    joints = {joint.name: joint for joint in rover.joints}
    bodies = {body.name: body for body in rover.bodies}
    linkage = Linkage(rover)
    for wheel in rover.wheels:
        joint = joints[wheel.joint]
        if joint.kind != "hinge":
            yield _finding(
                "wheel.joint",
                "error",
                wheel.name,
                None,
                None,
                "",
                f"wheel '{wheel.name}' turns on joint '{joint.name}', which is {joint.kind}; it needs a hinge",
            )
            continue
        axis = _unit(np.array(joint.axis))
        yield from _level(wheel, joint, axis)
        off = _off_axis(np.array(wheel.center), joint)
        bound = 1e-3 * wheel.radius
        if off > bound:
            yield _finding(
                "wheel.center",
                "error",
                wheel.name,
                off,
                bound,
                "m",
                f"centre of wheel '{wheel.name}' is {off * 1e3:.4g} mm off the axis of its hinge '{joint.name}' (allowed "
                f"{bound * 1e3:.3g} mm: "
                "0.1 % of the radius); correct the wheel's centre or the joint's point",
            )
        heavy = _off_axis(np.asarray(bodies[joint.child].properties.com, float), joint)
        bound = 0.02 * wheel.radius
        if heavy > bound:
            yield _finding(
                "wheel.unbalanced",
                "warning",
                wheel.name,
                heavy,
                bound,
                "m",
                f"centre of mass of wheel '{wheel.name}' is {heavy * 1e3:.4g} mm off its axis (allowed {bound * 1e3:.3g} mm: 2 % of the "
                "radius); "
                f"correct the point of joint '{joint.name}', or the parts of body '{joint.child}'",
            )
        aside = abs(float(axis @ (np.asarray(bodies[joint.child].properties.com, float) - np.array(wheel.center))))
        if aside > wheel.width:
            yield _finding(
                "wheel.aside",
                "warning",
                wheel.name,
                aside,
                wheel.width,
                "m",
                f"centre of wheel '{wheel.name}' is {aside * 1e3:.4g} mm along its axis from the centre of mass of body '{joint.child}' "
                f"(allowed {wheel.width * 1e3:.3g} mm: its width); correct the wheel's `center`",
            )
        if shapes[joint.child].pieces:
            yield from _wheel_shape(wheel, joint, axis, shapes[joint.child])
        yield from _steering(wheel, joint, axis, linkage)


def check_drives(rover: Rover) -> Iterator[Finding]:
    """Largest effort against what gravity asks at worst: m g r for a hinge, m g for a slide, of all that the joint carries."""
    linkage = Linkage(rover)
    bodies = {body.name: body for body in rover.bodies}
    wheels = {wheel.joint for wheel in rover.wheels}
    looped = {loop.body_a for loop in rover.loop_closures} | {loop.body_b for loop in rover.loop_closures}
    for drive in rover.drives:
        joint = linkage.joints[drive.joint]
        carried = linkage.subtree(joint.child)
        if drive.joint in wheels or joint.kind not in ("hinge", "prismatic") or looped.intersection(carried):
            continue
        mass = sum(bodies[name].properties.mass for name in carried)
        if not mass > 0:
            continue
        com = sum((bodies[name].properties.mass * np.asarray(bodies[name].properties.com) for name in carried), np.zeros(3)) / mass
        arm = _off_axis(com, joint)
        need = mass * GRAVITY * (arm if joint.kind == "hinge" else 1.0)
        if drive.max_torque < need:
            unit = "N m" if joint.kind == "hinge" else "N"
            lever = f" at {arm * 1e3:.4g} mm from the axis" if joint.kind == "hinge" else ""
            yield _finding(
                "drive.weak",
                "note",
                drive.name,
                drive.max_torque,
                need,
                unit,
                f"drive '{drive.name}' gives at most {drive.max_torque:.4g} {unit}; holding the {mass:.4g} kg that joint '{joint.name}' "
                f"carries{lever} "
                f"can ask {need:.4g} {unit} on Earth in the worst direction; fine if it never lifts them, else give it a higher effort",
            )


def _finding(code: str, severity: Severity, subject: str, value: float | None, bound: float | None, unit: str, sentence: str) -> Finding:
    return Finding(code=code, severity=severity, subject=subject, value=value, bound=bound, unit=unit, sentence=sentence)


def _unit(v: Array) -> Array:
    return v / max(float(np.linalg.norm(v)), 1e-300)


def _angle(a: Array, b: Array) -> float:
    """Angle between two lines [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b)))


def _off_axis(point: Array, joint: Joint) -> float:
    return float(np.linalg.norm(np.cross(point - np.array(joint.point), _unit(np.array(joint.axis)))))


def _axis(joint: Joint) -> Iterator[Finding]:
    length = float(np.linalg.norm(joint.axis))
    if joint.kind in ("hinge", "prismatic") and not abs(length - 1) <= 1e-6:
        yield _finding(
            "joint.axis_unit",
            "error",
            joint.name,
            length,
            1.0,
            "",
            f"axis of joint '{joint.name}' has the length {length:.9g}; it must be 1, give a direction that is not zero and build the "
            "model again",
        )


def _near(joint: Joint, shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """A hinge's axis passes through both bodies, a ball's centre lies in them; a slide may be anywhere beside, a fixed joint has no "
    "place."""
    if joint.kind not in ("hinge", "spherical"):
        return
    sides = [shapes[name] for name in (joint.parent, joint.child) if name is not None and shapes[name].pieces]
    bound = NEAR * max((shape.size for shape in sides), default=0.0) + max((shape.tolerance for shape in sides), default=0.0)
    point, hinge = np.array(joint.point), joint.kind == "hinge"

    def distance(shape: BodyShape) -> float:
        return shape.hull.line_outside(point, _unit(np.array(joint.axis))) if hinge else shape.hull.outside(point)

    if not sides:
        return
    farthest = max(sides, key=distance)
    if distance(farthest) > bound:
        yield _finding(
            "joint.far",
            "warning",
            joint.name,
            distance(farthest),
            bound,
            "m",
            f"{'axis of hinge' if hinge else 'centre of ball joint'} '{joint.name}' passes body '{farthest.name}' at "
            f"{distance(farthest) * 1e3:.4g} mm (allowed {bound * 1e3:.3g} mm: a tenth of the larger body's size); "
            "correct its point or axis (units, frame of the drawing?)",
        )


def _limits(joint: Joint) -> Iterator[Finding]:
    limit = joint.limit
    if limit is None or joint.kind not in ("hinge", "prismatic"):
        return
    unit = "rad" if joint.kind == "hinge" else "m"

    def show(v: float) -> str:
        return f"{np.rad2deg(v):.4g} deg" if unit == "rad" else f"{v * 1e3:.4g} mm"

    if not limit.lower < limit.upper:
        yield _finding(
            "limits.order",
            "error",
            joint.name,
            limit.lower,
            limit.upper,
            unit,
            f"lower limit of joint '{joint.name}' is {show(limit.lower)}, not below the upper one of {show(limit.upper)}; exchange them, "
            'or make the joint "fixed"',
        )
        return
    if not limit.lower - 1e-9 <= 0 <= limit.upper + 1e-9:
        nearest = limit.lower if limit.lower > 0 else limit.upper
        yield _finding(
            "limits.zero_outside",
            "warning",
            joint.name,
            0.0,
            nearest,
            unit,
            f"zero pose of joint '{joint.name}' lies outside of its limits {show(limit.lower)} .. {show(limit.upper)}; limits are "
            "counted from the "
            "pose of the drawing: correct them, or state an initial position in every scenario",
        )
    if unit == "rad" and limit.upper - limit.lower > 4 * np.pi * (1 + 1e-9):
        yield _finding(
            "limits.units",
            "warning",
            joint.name,
            limit.upper - limit.lower,
            4 * np.pi,
            "rad",
            f"limits of hinge '{joint.name}' span {limit.upper - limit.lower:.4g} rad ({show(limit.upper - limit.lower)}), more than two "
            "turns; "
            'write degrees with their unit ("35 deg"), or leave the limits out',
        )


def _coupled_limits(kind: str, name: str, a: Joint, b: Joint, ratio: float) -> Iterator[Finding]:
    """The range of a, seen at b, against the range of b."""
    if a.limit is None or b.limit is None or a.limit.lower >= a.limit.upper or b.limit.lower >= b.limit.upper:
        return
    low, high = sorted((ratio * a.limit.lower, ratio * a.limit.upper))
    value = max(abs(low - b.limit.lower), abs(high - b.limit.upper))
    bound = 0.01 * max(high - low, b.limit.upper - b.limit.lower)
    if value > bound:
        unit = "rad" if b.kind == "hinge" else "m"
        show = np.rad2deg if unit == "rad" else (lambda v: v * 1e3)
        shown = "deg" if unit == "rad" else "mm"
        yield _finding(
            f"{kind}.limits",
            "warning",
            name,
            value,
            bound,
            unit,
            f"{kind} '{name}' takes joint '{b.name}' through {show(low):.4g} .. {show(high):.4g} {shown} when '{a.name}' goes through "
            "its range, but "
            f"the limits of '{b.name}' are {show(b.limit.lower):.4g} .. {show(b.limit.upper):.4g} {shown}; one of them is never reached, "
            "make them agree",
        )


def _level(wheel: Wheel, joint: Joint, axis: Array) -> Iterator[Finding]:
    """A wheel rolls on the ground (z is up) only about an axis that is nearly level."""
    steep = float(np.arcsin(min(abs(axis[2]), 1.0)))
    if steep > STEEPEST:
        yield _finding(
            "wheel.axis",
            "warning",
            wheel.name,
            steep,
            float(STEEPEST),
            "rad",
            f"axis of wheel '{wheel.name}' stands {np.rad2deg(steep):.3g} deg off the level in the pose as built (allowed "
            f"{np.rad2deg(STEEPEST):.3g} deg), so it cannot roll on the ground; correct the axis of joint '{joint.name}', or the "
            "sheet's `up`",
        )


def _wheel_shape(wheel: Wheel, joint: Joint, axis: Array, shape: BodyShape) -> Iterator[Finding]:
    arms = shape.vertices - np.array(joint.point)
    along = arms @ axis
    radial = arms - along[:, None] * axis
    outermost = float(np.linalg.norm(radial, axis=1).max())
    basis = np.linalg.svd(axis[None, :])[2][1:]
    eccentric = _off_axis(shape.surface.centroid, joint)
    bound = 0.02 * wheel.radius + shape.tolerance
    if eccentric > bound:
        yield _finding(
            "wheel.eccentric",
            "warning",
            wheel.name,
            eccentric,
            bound,
            "m",
            f"middle of the geometry of wheel '{wheel.name}' is {eccentric * 1e3:.4g} mm off the axis of '{joint.name}' "
            f"(allowed {bound * 1e3:.3g} mm: 2 % of the radius); correct the joint's point or axis",
        )
        flat = radial @ basis.T
        outermost = float(np.linalg.norm(flat - (shape.surface.centroid - np.array(joint.point)) @ basis.T, axis=1).max())
    stated = wheel.radius + (wheel.grouser.height if wheel.grouser else 0.0)
    bound = 0.05 * stated + shape.tolerance
    if abs(outermost - stated) > bound:
        yield _finding(
            "wheel.radius",
            "warning",
            wheel.name,
            stated,
            outermost,
            "m",
            f"radius of wheel '{wheel.name}' with grousers is {stated * 1e3:.4g} mm, but its geometry reaches {outermost * 1e3:.4g} mm "
            "from the axis "
            "(allowed difference 5 %); correct radius (not diameter) or the height of the grousers",
        )
    extent = float(np.ptp(along))
    if wheel.width > 1.05 * extent + shape.tolerance:
        yield _finding(
            "wheel.width",
            "warning",
            wheel.name,
            wheel.width,
            extent,
            "m",
            f"width of wheel '{wheel.name}' is {wheel.width * 1e3:.4g} mm, but its geometry is {extent * 1e3:.4g} mm long along the axis "
            "(allowed 5 % more); correct the width",
        )


def _steering(wheel: Wheel, joint: Joint, axis: Array, linkage: Linkage) -> Iterator[Finding]:
    """The nearest hinge below the wheel's own that is square to it and carries only this wheel."""
    wheels = {w.joint for w in linkage.rover.wheels}
    for carrier in linkage.chain(joint.child)[1:]:
        carried = {linkage.carrier[name].name for name in linkage.subtree(carrier.child)}
        if carrier.kind != "hinge" or len(carried & wheels) != 1:
            return
        if abs(_unit(np.array(carrier.axis)) @ axis) > 0.5:
            continue
        distance = _off_axis(np.array(wheel.center), carrier)
        bound = 0.01 * wheel.radius
        if distance > bound:
            yield _finding(
                "wheel.steering_offset",
                "note",
                wheel.name,
                distance,
                bound,
                "m",
                f"axis of '{carrier.name}' misses the centre of wheel '{wheel.name}' by {distance * 1e3:.4g} mm (1 % of the radius is "
                f"{bound * 1e3:.3g} mm), so the wheel rolls while it is steered; fine if the offset is meant, else correct the point",
            )
        return
