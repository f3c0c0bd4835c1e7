"""Which instances there are, where they stand and which body each belongs to."""

import fnmatch
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rille.cad.component import Component, DrawnPart, MirroredPart, Placed, ReadyPart, mirrored_ready
from rille.cad.entries import is_named, known, symmetric_matrix, triple_of
from rille.cad.files.assembly import Assembly, PlacedPart
from rille.cad.masses import box_inertia, check_inertia, positive_mass
from rille.cad.mirror import other_side, reflected
from rille.cad.sheet import MassSheet, PlaceSheet, RoverSheet
from rille.model import InputRefused, MassProperties, Material, Part, nearest_names
from rille.model.quantity import to_si
from rille.model.rotation import UP, from_rpy
from rille.model.sheet import expand

FindPart = Callable[[Path | None, str], tuple[Part, Material | None]]
"""Part of a database (None: the part library) by name or digest."""


MEANINGLESS = ("SOLID", "COMPOUND", "SHELL", "PART", "PRODUCT")
"""Names that a part has where the CAD program knew none; the file's name says more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inventory:
    """All instances in M, and for each the name of its body (None: seen by nobody, on the ``ignore`` list)."""

    instances: tuple[Placed, ...]
    owner: tuple[str | None, ...]

    def of_body(self, body: str) -> list[Placed]:
        """The instances of one body."""
        return [p for p, name in zip(self.instances, self.owner, strict=True) if name == body]


class _Collector:
    """Gathers instances in the drawing's frame, with one component per prototype and unique names."""

    def __init__(self) -> None:
        self.placed: list[Placed] = []
        self.paths: set[str] = set()
        self.names: dict[str, int] = {}
        self.bodies: dict[str, str] = {}
        """Body of the paths whose own table says it."""
        self.components: dict[tuple[Path, int, int | None], Component] = {}
        """By file, prototype and mirror: a file that is placed twice brings its parts once."""

    def name(self, wanted: str) -> str:
        self.names[wanted] = self.names.get(wanted, 0) + 1
        return wanted if self.names[wanted] == 1 else f"{wanted}#{self.names[wanted]}"

    def add(self, placed: Placed, subject: str) -> None:
        if placed.path in self.paths:
            raise InputRefused(f"{subject} puts an instance at '{placed.path}', where there is one already; give it another name")
        self.paths.add(placed.path)
        self.placed.append(placed)

    def add_assembly(
        self, assembly: Assembly, below: str | None = None, matrix: np.ndarray | None = None, mirror: int | None = None
    ) -> None:
        frame = np.eye(4) if matrix is None else matrix
        single = len(assembly.instances) == 1
        for i in assembly.instances:
            path = i.path if below is None else below if single else f"{below}/{i.path}"
            inside = i.matrix if mirror is None else reflected_pose(i.matrix, mirror, 0.0)
            component = self.component(assembly, i, mirror)
            self.add(Placed(path=path, component=component, matrix=frame @ inside, color=i.color), f"'{assembly.file}'")

    def component(self, assembly: Assembly, instance: PlacedPart, mirror: int | None) -> Component:
        key = (assembly.file, instance.prototype, mirror)
        if key in self.components:
            return self.components[key]
        if mirror is not None:
            original = self.component(assembly, instance, None)
            made = mirror_image(original, mirror, self.name(f"{original.name}:mirror"))
        else:
            p = assembly.prototypes[instance.prototype]
            only_solid = p.n_solids > 0 and sum(other.n_solids > 0 for other in assembly.prototypes) == 1
            name = assembly.file.stem if only_solid and p.name.upper() in MEANINGLESS else p.name
            made = DrawnPart(prototype=p, name=self.name(name), color=p.color or instance.color)
        self.components[key] = made
        return made


def gather(
    page: RoverSheet,
    twins: dict[str, dict[str, str]],
    folder: Path,
    read: Mapping[Path, Assembly],
    find_part: FindPart | None,
) -> Inventory:
    """All instances of a sheet, each with its body. ``read`` : the files that it names, as read.

    Raises
    ------
    InputRefused : for patterns that match nothing, instances of two bodies or of none, and parts that cannot be found.
    """
    collector = _Collector()
    if page.step is not None:
        collector.add_assembly(read[expand(page.step, folder)])
    k = "xyz".index(page.mirror.normal) if page.mirror else 0
    for place in page.place:
        _place(collector, place, k if place.name in twins["place"] else None, folder, read, find_part)
    _move(collector, page)
    _mirror_instances(collector, page, twins["body"])
    for mass in page.mass:
        _lump(collector, mass)
    owner = _owners(collector, page)
    up = np.eye(4)
    up[:3, :3] = UP[page.up]
    return Inventory(instances=tuple(replace(p, matrix=up @ p.matrix) for p in collector.placed), owner=tuple(owner))


def matches(path: str, pattern: str) -> bool:
    """A pattern names an instance, or a sub-assembly with everything in it; names with brackets match themselves, too."""
    if path.startswith(pattern + "/"):
        return True
    return is_named(path, pattern) or fnmatch.fnmatchcase(path, pattern + "/*")


def select(placed: list[Placed], pattern: str, subject: str) -> list[int]:
    """Indices of the instances that a pattern names; at least one."""
    found = [i for i, p in enumerate(placed) if matches(p.path, pattern)]
    if not found:
        raise InputRefused(
            f"{subject} names the part '{pattern}', which the assembly does not have; {nearest_names(pattern, [p.path for p in placed])}"
        )
    return found


def mirror_image(part: Component, axis: int, name: str) -> Component:
    """The part mirrored in the plane through its own origin."""
    ready = None if part.ready is None else mirrored_ready(part.ready, axis, name)
    return MirroredPart(original=part, axis=axis, name=name, ready=ready)


def reflected_pose(matrix: np.ndarray, k: int, offset: float) -> np.ndarray:
    """Pose of the mirror image of a placed part: S R S, and the reflected origin."""
    s = np.ones(3)
    s[k] = -1
    image = matrix.copy()
    image[:3, :3] = matrix[:3, :3] * np.outer(s, s)
    image[:3, 3] = reflected(matrix[:3, 3], k, offset)
    return image


def _place(
    collector: _Collector, place: PlaceSheet, mirror: int | None, folder: Path, read: Mapping[Path, Assembly], find_part: FindPart | None
) -> None:
    subject = f"[[place]] '{place.name}'"
    before = len(collector.placed)
    _put(collector, place, subject, mirror, folder, read, find_part)
    if place.body is not None:
        collector.bodies.update({p.path: place.body for p in collector.placed[before:]})


def _put(
    collector: _Collector,
    place: PlaceSheet,
    subject: str,
    mirror: int | None,
    folder: Path,
    read: Mapping[Path, Assembly],
    find_part: FindPart | None,
) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = from_rpy(*triple_of(place.rpy, "angle", f"rpy of {subject}"))
    matrix[:3, 3] = triple_of(place.position, "length", f"position of {subject}")
    if (place.file is None) == (place.part is None):
        raise InputRefused(f"{subject} needs one of `file` and `part`; give a STEP file, or the name of a part")
    if place.file is not None:
        collector.add_assembly(read[expand(place.file, folder)], place.name, matrix, mirror)
        return
    if find_part is None:
        raise InputRefused(f"{subject} takes a part from a database, but none can be read here; build with `rille cad build`")
    part, material = find_part(None if place.database is None else expand(place.database, folder), place.part or "")
    component: Component = ReadyPart(ready=part, material=material, name=collector.name(part.name))
    if mirror is not None:
        component = mirror_image(component, mirror, collector.name(f"{part.name}:mirror"))
    collector.add(Placed(path=place.name, component=component, matrix=matrix), subject)


def _lump(collector: _Collector, mass: MassSheet) -> None:
    placed = _lumped(mass, collector.name(mass.name))
    collector.add(placed, f"mass '{mass.name}'")
    collector.bodies[placed.path] = mass.body


def _move(collector: _Collector, page: RoverSheet) -> None:
    for move in page.move:
        by = triple_of(move.by, "length", "by of a [[move]]")
        for index in {one for pattern in move.parts for one in select(collector.placed, pattern, "a [[move]]")}:
            matrix = collector.placed[index].matrix.copy()
            matrix[:3, 3] += by
            collector.placed[index] = replace(collector.placed[index], matrix=matrix)


def _mirror_instances(collector: _Collector, page: RoverSheet, twins: dict[str, str]) -> None:
    """Where the drawing holds one side only, the other side's instances are mirror images of it."""
    if page.mirror is None:
        return
    k = "xyz".index(page.mirror.normal)
    offset = to_si(page.mirror.offset, "length", "offset of [mirror]")
    bodies = {body.name: body for body in page.body}
    images: dict[str, Component] = {}
    for twin, original in twins.items():
        pairs = zip(bodies[twin].parts, bodies[original].parts, strict=True)
        for pattern, source in pairs:
            if any(matches(p.path, pattern) for p in collector.placed):
                continue
            for index in select(collector.placed, source, f"body '{original}'"):
                p = collector.placed[index]
                name = p.component.name
                if name not in images:
                    images[name] = mirror_image(p.component, k, collector.name(f"{name}:mirror"))
                path = other_side(p.path, page.mirror)
                placed = Placed(path=path, component=images[name], matrix=reflected_pose(p.matrix, k, offset), color=p.color)
                collector.add(placed, f"the mirror image of body '{original}'")


def _owners(collector: _Collector, page: RoverSheet) -> list[str | None]:
    """Body of every instance; each belongs to one body or is ignored by name."""
    placed = collector.placed
    bodies = [body.name for body in page.body]
    owner = {i: known(collector.bodies[p.path], bodies, "body", f"'{p.path}'") for i, p in enumerate(placed) if p.path in collector.bodies}
    ignored: set[int] = set()
    for pattern in page.ignore:
        ignored.update(select(placed, pattern, "the `ignore` list"))
    for body in page.body:
        for pattern in body.parts:
            for index in select(placed, pattern, f"body '{body.name}'"):
                if index in ignored:
                    continue
                if owner.get(index, body.name) != body.name:
                    raise InputRefused(
                        f"instance '{placed[index].path}' belongs to bodies '{owner[index]}' and '{body.name}'; narrow a pattern"
                    )
                owner[index] = body.name
    free = [p.path for i, p in enumerate(placed) if i not in owner and i not in ignored]
    if free:
        more = f" and {len(free) - 1} more" if len(free) > 1 else ""
        raise InputRefused(f"instance '{free[0]}'{more} belongs to no body; add it to a [[body]] or to `ignore`")
    return [None if i in ignored else owner[i] for i in range(len(placed))]


def _lumped(sheet: MassSheet, name: str) -> Placed:
    """A mass without geometry: a point, a homogeneous box of a stated size, or with a stated inertia."""
    subject = f"mass '{sheet.name}'"
    mass = positive_mass(sheet.mass, f"mass of {subject}")
    inertia = np.zeros((3, 3))
    if sheet.inertia is not None and sheet.size is not None:
        raise InputRefused(f"{subject} has a size and an inertia; give one of them: that of a box follows from its size")
    if sheet.inertia is not None:
        inertia = symmetric_matrix(sheet.inertia, f"inertia of {subject}")
        check_inertia(inertia, subject)
    elif sheet.size is not None:
        size = triple_of(sheet.size, "length", f"size of {subject}")
        if size.min() <= 0:
            raise InputRefused(f"size of {subject} is {' x '.join(f'{1e3 * s:g}' for s in size)} mm; each length must be above 0")
        inertia = box_inertia(mass, size)
    properties = MassProperties(mass=mass, com=np.zeros(3), inertia=inertia, mass_provenance="stated", inertia_provenance="stated")
    matrix = np.eye(4)
    matrix[:3, 3] = triple_of(sheet.at, "length", f"at of {subject}")
    return Placed(
        path=f"mass/{sheet.name}", component=ReadyPart(ready=Part(name=name, volume=0.0, properties=properties), name=name), matrix=matrix
    )
