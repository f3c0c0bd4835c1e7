"""What a check says, and the table of all codes."""

from dataclasses import dataclass

from rille.model.severity import Severity


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that a check found.

    code : stable, a key of :data:`CODES`. severity : error (no such machine exists, or the solver would compute something else),
    warning (probably a mistake), note (worth knowing). subject : name of what it is about. value, bound : the numbers that were
    compared, in ``unit``. sentence : quantity, value, bound and the fix.
    """

    code: str
    severity: Severity
    subject: str
    value: float | None
    bound: float | None
    unit: str
    sentence: str


CODES: dict[str, str] = {
    # what refers to what
    "reference.unknown": "a joint, wheel, drive, differential, gear or loop names something that does not exist",
    "body.none": "the model has no body",
    "body.unconnected": "a body that no joint and no loop connects with the rest",
    "body.two_carriers": "a body that is the child of two joints; one of them must be a loop closure",
    "body.circle": "bodies that carry each other in a circle; one joint must be a loop closure",
    # mass
    "mass.not_positive": "mass of a body is not above 0 (of a part: below 0), or not finite",
    "inertia.not_finite": "an element of the inertia is not finite, or the tensor is not symmetric",
    "inertia.not_positive": "smallest principal moment of inertia is not above 0",
    "inertia.triangle": "largest principal moment exceeds the sum of the two others: no distribution of mass has such moments",
    "com.outside_hull": "centre of mass lies outside of the convex hull of the body's geometry",
    "size.inertia_magnitude": "radius of gyration is larger than the body, or below a tenth of that of its filled hull",
    "size.density": "mass over volume lies outside of 5 .. 25 000 kg/m^3 (aerogel and foams above 5; osmium, the densest, 22 590)",
    "budget.mass": "total mass differs from the budget by more than the tolerance",
    # sides
    "twins.missing": "a body named after one side has no twin on the other",
    "twins.geometry": "two bodies are named as twins, but their shapes are neither mirrored nor congruent",
    "twins.mass": "masses of mirrored twins differ by more than 0.5 %",
    "twins.com": "centre of mass is not the mirror image of the twin's, within 0.5 % of the size",
    "twins.inertia": "inertia is not the mirror image of the twin's, within 0.5 % of its largest moment",
    "twins.limit": "limits of the joints of twins do not mirror each other",
    "twins.drive": "drives of twins differ",
    "twins.wheel": "radius, width or grousers of twin wheels differ",
    "joint.axis_pair": "axes of the joints of twins are not mirror images, within 0.1 deg and 0.5 % of the size",
    # parts
    "geometry.missing": "a body has no mesh and no collision shape, so its size cannot be checked",
    "part.floating": "parts of a body touch no other part of it",
    # joints
    "joint.axis_unit": "axis of a hinge or slide is no unit vector",
    "joint.far": "axis or point of a joint passes a body by more than a tenth of the larger body's size",
    "limits.order": "lower limit is not below the upper one",
    "limits.zero_outside": "zero pose (that of the drawing) lies outside of the limits",
    "limits.units": "range of a hinge exceeds two turns: degrees written as radians?",
    "limits.unreachable": "bodies collide before a joint, moved alone, reaches its limit",
    "gear.ratio": "ratio of a gear is 0 or not finite, it couples a joint with itself, or its joint has no single position",
    "gear.limits": "limits of two geared joints do not fit the ratio, so that one limit is never reached",
    "differential.axes": "hinges of a differential are not parallel, or are not carried by its carrier",
    "differential.limits": "limits of the two sides of a differential do not mirror each other, so that one is never reached",
    "loop.open": "closing point of a loop is farther from a body than a tenth of the body's size: the loop is not closed in the drawing",
    "mobility.locked": "constraints leave the mechanism no freedom to move",
    "mobility.redundant": "constraints depend on each other (a planar loop closed by a point in space has one too many)",
    # wheels and drives
    "wheel.joint": "a wheel turns on something else than a hinge",
    "wheel.axis": "axis of a wheel is more than 30 deg off the level in the pose as built",
    "wheel.center": "centre of a wheel is not on its hinge's axis",
    "wheel.eccentric": "middle of the wheel's geometry is off the hinge's axis by more than 2 % of the radius",
    "wheel.unbalanced": "centre of mass of the wheel is off the hinge's axis by more than 2 % of the radius",
    "wheel.aside": "centre of mass of the wheel is farther along its axis from its centre than it is wide",
    "wheel.radius": "radius with grousers differs from the outermost point of the geometry by more than 5 %",
    "wheel.width": "width exceeds the geometry by more than 5 %",
    "wheel.steering_offset": "steering axis misses the wheel's centre by more than 1 % of the radius",
    "drive.weak": "largest effort of a drive is below what gravity (9.81 m/s^2, worst direction) asks of it for what it carries",
    # interference
    "interference.zero": "two bodies overlap at the zero pose by more than 1 % of the smaller one's volume",
    "interference.range": "two bodies run into each other within the ranges of the joints",
    "interference.skipped": "something could not be looked at, or only approximately, when interference was sought",
}
"""Every code and what it means."""
