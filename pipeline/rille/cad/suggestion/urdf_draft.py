"""A sheet for a URDF: what it lacks for driving, as far as its shapes tell."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rille.cad.collision.symmetry import rotational_symmetry_of_mesh
from rille.model import Joint, Rover
from rille.model.rotation import matrix_of
from rille.model.sheet import toml_string

PARALLEL = np.cos(np.radians(1.0))
"""A wheel's axis is its hinge's within 1 degree ..."""
OFF_AXIS = 0.02
"""... and passes it within this share of the wheel's radius."""
BESIDE = 1e-6
"""[m] from the hinge's point, along the axis, within which a wheel needs no centre of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelGuess:
    """A wheel on a hinge of a URDF. center, radius, width [m]; grousers: count, height, thickness [m], or None. evidence : in words."""

    joint: str
    center: tuple[float, float, float]
    radius: float
    width: float
    grousers: tuple[int, float, float] | None
    evidence: str


def guess_wheels(rover: Rover) -> list[WheelGuess]:
    """Hinges that turn freely and carry a round body about their axis: by its collision cylinder, else by its meshes; the largest."""
    guesses = []
    carries = {joint.parent for joint in rover.joints}
    for joint in rover.joints:
        if joint.kind == "hinge" and joint.limit is None and joint.child not in carries:
            found = list(_cylinders(rover, joint)) or list(_round_meshes(rover, joint))
            if found:
                largest = max(found, key=lambda wheel: (wheel.radius, wheel.width))
                among = f", the largest of {len(found)}" if len(found) > 1 else ""
                guesses.append(replace(largest, evidence=largest.evidence + among))
    return guesses


def draft_urdf_sheet(rover: Rover, wheels: list[WheelGuess], urdf: str) -> str:
    """Text of the sheet: wheels as suggested, a drive for each where the URDF has none; not accepted yet."""
    driven = {drive.joint for drive in rover.drives}
    lines = [
        f"# Drafted by `rille cad new` from {urdf}: bodies, joints and masses are those of the URDF; this sheet adds to it.",
        "accepted = false  # set to true when you have read the suggestions below; `rille cad build` refuses until then",
        f"urdf = {toml_string(urdf)}",
        f"# {len(rover.bodies)} bodies, {len(rover.joints)} joints: {', '.join(joint.name for joint in rover.joints) or 'none'}",
    ]
    points = {joint.name: joint.point for joint in rover.joints}
    for wheel in wheels:
        lines += ["", f"[[wheel]]  # SUGGESTED: {wheel.evidence}", f"joint = {toml_string(wheel.joint)}"]
        lines += [f'radius = "{1e3 * wheel.radius:.6g} mm"', f'width = "{1e3 * wheel.width:.6g} mm"']
        if math.dist(wheel.center, points[wheel.joint]) > BESIDE:
            center = ", ".join(f'"{1e3 * x:.6g} mm"' for x in wheel.center)
            lines.append(f"center = [{center}]  # the hinge's point lies beside the wheel")
        if wheel.grousers is not None:
            count, height, thickness = wheel.grousers
            lines.append(f'grousers = {{ count = {count}, height = "{1e3 * height:.4g} mm", thickness = "{1e3 * thickness:.4g} mm" }}')
        if wheel.joint not in driven:
            lines += ["", "# [[drive]]", f"# joint = {toml_string(wheel.joint)}", '# mode = "speed"', '# max_torque = "10 N m"']
    if not wheels:
        lines += ["", "# no hinge without limits carries a round body, so no wheel is suggested"]
    lines += [
        "",
        "# What else a URDF cannot say: [[differential]], [[loop]], [[sensor]]; the keys are in pipeline/rille/cad/README.md.",
        "",
    ]
    return "\n".join(lines)


def _stands_on_hinge(joint: Joint, direction: np.ndarray, center: np.ndarray, radius: float) -> bool:
    axis, arm = np.array(joint.axis), center - np.array(joint.point)
    return abs(direction @ axis) > PARALLEL and float(np.linalg.norm(np.cross(axis, arm))) < OFF_AXIS * radius


def _on_axis(joint: Joint, center: np.ndarray) -> tuple[float, float, float]:
    """The point of the hinge's axis beside a centre that is on it nearly."""
    axis, point = np.array(joint.axis), np.array(joint.point)
    x, y, z = map(float, point + axis * (axis @ (center - point)))
    return x, y, z


def _cylinders(rover: Rover, joint: Joint) -> Iterator[WheelGuess]:
    for shape in rover.collision_shapes:
        if shape.body == joint.child and shape.kind == "cylinder":
            radius, width = shape.size
            direction = matrix_of(shape.pose.rotation) @ np.array([0.0, 0.0, 1.0])
            place = np.array(shape.pose.position)
            if _stands_on_hinge(joint, direction, place, radius):
                evidence = f"collision cylinder of '{joint.child}' about the hinge"
                center = _on_axis(joint, place)
                yield WheelGuess(joint=joint.name, center=center, radius=radius, width=width, grousers=None, evidence=evidence)


def _round_meshes(rover: Rover, joint: Joint) -> Iterator[WheelGuess]:
    parts = {part.name: part for part in rover.parts}
    for instance in rover.instances:
        for mesh in parts[instance.part].meshes if instance.body == joint.child else ():
            placed = mesh.vertices.astype(float) @ matrix_of(instance.pose.rotation).T + np.array(instance.pose.position)
            found = rotational_symmetry_of_mesh(placed, mesh.triangles)
            if found is None or not found.round or not _stands_on_hinge(joint, found.axis, found.point, found.radius):
                continue
            lugs = (found.grouser_count, found.grouser_height, found.grouser_thickness) if found.grouser_count else None
            evidence = f"mesh '{instance.path}' is round about the hinge"
            yield WheelGuess(
                joint=joint.name,
                center=_on_axis(joint, found.point),
                radius=found.rim_radius,
                width=found.width,
                grousers=lugs,
                evidence=evidence,
            )
