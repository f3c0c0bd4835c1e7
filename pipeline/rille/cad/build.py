"""Sheet + STEP -> Rover."""

import fnmatch
import math
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille import __version__
from rille.cad.geometry import VolumeProperties, brep_hash, tessellate, volume_properties
from rille.cad.masses import body_properties, density_of, part_properties, positive_mass
from rille.cad.shapes import body_shape, wheel_shape
from rille.cad.sheet import RoverSheet
from rille.cad.step_reader import Assembly, PlacedPart, read_step
from rille.model import (
    Body,
    Differential,
    Drive,
    Gear,
    Grouser,
    InputRefused,
    Joint,
    JointLimit,
    Material,
    Part,
    PartInstance,
    Pose,
    Rover,
    Sensor,
    nearest_names,
)
from rille.model.quantity import to_si
from rille.model.rover import Vector, Wheel
from rille.model.sheet import expand, read_sheet, source_of

Matrix = NDArray[np.float64]

# Rotations that bring the drawing's up axis to z.
_UP: dict[str, Matrix] = {
    "z": np.eye(3),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]),
    "-y": np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]),
    "x": np.array([[0, 0, -1.0], [0, 1.0, 0], [1.0, 0, 0]]),
    "-x": np.array([[0, 0, 1.0], [0, 1.0, 0], [-1.0, 0, 0]]),
}


def build(
    sheet: Path,
    *,
    progress: Callable[[str, float], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> Rover:
    """Build a mechanism from a sheet and the STEP file that it names.

    Parameters
    ----------
    sheet : path of the TOML sheet (see :mod:`rille.cad.sheet`).
    progress : called with what is being done and the fraction done.
    note : called with a sentence about whatever of the file was left out.

    Returns
    -------
    The rover, with exact mass properties, visual meshes, joints, drives and wheels.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    say = progress or (lambda what, fraction: None)
    tell = note or (lambda sentence: None)
    sheet = Path(sheet)
    page = read_sheet(sheet, RoverSheet)
    step_file = expand(page.step, sheet.parent)
    say("reading STEP", 0.0)
    assembly = _moved(read_step(step_file), page)
    for sentence in assembly.notes:
        tell(sentence)
    say("assigning parts to bodies", 0.3)
    owner = _assign(assembly, page)
    used = sorted({assembly.instances[i].prototype for i in owner})
    _check_part_rules([assembly.prototypes[index].name for index in used], page)
    volumes: dict[int, VolumeProperties] = {}
    parts: dict[int, Part] = {}
    tolerance = _positive(page.tolerance, "length", "tolerance of the sheet")
    for count, index in enumerate(used):
        say(f"weighing and meshing {assembly.prototypes[index].name}", 0.3 + 0.6 * count / len(used))
        volumes[index] = volume_properties(assembly.prototypes[index].shape)
        parts[index] = _part(assembly, index, volumes[index], page, tolerance)
    say("joining", 0.95)
    rover = _Mechanism(page, assembly, owner, parts).rover()
    sources = (source_of(sheet, "rover", f"rille {__version__}"), source_of(step_file, "rover", f"rille {__version__}"))
    say("done", 1.0)
    return Rover(**{name: getattr(rover, name) for name in Rover.__dataclass_fields__ if name != "sources"}, sources=sources)


def _matches(path: str, pattern: str) -> bool:
    """A pattern names an instance, or a sub-assembly with everything in it; names with brackets match themselves, too."""
    if path == pattern or path.startswith(pattern + "/"):
        return True
    return fnmatch.fnmatchcase(path, pattern) or fnmatch.fnmatchcase(path, pattern + "/*")


def _select(assembly: Assembly, pattern: str, subject: str) -> list[int]:
    found = [i for i, instance in enumerate(assembly.instances) if _matches(instance.path, pattern)]
    if not found:
        paths = [instance.path for instance in assembly.instances]
        raise InputRefused(f"{subject} names the part '{pattern}', which the assembly does not have; {nearest_names(pattern, paths)}")
    return found


def _moved(assembly: Assembly, page: RoverSheet) -> Assembly:
    """Apply the sheet's moves and turn the drawing's up axis to z."""
    shifts = [np.zeros(3) for _ in assembly.instances]
    for move in page.move:
        by = np.array([to_si(v, "length", "by of a [[move]]") for v in move.by])
        for pattern in move.parts:
            for index in _select(assembly, pattern, "a [[move]]"):
                shifts[index] = shifts[index] + by
    up = np.eye(4)
    up[:3, :3] = _UP[page.up]
    instances = []
    for instance, shift in zip(assembly.instances, shifts, strict=True):
        matrix = instance.matrix.copy()
        matrix[:3, 3] += shift
        instances.append(PlacedPart(path=instance.path, prototype=instance.prototype, matrix=up @ matrix, color=instance.color))
    return Assembly(file=assembly.file, prototypes=assembly.prototypes, instances=tuple(instances), notes=assembly.notes)


def _assign(assembly: Assembly, page: RoverSheet) -> dict[int, str]:
    """Body of every instance; each belongs to one body or is ignored by name."""
    owner: dict[int, str] = {}
    ignored: set[int] = set()
    for pattern in page.ignore:
        ignored.update(_select(assembly, pattern, "the `ignore` list"))
    for body in page.body:
        for pattern in body.parts:
            for index in _select(assembly, pattern, f"body '{body.name}'"):
                path = assembly.instances[index].path
                if index in ignored:
                    continue
                if owner.get(index, body.name) != body.name:
                    raise InputRefused(f"instance '{path}' belongs to bodies '{owner[index]}' and '{body.name}'; narrow a pattern")
                owner[index] = body.name
    free = [instance.path for i, instance in enumerate(assembly.instances) if i not in owner and i not in ignored]
    if free:
        more = f" and {len(free) - 1} more" if len(free) > 1 else ""
        raise InputRefused(f"instance '{free[0]}'{more} belongs to no body; add it to a [[body]] or to `ignore`")
    return owner


def _check_part_rules(names: list[str], page: RoverSheet) -> None:
    """Every [[part]] must match a prototype in use: a rule that does nothing is a misspelt one."""
    for rule in page.part:
        if not any(fnmatch.fnmatchcase(name, rule.match) for name in names):
            raise InputRefused(f"a [[part]] names the part '{rule.match}', which no body uses; {nearest_names(rule.match, names)}")


def _positive(value: float | int | str, kind: str, what: str) -> float:
    number = to_si(value, kind, what)
    if number <= 0:
        raise InputRefused(f"{what} is {number:g}; it must be above 0")
    return number


def _optional(value: float | int | str | None, kind: str, what: str) -> float | None:
    return None if value is None else _positive(value, kind, what)


def _part(assembly: Assembly, index: int, volume: VolumeProperties, page: RoverSheet, tolerance: float) -> Part:
    prototype = assembly.prototypes[index]
    if volume.n_solids == 0:
        where = next(instance.path for instance in assembly.instances if instance.prototype == index)
        raise InputRefused(
            f"part '{prototype.name}' has no solid, so it has no mass; list its instances under `ignore`, for example '{where}'"
        )
    properties, material = part_properties(prototype.name, volume, page, prototype.material)
    digest = brep_hash(prototype.shape)
    mesh = tessellate(prototype.shape, tolerance)
    color = prototype.color or next((i.color for i in assembly.instances if i.prototype == index and i.color), None)
    return Part(
        name=prototype.name,
        volume=volume.volume,
        properties=properties,
        material=material,
        brep_hash=digest,
        color=color or "#9aa0a6",
        meshes=() if mesh is None else (mesh,),
    )


def quaternion(rotation: Matrix) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z), w >= 0, of a rotation matrix (3, 3) (Shepperd 1978)."""
    trace = float(np.trace(rotation))
    candidates = [trace, *(float(rotation[i, i]) for i in range(3))]
    k = int(np.argmax(candidates))
    q = np.empty(4)
    q[k] = math.sqrt(max(1.0 + 2.0 * candidates[k] - trace, 0.0)) / 2
    skew = (rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1])
    if k == 0:
        q[1:] = np.array(skew) / (4 * q[0])
    else:
        i = k - 1
        q[0] = skew[i] / (4 * q[k])
        for j in range(3):
            if j != i:
                q[1 + j] = (rotation[i, j] + rotation[j, i]) / (4 * q[k])
    q /= np.linalg.norm(q)
    if q[0] < 0:
        q = -q
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])


class _Mechanism:
    """Bodies, joints, drives and wheels of one sheet."""

    def __init__(self, page: RoverSheet, assembly: Assembly, owner: dict[int, str], parts: dict[int, Part]) -> None:
        self.page = page
        self.assembly = assembly
        self.owner = owner
        self.parts = parts
        self.up = _UP[page.up]
        self.bodies = [body.name for body in page.body]
        self.joints: dict[str, Joint] = {}

    def rover(self) -> Rover:
        self._unique(self.bodies, "body")
        self._unique([m.name for m in self.page.material], "material")
        self._read_joints()
        wheels = self._wheels()
        bodies = tuple(self._body(body.name) for body in self.page.body)
        wheel_of_body = {self.joints[w.joint].child: w for w in wheels}
        shapes = tuple(
            wheel_shape(wheel_of_body[name], self.joints[wheel_of_body[name].joint], name)
            if name in wheel_of_body
            else body_shape(name, self._placed_meshes(name))
            for name in self.bodies
        )
        return Rover(
            materials=self._materials(),
            parts=tuple(self.parts.values()),
            instances=tuple(
                PartInstance(
                    path=instance.path,
                    part=self.parts[instance.prototype].name,
                    body=self.owner[i],
                    pose=Pose(position=_vector(instance.matrix[:3, 3]), rotation=quaternion(instance.matrix[:3, :3])),
                )
                for i, instance in enumerate(self.assembly.instances)
                if i in self.owner
            ),
            bodies=bodies,
            collision_shapes=shapes,
            joints=tuple(self.joints.values()),
            drives=self._drives(),
            differentials=self._differentials(),
            gears=self._gears(),
            wheels=wheels,
            sensors=self._sensors(),
        )

    def _materials(self) -> tuple[Material, ...]:
        """Materials of the sheet, and those of the CAD file that weigh a part."""
        stated = [Material(name=m.name, density=density_of(m.name, "the sheet", self.page), source=m.source) for m in self.page.material]
        found = {p.material.name: p.material for i in self.parts if (p := self.assembly.prototypes[i]).material is not None}
        used = {part.material for part in self.parts.values()} - {m.name for m in stated}
        return (*stated, *(found[name] for name in sorted(set(found) & used)))

    def _unique(self, names: list[str], what: str) -> None:
        for name in names:
            if names.count(name) > 1:
                raise InputRefused(f"the sheet has {names.count(name)} {what}s called '{name}'; give each its own name")

    def _known(self, name: str, known: Iterable[str], what: str, subject: str) -> str:
        names = list(known)
        if name not in names:
            raise InputRefused(f"{subject} names the {what} '{name}', which is not on the sheet; {nearest_names(name, names)}")
        return name

    def _point(self, values: list[float | int | str], what: str) -> Vector:
        return _vector(self.up @ np.array([to_si(v, "length", what) for v in values]))

    def _placed_meshes(self, body: str) -> NDArray[np.float64]:
        """All vertices of a body in M, shape (n, 3)."""
        clouds = [np.zeros((0, 3))]
        for i, name in self.owner.items():
            if name != body:
                continue
            matrix = self.assembly.instances[i].matrix
            for mesh in self.parts[self.assembly.instances[i].prototype].meshes:
                clouds.append(mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])
        return np.concatenate(clouds)

    def _body(self, name: str) -> Body:
        members = [
            (self.parts[self.assembly.instances[i].prototype].properties, self.assembly.instances[i].matrix)
            for i, body in self.owner.items()
            if body == name
        ]
        if not members:
            raise InputRefused(f"body '{name}' has no parts left: all its instances are on the `ignore` list")
        sheet = next(b for b in self.page.body if b.name == name)
        stated = None if sheet.mass is None else positive_mass(sheet.mass, f"mass of body '{name}'")
        carrier = next((j for j in self.joints.values() if j.child == name), None)
        frame = carrier.point if carrier is not None else (0.0, 0.0, 0.0)
        return Body(name=name, properties=body_properties(members, stated), frame=frame)

    def _read_joints(self) -> None:
        self._unique([joint.name for joint in self.page.joint], "joint")
        for joint in self.page.joint:
            subject = f"joint '{joint.name}'"
            axis = np.array([to_si(v, "dimensionless", f"axis of {subject}") for v in joint.axis])
            if np.linalg.norm(axis) < 1e-9:
                raise InputRefused(f"axis of {subject} has no length; give a direction, for example [0, 1, 0]")
            parent = None if joint.parent is None else self._known(joint.parent, self.bodies, "body", subject)
            child = self._known(joint.child, self.bodies, "body", subject)
            other = next((j for j in self.joints.values() if j.child == child), None)
            if other is not None:
                raise InputRefused(f"body '{child}' is the child of joint '{other.name}' and of {subject}; a body has one carrier")
            self.joints[joint.name] = Joint(
                name=joint.name,
                kind=joint.kind,
                parent=parent,
                child=child,
                point=self._point(joint.point, f"point of {subject}"),
                axis=_vector(self.up @ (axis / np.linalg.norm(axis))),
                limit=_limit(joint.kind, joint.lower, joint.upper, subject),
            )
        self._check_tree()

    def _check_tree(self) -> None:
        carrier = {j.child: j.parent for j in self.joints.values()}
        for body in self.bodies:
            seen, at = [body], carrier.get(body)
            while at is not None:
                if at in seen:
                    raise InputRefused(f"body '{body}' is carried by a circle of joints ({' <- '.join([*seen, at])}); cut one")
                seen.append(at)
                at = carrier.get(at)
        roots = [body for body in self.bodies if body not in carrier]
        held = [j.child for j in self.joints.values() if j.parent is None]
        if len(roots) > 1 or (roots and held):
            raise InputRefused(f"bodies {', '.join(repr(b) for b in [*roots, *held])} are not joined to each other; add a [[joint]]")

    def _differentials(self) -> tuple[Differential, ...]:
        for d in self.page.differential:
            subject = f"differential '{d.name}'"
            carrier = self._known(d.carrier, self.bodies, "body", subject)
            a, b = (self.joints[self._known(name, self.joints, "joint", subject)] for name in (d.joint_a, d.joint_b))
            if a is b:
                raise InputRefused(f"{subject} names the joint '{a.name}' twice; name the hinges of its two inputs")
            for joint in (a, b):
                if joint.kind != "hinge" or joint.parent != carrier:
                    raise InputRefused(
                        f"{subject} needs hinges on its carrier '{carrier}'; joint '{joint.name}' is {joint.kind} on '{joint.parent}'"
                    )
            if abs(abs(float(np.dot(a.axis, b.axis))) - 1) > 1e-6:
                raise InputRefused(f"{subject} needs parallel hinges; the axes of '{a.name}' and '{b.name}' are not")
        self._unique([d.name for d in self.page.differential], "differential")
        return tuple(Differential(name=d.name, carrier=d.carrier, joint_a=d.joint_a, joint_b=d.joint_b) for d in self.page.differential)

    def _gears(self) -> tuple[Gear, ...]:
        gears = []
        for g in self.page.gear:
            subject = f"gear '{g.name}'"
            a, b = (self._known(name, self.joints, "joint", subject) for name in (g.joint_a, g.joint_b))
            ratio = to_si(g.ratio, "dimensionless", f"ratio of {subject}")
            if a == b or ratio == 0:
                raise InputRefused(f"{subject} has ratio {ratio:g} between '{a}' and '{b}'; give two joints and a ratio other than 0")
            gears.append(Gear(name=g.name, joint_a=a, joint_b=b, ratio=ratio))
        self._unique([gear.name for gear in gears], "gear")
        return tuple(gears)

    def _drives(self) -> tuple[Drive, ...]:
        drives = []
        for drive in self.page.drive:
            name = drive.name or drive.joint
            subject = f"drive '{name}'"
            joint = self.joints[self._known(drive.joint, self.joints, "joint", subject)]
            if joint.kind not in ("hinge", "prismatic"):
                raise InputRefused(f"{subject} acts on joint '{joint.name}', which is {joint.kind}; use a hinge or prismatic joint")
            effort, speed = ("N", "m/s") if joint.kind == "prismatic" else ("N m", "rad/s")
            drives.append(
                Drive(
                    name=name,
                    joint=joint.name,
                    mode=drive.mode,
                    max_torque=_positive(drive.max_torque, effort, f"max_torque of {subject}"),
                    max_speed=None if drive.max_speed is None else _positive(drive.max_speed, speed, f"max_speed of {subject}"),
                    position_gain=_positive(drive.position_gain, "1/s", f"position_gain of {subject}"),
                    speed_gain=_optional(drive.speed_gain, f"{effort} s/rad" if effort == "N m" else "N s/m", f"speed_gain of {subject}"),
                    integral_gain=to_si(drive.integral_gain, f"{effort}/rad" if effort == "N m" else "N/m", f"integral_gain of {subject}"),
                    torque_constant=_optional(drive.torque_constant, f"{effort}/A", f"torque_constant of {subject}"),
                    resistance=_optional(drive.resistance, "ohm", f"resistance of {subject}"),
                )
            )
        self._unique([drive.name for drive in drives], "drive")
        return tuple(drives)

    def _sensors(self) -> tuple[Sensor, ...]:
        self._unique([sensor.name for sensor in self.page.sensor], "sensor")
        return tuple(
            Sensor(
                name=s.name, quantity=s.quantity, target=s.target, rate=_positive(s.rate, "Hz", f"rate of sensor '{s.name}'"), frame=s.frame
            )
            for s in self.page.sensor
        )

    def _wheels(self) -> tuple[Wheel, ...]:
        wheels = []
        for wheel in self.page.wheel:
            name = wheel.name or wheel.joint
            subject = f"wheel '{name}'"
            joint = self.joints[self._known(wheel.joint, self.joints, "joint", subject)]
            if joint.kind != "hinge":
                raise InputRefused(f"{subject} turns on joint '{joint.name}', which is {joint.kind}; a wheel needs a hinge")
            size = {key: _positive(getattr(wheel, key), "length", f"{key} of {subject}") for key in ("radius", "width")}
            grouser = None
            if wheel.grousers is not None:
                grouser = Grouser(
                    count=wheel.grousers.count,
                    height=_positive(wheel.grousers.height, "length", f"grouser height of {subject}"),
                    thickness=_positive(wheel.grousers.thickness, "length", f"grouser thickness of {subject}"),
                )
            materials = [m.name for m in self.page.material]
            wheels.append(
                Wheel(
                    name=name,
                    joint=joint.name,
                    center=joint.point if wheel.center is None else self._point(wheel.center, f"center of {subject}"),
                    material=None if wheel.material is None else self._known(wheel.material, materials, "material", subject),
                    grouser=grouser,
                    **size,
                )
            )
        self._unique([wheel.name for wheel in wheels], "wheel")
        return tuple(wheels)


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = map(float, values)
    return x, y, z


def _limit(kind: str, lower: object, upper: object, subject: str) -> JointLimit | None:
    if lower is None and upper is None:
        return None
    if lower is None or upper is None:
        raise InputRefused(f"{subject} has only one of `lower` and `upper`; give both")
    if kind not in ("hinge", "prismatic"):
        raise InputRefused(f"{subject} is {kind} and has limits; only hinges and prismatic joints can")
    quantity = "angle" if kind == "hinge" else "length"
    low, high = (to_si(v, quantity, f"limit of {subject}") for v in (lower, upper))
    if low >= high:
        raise InputRefused(f"{subject} has the lower limit {low:g} and the upper limit {high:g}; lower must be below upper")
    return JointLimit(lower=low, upper=high)
