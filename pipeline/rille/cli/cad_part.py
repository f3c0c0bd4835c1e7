"""``rille cad part``: parts that are used again."""

import re
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from rille.cli.talk import Json, print_json, say

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="A library of parts with their masses and meshes, keyed by their geometry (RILLE_PARTS, else ~/.local/share/rille/parts.db).\n\n"
    "Example: rille cad part add rover.db wheel",
)

Library = Annotated[Path | None, typer.Option("--library", help="Another database than the part library.")]


@app.command("add")
def add(
    database: Annotated[Path, typer.Argument(help="Model that has the part.")],
    part: Annotated[str, typer.Argument(help="Name of the part, or the beginning of its digest.")],
    name: Annotated[str | None, typer.Option("--as", help="Name in the library.")] = None,
    library: Library = None,
    force: Annotated[bool, typer.Option("--force", help="Replace other geometry of that name.")] = False,
    as_json: Json = False,
) -> None:
    """Put a part of a model into the library.

    Example: rille cad part add rover.db wheel --as wheel_300mm
    """
    from dataclasses import replace

    from rille import store

    found, material = store.find_part(database, part)
    found = replace(found, name=name or found.name)
    where = library or store.part_library()
    done = store.add_part(where, found, material, replace_other=force)
    if as_json:
        print_json({"library": str(where), "part": found.name, "digest": found.brep_hash, "mass_kg": found.properties.mass, "done": done})
        return
    say(f"{done} '{found.name}', {found.properties.mass:.4g} kg, digest {found.brep_hash[:12] or 'none'}, in {where}")


@app.command("list")
def list_(library: Library = None, as_json: Json = False) -> None:
    """List the parts of the library, or of any model.

    Example: rille cad part list --library rover.db
    """
    from rille import store

    where = library or store.part_library()
    parts = store.list_parts(where) if library is not None or where.exists() else ()
    rows = [
        {
            "part": part.name,
            "mass_kg": part.properties.mass,
            "volume_m3": part.volume,
            "material": part.material,
            "mass_from": part.properties.mass_provenance,
            "digest": part.brep_hash,
        }
        for part, _ in parts
    ]
    if as_json:
        print_json(rows)
        return
    if not rows:
        say(f"{where}: no parts yet; `rille cad part add MODEL.db PART` puts one in")
        return
    print(f"{'part':<28} {'mass [kg]':>10} {'volume [cm3]':>13}  {'material':<16} {'mass from':<12} digest")
    for row in rows:
        print(
            f"{row['part']:<28} {row['mass_kg']:10.4g} {1e6 * row['volume_m3']:13.4g}  {row['material'] or '-':<16} "
            f"{row['mass_from']:<12} {row['digest'][:12]}"
        )


@app.command("use")
def use(
    part: Annotated[str, typer.Argument(help="Name of the part, or the beginning of its digest.")],
    sheet: Annotated[Path, typer.Option("--sheet", help="Sheet that gets the [[place]] table.")],
    body: Annotated[str, typer.Option(help="Body that the part belongs to.")],
    name: Annotated[str | None, typer.Option("--as", help="Path of the instance; default: BODY/PART.")] = None,
    at: Annotated[str, typer.Option(help="Position in the drawing: three lengths.")] = "0, 0, 0",
    rpy: Annotated[str, typer.Option(help="Roll, pitch, yaw: three angles.")] = "0, 0, 0",
    library: Library = None,
    as_json: Json = False,
) -> None:
    """Place a part of the library (or of another model) on a sheet.

    Example: rille cad part use wheel_300mm --sheet rover.toml --body wheel_left --at "100 mm, 250 mm, 0" --rpy "0, 0, 90 deg"
    """
    from rille import store
    from rille.model import InputRefused
    from rille.model.sheet import toml_string

    if not sheet.is_file():
        raise InputRefused(f"there is no sheet '{sheet}'; `rille cad new FILE.step` writes one")
    found, _ = store.find_part(library, part)
    named = {"name": name or f"{body}/{found.name}", "part": found.name, "body": body}
    lines = ["", "[[place]]", *(f"{key} = {toml_string(value)}" for key, value in named.items())]
    if library is not None:
        lines.append(f"database = {toml_string(str(library.resolve()))}")
    lines += [f"position = {_three(at, 'length', '--at')}", f"rpy = {_three(rpy, 'angle', '--rpy')}"]
    lines.append(f"# {found.properties.mass:.6g} kg ({found.properties.mass_provenance}), digest {found.brep_hash[:12] or 'none'}")
    with sheet.open("a", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    if as_json:
        print_json({"sheet": str(sheet), "part": found.name, "mass_kg": found.properties.mass, "digest": found.brep_hash})
        return
    say(f"{sheet}: [[place]] of '{found.name}' added; `rille cad build {quote(str(sheet))}` uses it")


def _three(text: str, kind: str, option: str) -> str:
    """Three quantities as a TOML array, checked."""
    from rille.model import InputRefused
    from rille.model.quantity import to_si
    from rille.model.sheet import toml_string

    values = [v.strip() for v in re.split(r"[,;]", text)]
    if len(values) != 3:
        raise InputRefused(f"{option} is '{text}', {len(values)} values; give three, separated by commas")
    for value in values:
        to_si(value, kind, option)
    return "[" + ", ".join(toml_string(v) for v in values) + "]"
