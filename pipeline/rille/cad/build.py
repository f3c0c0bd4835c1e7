"""Sheet + STEP, script or URDF -> Rover."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from rille import __version__
from rille.cad.assign import FindPart, Inventory, gather
from rille.cad.collision.shapes import body_shapes, wheel_shape
from rille.cad.component import Component, DrawnPart
from rille.cad.entries import is_named, positive, unique
from rille.cad.exchange.urdf_file import is_urdf
from rille.cad.files.assembly import Assembly, require_solids
from rille.cad.files.reading import load_assemblies, meshes_of
from rille.cad.frames import Frames
from rille.cad.masses import body_properties, part_properties
from rille.cad.materials import Materials
from rille.cad.mechanism import (
    make_differentials,
    make_drives,
    make_frictions,
    make_gears,
    make_joints,
    make_loops,
    make_sensors,
    make_wheels,
)
from rille.cad.mirror import mirrored
from rille.cad.sheet import BudgetSheet, RoverSheet
from rille.model import Body, CollisionShape, InputRefused, Joint, Material, Part, PartInstance, Rover, SourceFile, nearest_names
from rille.model.rotation import UP, pose_of
from rille.model.rover import Wheel
from rille.model.sheet import expand, read_sheet, source_of, validate_sheet

Say = Callable[[str, float], None]
Note = Callable[[str], None]

GEOMETRY = (
    "step",
    "ignore",
    "mirror",
    "part",
    "place",
    "mass",
    "frame",
    "move",
    "body",
    "joint",
    "up",
    "tolerance",
    "collision",
    "default_material",
)
"""Keys that a sheet about a URDF cannot have: its bodies, joints, shapes, masses and axes are those of the URDF."""


def build(
    source: Path,
    *,
    progress: Say | None = None,
    note: Note | None = None,
    find_part: FindPart | None = None,
) -> Rover:
    """Build a mechanism from a sheet and the files that it names, from a CadQuery script with joints, or from a URDF.

    Parameters
    ----------
    source : path of the TOML sheet (see :mod:`rille.cad.sheet`), of a script (``.py``, see :class:`rille.cad.Mechanism`) or of a URDF.
    progress : called with what is being done and the fraction done.
    note : called with a sentence about whatever of the files was left out.
    find_part : finds a part of another database or of the part library by name or digest, for ``[[place]]``.

    Returns
    -------
    The rover, with exact mass properties, visual meshes, collision shapes, joints, drives and wheels.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    say = progress or (lambda what, fraction: None)
    tell = note or (lambda sentence: None)
    source = Path(source)
    if is_urdf(source):
        return _from_urdf(RoverSheet(urdf=source.name), source.parent, (source,), say, tell)
    if source.suffix.lower() == ".py":
        return _from_script(source, say, tell, find_part)
    if source.suffix.lower() in (".step", ".stp") and source.is_file():
        raise InputRefused(f"'{source}' is a STEP file, which does not say what moves; draft a sheet with `rille cad new {source}`")
    page = read_sheet(source, RoverSheet)
    if not page.accepted:
        raise InputRefused(f"'{source}' holds suggestions that nobody has accepted; read it, correct it, and set `accepted = true`")
    if page.urdf is not None:
        return _from_urdf(page, source.parent, (source, expand(page.urdf, source.parent)), say, tell)
    return _assemble(page, source.parent, (source,), say, tell, find_part, {})


def _from_script(source: Path, say: Say, tell: Note, find_part: FindPart | None) -> Rover:
    """A script whose ``build()`` returns an assembly with joints."""
    assembly = _read_all([source], say, tell)[source]
    if not assembly.tables:
        raise InputRefused(
            f"'{source}' returns an assembly without bodies and joints; return a rille.cad.Mechanism, or name it as `step` of a sheet"
        )
    page = validate_sheet(assembly.tables | {"step": source.name}, RoverSheet, str(source))
    return _assemble(page, source.parent, (), say, tell, find_part, {source.parent / source.name: assembly})


def _from_urdf(page: RoverSheet, folder: Path, sources: tuple[Path, ...], say: Say, tell: Note) -> Rover:
    """A URDF, with what the sheet adds to it."""
    from rille.cad.exchange.urdf_in import read_urdf

    nothing = RoverSheet()
    stray = next((name for name in GEOMETRY if getattr(page, name) != getattr(nothing, name)), None)
    if stray is not None:
        raise InputRefused(
            f"the sheet has both `urdf` and `{stray}`; leave `{stray}` out: bodies, joints, shapes, masses and axes are those of the URDF"
        )
    say("reading URDF", 0.0)
    rover = read_urdf(expand(page.urdf or "", folder), note=tell)
    if page.budget is not None:
        _hold_budget(rover.bodies, page.budget, tell)
    say("joining", 0.9)
    bodies = [body.name for body in rover.bodies]
    joints = {joint.name: joint for joint in rover.joints}
    materials = Materials(page.material, folder)
    frames = Frames(page, Inventory(instances=(), owner=()))
    drives, lines = make_drives(page, joints)
    mine = {drive.joint for drive in drives}
    drives = (*(drive for drive in rover.drives if drive.joint not in mine), *drives)
    unique([drive.name for drive in drives], "drive")
    wheels = make_wheels(page, joints, frames, materials)
    wheeled = {joints[w.joint].child for w in wheels}
    return replace(
        rover,
        materials=(*rover.materials, *_new(_stated(page, materials), rover.materials)),
        collision_shapes=(*(s for s in rover.collision_shapes if s.body not in wheeled), *_rims(wheels, joints)),
        drives=drives,
        differentials=make_differentials(page, bodies, joints),
        gears=(*rover.gears, *make_gears(page, joints)),
        loop_closures=make_loops(page, bodies, frames),
        wheels=wheels,
        sensors=make_sensors(page),
        effects=(*rover.effects, *lines),
        sources=_sources(sources),
    )


def _assemble(
    page: RoverSheet, folder: Path, sources: tuple[Path, ...], say: Say, tell: Note, find_part: FindPart | None, read: dict[Path, Assembly]
) -> Rover:
    """Parts of any origin, with the bodies and joints of the sheet."""
    page, twins = mirrored(page)
    if not page.body:
        raise InputRefused("the sheet has no [[body]]; say which instances move together")
    unique([body.name for body in page.body], "body")
    unique([m.name for m in page.material], "material")
    files = list(dict.fromkeys(expand(name, folder) for name in (page.step, *(place.file for place in page.place)) if name is not None))
    read |= _read_all([path for path in files if path not in read], say, tell)
    inventory = gather(page, twins, folder, read, find_part)
    materials = Materials(page.material, folder)
    used = list({id(p.component): p.component for p, body in zip(inventory.instances, inventory.owner, strict=True) if body}.values())
    for sentence in _lost_colors(inventory):
        tell(sentence)
    _check_part_rules(sorted({part.drawn_as for part in used}), page)
    tolerance = positive(page.tolerance, "length", "tolerance of the sheet")
    drawn = [part.prototype for part in used if isinstance(part, DrawnPart)]
    meshes_of(drawn, tolerance, progress=lambda what, fraction: say(what, 0.2 + 0.4 * fraction))  # all that are new at once
    parts: dict[str, Part] = {}
    found: dict[str, Material] = {}
    for component in used:
        parts[component.name], material = _part(component, page, materials, tolerance)
        if material is not None:
            found.setdefault(material.name, material)
    say("joining", 0.6)
    frames = Frames(page, inventory)
    names = [body.name for body in page.body]
    joints = make_joints(page, names, frames)
    wheels = make_wheels(page, joints, frames, materials)
    drives, lines = make_drives(page, joints)
    bodies = tuple(_body(body.name, page, inventory, parts, joints) for body in page.body)
    if page.budget is not None:
        _hold_budget(bodies, page.budget, tell)
    stated = _stated(page, materials)
    return Rover(
        materials=(*stated, *_new(tuple(found.values()), stated)),
        parts=tuple(parts.values()),
        instances=tuple(
            PartInstance(path=p.path, part=p.component.name, body=body, pose=pose_of(p.matrix))
            for p, body in zip(inventory.instances, inventory.owner, strict=True)
            if body is not None
        ),
        bodies=bodies,
        collision_shapes=_shapes(page, inventory, joints, wheels, tolerance, say),
        joints=tuple(joints.values()),
        drives=drives,
        differentials=make_differentials(page, names, joints),
        gears=make_gears(page, joints),
        loop_closures=make_loops(page, names, frames),
        wheels=wheels,
        sensors=make_sensors(page),
        effects=(*make_frictions(page), *lines),
        sources=_sources((*sources, *files)),
    )


def _read_all(paths: list[Path], say: Say, tell: Note) -> dict[Path, Assembly]:
    notes: list[str] = []
    assemblies = load_assemblies(paths, progress=lambda what, fraction: say(what, 0.2 * fraction), note=notes.append)
    for assembly in assemblies:
        require_solids(assembly)
    for note in notes:
        tell(note)
    return dict(zip(paths, assemblies, strict=True))


def _sources(paths: tuple[Path, ...]) -> tuple[SourceFile, ...]:
    return tuple(source_of(path, "rover", f"rille {__version__}") for path in paths)


def _stated(page: RoverSheet, materials: Materials) -> tuple[Material, ...]:
    """Materials of the sheet, and those of its wheels."""
    names = dict.fromkeys([*(m.name for m in page.material), *(w.material for w in page.wheel if w.material)])
    return tuple(materials.find(name, "the sheet") for name in names)


def _new(found: tuple[Material, ...], there: tuple[Material, ...]) -> tuple[Material, ...]:
    names = {material.name for material in there}
    return tuple(material for material in found if material.name not in names)


def _lost_colors(inventory: Inventory) -> Iterator[str]:
    """Parts whose instances are drawn in several colours: a part has one."""
    colors: dict[str, dict[str, None]] = {}
    for instance in inventory.instances:
        if instance.color is not None:
            colors.setdefault(instance.component.name, {})[instance.color] = None
    for name, found in colors.items():
        if len(found) > 1:
            yield f"instances of part '{name}' are drawn in {len(found)} colours ({', '.join(found)}); a part has one, the first"


def _check_part_rules(names: list[str], page: RoverSheet) -> None:
    """Every [[part]] must match a prototype in use and say something of it that none before says: a rule that does nothing is a mistake."""
    for place, rule in enumerate(page.part):
        matched = [name for name in names if is_named(name, rule.match)]
        if not matched:
            raise InputRefused(f"a [[part]] names the part '{rule.match}', which no body uses; {nearest_names(rule.match, names)}")
        if rule.mass is None and (rule.inertia is not None or rule.com is not None):
            raise InputRefused(f"the [[part]] '{rule.match}' has a stated inertia or centre but no stated mass; state its `mass`, too")
        if rule.mass is None and rule.material is None:
            raise InputRefused(f"the [[part]] '{rule.match}' says nothing; give its `material` or its `mass`")
        for key in ("mass", "material"):
            before = [one for one in page.part[:place] if getattr(one, key) is not None]
            said = [next((one.match for one in before if is_named(name, one.match)), None) for name in matched]
            if getattr(rule, key) is not None and None not in said:
                raise InputRefused(
                    f"the {key} in the [[part]] '{rule.match}' is that of no part: the [[part]] '{said[0]}' stands before it, and the "
                    "first that matches counts; put the narrower one first"
                )


def _part(component: Component, page: RoverSheet, materials: Materials, tolerance: float) -> tuple[Part, Material | None]:
    properties, material = part_properties(component, page, materials)
    mesh = component.mesh(tolerance)
    part = Part(
        name=component.name,
        volume=component.volume.volume,
        properties=properties,
        material=None if material is None else material.name,
        brep_hash=component.digest,
        color=component.color or "#9aa0a6",
        meshes=() if mesh is None else (mesh,),
    )
    return part, material


def _body(name: str, page: RoverSheet, inventory: Inventory, parts: dict[str, Part], joints: dict[str, Joint]) -> Body:
    members = [(parts[p.component.name].properties, p.matrix) for p in inventory.of_body(name)]
    sheet = next(b for b in page.body if b.name == name)
    if not members and sheet.parts:
        raise InputRefused(f"body '{name}' has no parts left: all its instances are on the `ignore` list")
    carrier = next((j for j in joints.values() if j.child == name), None)
    frame = carrier.point if carrier is not None else (0.0, 0.0, 0.0)
    return Body(name=name, properties=body_properties(members, sheet, UP[page.up]), frame=frame)


def _hold_budget(bodies: tuple[Body, ...], budget: BudgetSheet, tell: Note) -> None:
    """Say if the whole machine weighs something else than it should."""
    total = sum(body.properties.mass for body in bodies)
    wanted = positive(budget.mass, "mass", "mass of [budget]")
    tolerance = positive(budget.tolerance, "dimensionless", "tolerance of [budget]")
    if abs(total - wanted) > tolerance * wanted:
        tell(
            f"the machine weighs {total:.4g} kg, {100 * (total / wanted - 1):+.2g} % off its budget of {wanted:.4g} kg "
            f"(+-{100 * tolerance:g} %); correct masses or densities, or the budget"
        )


def _shapes(
    page: RoverSheet, inventory: Inventory, joints: dict[str, Joint], wheels: tuple[Wheel, ...], tolerance: float, say: Say
) -> tuple[CollisionShape, ...]:
    wheeled = {joints[w.joint].child for w in wheels}
    shapes = list(_rims(wheels, joints))
    for count, body in enumerate(page.body):
        if body.name in wheeled:
            continue
        say(f"collision shapes of {body.name}", 0.65 + 0.35 * count / len(page.body))
        shapes += body_shapes(body.name, inventory.of_body(body.name), body.collision or page.collision, tolerance)
    order = {body.name: i for i, body in enumerate(page.body)}
    return tuple(sorted(shapes, key=lambda shape: order[shape.body]))


def _rims(wheels: tuple[Wheel, ...], joints: dict[str, Joint]) -> tuple[CollisionShape, ...]:
    return tuple(wheel_shape(wheel, joints[wheel.joint], joints[wheel.joint].child) for wheel in wheels)
