"""``rille cad inspect`` and ``rille cad new``: look at a CAD file, and draft a sheet from it."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import typer

from rille.cli.places import require_place, require_png
from rille.cli.talk import Json, print_json, progress, say

File = Annotated[Path, typer.Argument(help="STEP file, or CadQuery script (.py); `new` takes a URDF, too.")]
Picture = Annotated[Path | None, typer.Option("--picture", help="Also draw a picture (PNG).")]
Update = Callable[[str, float], None]


def inspect(file: File, picture: Picture = None, as_json: Json = False) -> None:
    """Say what is in a CAD file: the tree with counts, every part's volume, box, solids, material, and what to look at.

    Example: rille cad inspect rover.step --picture rover.png
    """
    from rille import cad
    from rille.cad.suggestion.inspect import as_dict, as_text
    from rille.cad.suggestion.inspect import inspect as look

    require_png(picture)
    require_place(picture, reads=[file])
    with progress(f"reading {file.name}") as update:
        assembly = cad.load_assembly(file, progress=lambda what, f: update(what, 0.7 * f))
        report = look(assembly)
        notes = [] if picture is None else _draw(picture, assembly, f"{file.name}: {report.instances} instances", update)
    if as_json:
        print_json(as_dict(report) | ({} if picture is None else {"picture": str(picture), "notes": notes}))
    else:
        print(as_text(report))
    _tell_picture(picture, notes)


def new(
    file: File,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Sheet to write; default: the file's name with .toml.")] = None,
    picture: Picture = None,
    force: Annotated[bool, typer.Option("--force", help="Write over an existing sheet.")] = False,
    as_json: Json = False,
) -> None:
    """Draft a sheet from the geometry of a CAD file: bodies, joints and wheels, each with its evidence and a confidence.

    Nothing is used in silence: `rille cad build` refuses the sheet until a person has read it and set `accepted = true`.
    A URDF has its bodies and joints already; for it, the sheet adds wheels.

    Example: rille cad new rover.step -o rover.toml --picture rover.png
    """
    from rille import cad
    from rille.cad.exchange.urdf_file import is_urdf
    from rille.cad.suggestion.draft import draft_sheet
    from rille.cad.suggestion.suggest import suggest
    from rille.model import InputRefused

    sheet = output or file.with_suffix(".toml")
    if sheet.exists() and not force:
        raise InputRefused(f"the sheet '{sheet}' exists; give another name with -o, or --force to write over it")
    require_png(picture)
    require_place(sheet, picture, reads=[file])
    if is_urdf(file):
        if picture is not None:
            raise InputRefused(
                "--picture is of what was found in a STEP file or a script; build the URDF, then `rille cad preview` draws it"
            )
        _new_for_urdf(file, sheet, as_json)
        return
    with progress(f"drafting {sheet.name}") as update:
        assembly = cad.load_assembly(file, progress=lambda what, f: update(what, 0.3 * f))
        found = suggest(assembly, lambda what, f: update(what, 0.3 + 0.5 * f))
        text = draft_sheet(assembly, found, os.path.relpath(file.resolve(), sheet.parent.resolve()))
        sheet.write_text(text, encoding="utf-8")
        notes = [] if picture is None else _draw_found(picture, assembly, found, file.name, update)
    if as_json:
        print_json(_found_dict(sheet, assembly, found) | ({} if picture is None else {"picture": str(picture), "notes": notes}))
    else:
        _print_found(found)
    for sentence in (*assembly.notes, *found.notes):
        say(f"note: {sentence}")
    say(f"{sheet}: read it, edit it, set `accepted = true`, then: rille cad build {quote(str(sheet))}")
    _tell_picture(picture, notes)


def _new_for_urdf(file: Path, sheet: Path, as_json: bool) -> None:
    from dataclasses import asdict

    from rille.cad.exchange import read_urdf
    from rille.cad.suggestion.urdf_draft import draft_urdf_sheet, guess_wheels

    rover = read_urdf(file, note=say)
    wheels = guess_wheels(rover)
    sheet.write_text(draft_urdf_sheet(rover, wheels, os.path.relpath(file.resolve(), sheet.parent.resolve())), encoding="utf-8")
    if as_json:
        print_json({"sheet": str(sheet), "bodies": len(rover.bodies), "wheels": [asdict(wheel) for wheel in wheels]})
    for wheel in wheels if not as_json else ():
        print(f"wheel on {wheel.joint}: radius {1e3 * wheel.radius:.2f} mm, width {1e3 * wheel.width:.2f} mm ({wheel.evidence})")
    say(f"{sheet}: read it, edit it, set `accepted = true`, then: rille cad build {quote(str(sheet))}")


def _print_found(found: Any) -> None:
    names = [j.name for j in found.joints]
    width = max([len(n) for n in names] + [5])
    print(f"{len(found.bodies)} bodies, carried by '{found.root}'; joints:")
    print(f"{'':3}{'joint':<{width}} {'kind':<9} {'conf.':>5}  {'point [mm]':^27} {'axis':^22}  parent -> child")
    for joint in found.joints:
        used = "yes" if joint in found.accepted else "loop" if joint.loop else "no"
        point = " ".join(f"{v * 1e3:8.2f}" for v in joint.point)
        axis = " ".join(f"{v:6.3f}" for v in joint.axis)
        sign = {"yes": "+", "loop": "o", "no": "?"}[used]
        start = f"{sign:<3}{joint.name:<{width}} {joint.kind:<9} {joint.confidence:5.2f}"
        print(f"{start}  {point:^27} {axis:^22}  {joint.parent} -> {joint.child}")
        if joint.evidence:
            print(f"{'':{width + 4}}{joint.evidence[0]}")
    for wheel in found.wheels:
        grousers = f", {wheel.grouser_count} grousers {wheel.grouser_height * 1e3:.1f} mm high" if wheel.grouser_count else ""
        size = f"radius {wheel.radius * 1e3:.2f} mm, width {wheel.width * 1e3:.2f} mm"
        print(f"wheel on {wheel.joint}: {size}{grousers} ({wheel.confidence:.2f})")
    print(f"+ active on the sheet; ? under {found.threshold:g}, commented out; o closes a loop, commented out")


def _found_dict(sheet: Path, assembly: Any, found: Any) -> dict[str, Any]:
    paths = [instance.path for instance in assembly.instances]
    return {
        "sheet": str(sheet),
        "root": found.root,
        "threshold": found.threshold,
        "bodies": [{"name": b.name, "instances": [paths[i] for i in b.instances], "notes": list(b.notes)} for b in found.bodies],
        "joints": [
            {
                "name": j.name,
                "kind": j.kind,
                "parent": j.parent,
                "child": j.child,
                "point_m": j.point.tolist(),
                "axis": j.axis.tolist(),
                "confidence": j.confidence,
                "active": j in found.accepted,
                "loop": j.loop,
                "evidence": list(j.evidence),
                "doubts": list(j.doubts),
                "moving": [paths[i] for i in j.moving],
            }
            for j in found.joints
        ],
        "wheels": [
            {
                "joint": w.joint,
                "body": w.body,
                "center_m": w.center.tolist(),
                "axis": w.axis.tolist(),
                "radius_m": w.radius,
                "width_m": w.width,
                "grousers": w.grouser_count,
                "grouser_height_m": w.grouser_height,
                "grouser_thickness_m": w.grouser_thickness,
                "confidence": w.confidence,
                "evidence": list(w.evidence),
            }
            for w in found.wheels
        ],
        "notes": [*assembly.notes, *found.notes],
    }


def _solids(assembly: Any, color_of: Mapping[int, str], update: Update) -> list[Any]:
    """What stands in the picture; the tolerance is that of the eye: a thousandth of the machine."""
    import numpy as np

    from rille import cad
    from rille.view.cad_pictures import Solid

    places = np.array([instance.matrix[:3, 3] for instance in assembly.instances])
    parts = [p.bounds[1] - p.bounds[0] for p in assembly.prototypes]
    size = float(np.linalg.norm(np.ptp(places, axis=0)) + max(np.linalg.norm(p) for p in parts))
    meshes = cad.meshes_of(assembly.prototypes, max(1e-3 * size, 1e-5), progress=lambda what, f: update(what, 0.8 + 0.1 * f))
    found = []
    for i, instance in enumerate(assembly.instances):
        mesh = meshes[instance.prototype]
        if mesh is not None:
            vertices = mesh.vertices @ instance.matrix[:3, :3].T + instance.matrix[:3, 3]
            found.append(Solid(vertices=vertices, triangles=mesh.triangles, color=color_of[i]))
    return found


def _draw(picture: Path, assembly: Any, title: str, update: Update) -> list[str]:
    from rille.view.cad_pictures import draw_assembly

    update("picture", 0.8)
    colors = {i: assembly.prototypes[x.prototype].color or x.color or "#9aa0a6" for i, x in enumerate(assembly.instances)}
    return draw_assembly(picture, _solids(assembly, colors, update), title=title)


def _draw_found(picture: Path, assembly: Any, found: Any, name: str, update: Update) -> list[str]:
    from rille.view.cad_pictures import BODY_COLORS, AxisMark, WheelMark, draw_assembly

    update("picture", 0.8)
    color_of_body = {b.name: BODY_COLORS[k % len(BODY_COLORS)] for k, b in enumerate(found.bodies)}
    colors = {i: color_of_body[b.name] for b in found.bodies for i in b.instances}
    shown = [*found.accepted, *(j for j in found.joints if j not in found.accepted and j.confidence >= 0.5 * found.threshold)]
    axes = [
        AxisMark(point=j.point, axis=j.axis, kind=j.kind, label=f"{j.name} {j.confidence:.2f}", sure=j in found.accepted)
        for j in shown[: max(len(found.accepted), 20)]  # more labels than that would hide the machine
    ]
    wheels = [WheelMark(center=w.center, axis=w.axis, radius=w.radius) for w in found.wheels]
    return draw_assembly(
        picture,
        _solids(assembly, {i: colors.get(i, "#c9ccd1") for i in range(len(assembly.instances))}, update),
        axes=axes,
        wheels=wheels,
        title=f"{name}: {len(found.bodies)} bodies, {len(found.accepted)} joints suggested (dashed: unsure)",
        legend=list(color_of_body.items()),
    )


def _tell_picture(picture: Path | None, notes: list[str]) -> None:
    for note in notes:
        say(note)
    if picture is not None and not notes:
        say(f"picture: {picture}")
