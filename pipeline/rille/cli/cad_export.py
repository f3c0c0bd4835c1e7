"""``rille cad export``: a model for other programs."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rille.cli.talk import Json, print_json, say


class Format(StrEnum):
    """What can be written."""

    urdf = "urdf"
    mjcf = "mjcf"
    sdf = "sdf"
    obj = "obj"
    glb = "glb"


SUFFIXES = {Format.urdf: ".urdf", Format.mjcf: ".xml", Format.sdf: ".sdf", Format.obj: ".obj", Format.glb: ".glb"}


def export(
    database: Annotated[Path, typer.Argument(help="Model that `rille cad build` made.")],
    formats: Annotated[
        list[Format] | None, typer.Option("--format", "-f", help="May be given more than once; default: by the name of the output.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder, or the file of a single format; default: MODEL_export beside the model.")
    ] = None,
    mimic: Annotated[bool, typer.Option("--mimic", help="URDF: write differentials and gears as <mimic>.")] = False,
    drop_loops: Annotated[bool, typer.Option("--drop-loops", help="URDF: leave loop closures out, the loops open.")] = False,
    as_json: Json = False,
) -> None:
    """Write a model as URDF, MJCF (MuJoCo), SDF (Gazebo) with its meshes, or as one mesh (OBJ, glTF) at the zero pose.

    Example: rille cad export rover.db --format mjcf --format sdf -o rover_export
    """
    from rille import store

    wanted, folder, name = _target(database, list(dict.fromkeys(formats or [])), output)
    rover = store.read_rover(database)
    notes: list[str] = []
    files = []
    for one in wanted:
        path = _write(one, rover, folder, name, mimic, drop_loops, lambda sentence, one=one: notes.append(f"{one}: {sentence}"))
        files.append({"format": str(one), "path": str(path)})
    if as_json:
        total = sum(body.properties.mass for body in rover.bodies)
        print_json({"database": str(database), "total_mass_kg": total, "files": files, "notes": notes})
        return
    for sentence in notes:
        say(sentence)
    for file in files:
        print(file["path"])


def _target(database: Path, formats: list[Format], output: Path | None) -> tuple[list[Format], Path, str]:
    """Formats, folder and name of the files."""
    from rille.model import InputRefused

    by_name = None if output is None else next((f for f, suffix in SUFFIXES.items() if suffix == output.suffix.lower()), None)
    if not formats and by_name is None:
        raise InputRefused(f"say what to write: --format {', '.join(Format)}, or an output such as {database.stem}.urdf")
    formats = formats or [by_name]  # type: ignore[list-item]
    if output is None:
        return formats, database.parent / f"{database.stem}_export", database.stem
    if by_name is None or output.is_dir():
        if output.exists() and not output.is_dir():
            raise InputRefused(f"'{output}' is a file; give a folder, or a file that ends in {', '.join(SUFFIXES[f] for f in formats)}")
        return formats, output, database.stem
    if len(formats) > 1 or formats[0] != by_name:
        asked = ", ".join(formats)
        raise InputRefused(
            f"the output '{output}' is one {by_name} file, but --format asks for {asked}; give a folder, or leave --format out"
        )
    return formats, output.parent, output.stem


def _write(one: Format, rover, folder: Path, name: str, mimic: bool, drop_loops: bool, note) -> Path:
    from rille.cad import exchange

    if one is Format.urdf:
        return exchange.write_urdf(rover, folder, name=name, mimic=mimic, drop_loops=drop_loops, note=note)
    if one is Format.mjcf:
        return exchange.write_mjcf(rover, folder, name=name, note=note)
    if one is Format.sdf:
        return exchange.write_sdf(rover, folder, name=name, note=note)
    return exchange.write_scene(rover, folder / f"{name}{SUFFIXES[one]}")
