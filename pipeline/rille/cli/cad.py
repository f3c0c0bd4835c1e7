"""``rille cad``: from assembly to model."""

from pathlib import Path
from typing import Annotated

import typer

from rille.cli import cad_part
from rille.cli.cad_check import check, diff
from rille.cli.cad_export import export
from rille.cli.cad_look import inspect, new
from rille.cli.cad_preview import preview
from rille.cli.talk import Force, Json, print_json, progress, say

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="From a STEP assembly, a CadQuery script or a URDF to a checked model: inspect, new, build, check.\n\n"
    "Example: rille cad build examples/rover/rover.toml -o rover.db",
)
app.command("inspect")(inspect)
app.command("new")(new)


@app.command("build")
def build(
    source: Annotated[Path, typer.Argument(help="Sheet (TOML), CadQuery script with joints (.py), or URDF.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Database; made if absent, else its rover is replaced.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Build a mechanism from a sheet and the files that it names into a database.

    Example: rille cad build examples/rover/rover.toml -o rover.db
    """
    from rille import cad, store

    target = output or source.with_suffix(".db")
    with progress(f"building {source.name}") as update:
        rover = cad.build(source, progress=update, note=say, find_part=store.find_part)
    with store.made_if_absent(target):
        store.write_rover(target, rover, replace=force)
    bodies = [
        {
            "body": body.name,
            "mass_kg": body.properties.mass,
            "com_m": body.properties.com.tolist(),
            "mass_from": body.properties.mass_provenance,
            "inertia_from": body.properties.inertia_provenance,
        }
        for body in rover.bodies
    ]
    total = sum(body.properties.mass for body in rover.bodies)
    if as_json:
        print_json({"database": str(target), "total_mass_kg": total, "bodies": bodies})
        return
    _table(bodies)
    say(
        f"{target}: {len(rover.parts)} parts, {len(rover.instances)} instances, {len(rover.bodies)} bodies, {len(rover.joints)} joints, "
        f"{len(rover.wheels)} wheels, {total:.2f} kg"
    )


app.command("check")(check)
app.command("preview")(preview)
app.command("diff")(diff)
app.command("export")(export)
app.add_typer(cad_part.app, name="part")


def _table(bodies: list[dict]) -> None:
    print(f"{'body':<24} {'mass [kg]':>10}  {'centre of mass [m]':^26}  mass from")
    for row in bodies:
        center = " ".join(f"{v:8.4f}" for v in row["com_m"])
        print(f"{row['body']:<24} {row['mass_kg']:10.4f}  {center}  {row['mass_from']}")
