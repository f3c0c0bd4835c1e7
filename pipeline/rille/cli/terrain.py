"""``rille terrain``: from scene to ground."""

from pathlib import Path
from typing import Annotated

import typer

from rille.cli import terrain_edit, terrain_extract, terrain_library, terrain_preview, terrain_stats
from rille.cli.talk import Force, Json, print_json, progress, say
from rille.cli.terrain_facts import facts_of, sentence_of, write_database

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Compose ground from measured DEMs and landforms.\n\nExample: rille terrain build scene.toml -o rover.db",
)


@app.command("build")
def build(
    scene: Annotated[Path, typer.Argument(help="Scene (TOML): base, landforms, populations, soils.")],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            help="What to write, once for each: a database (.db; the terrain of that name is replaced), .tif, .asc, .png, .npy, .obj, "
            ".stl, .glb ... (see `rille terrain extract --help`). All come from one evaluation. Default: the scene's name with .db.",
        ),
    ] = None,
    geotiff: Annotated[Path | None, typer.Option(help="The same as -o FILE.tif.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Evaluate a scene on its own grid; of one that was evaluated before, only what changed. Ctrl-C loses nothing: start again to go on.

    Example: rille terrain build examples/terrain/composed.toml -o rover.db -o composed.tif
    """
    from rille import terrain
    from rille.model import InputRefused
    from rille.terrain import delivery

    if scene.is_dir():
        raise InputRefused(f"'{scene}' is a folder; name the scene file in it")
    targets = [*(output or [scene.with_suffix(".db")]), *([geotiff] if geotiff is not None else [])]
    databases = [target for target in targets if target.suffix == ".db"]
    files = delivery.plan([target for target in targets if target.suffix != ".db"])
    with progress(f"building {scene.name}") as update:
        ground = terrain.build(scene, progress=update, tell=say)
        update("writing", 0.0)
        for database in databases:
            write_database(ground, database, force, update)
        written = [*databases, *delivery.deliver(ground, files, update)]
    if gaps := delivery.left_out(ground, files):
        say(f"note: {gaps}")
    facts = {
        "database": str(databases[0]) if databases else None,
        "geotiff": None if geotiff is None else str(geotiff),
        "files": [str(file) for file in written],
        **facts_of(ground),
    }
    if as_json:
        print_json(facts)
        return
    say(f"{databases[0] if databases else scene}: {sentence_of(facts)}")
    for file in written:
        if file not in databases:
            say(f"wrote {file}")


@app.command("ruts")
def ruts(
    database: Annotated[Path, typer.Argument(help="Database with a run.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="GeoTIFF of the depth [m] below the undisturbed terrain.")],
    run: Annotated[int | None, typer.Option(help="Number of the run; default: the latest.")] = None,
    as_json: Json = False,
) -> None:
    """Write the ruts of a run as a DEM layer: the largest depth that each cell was pressed to.

    Example: rille terrain ruts rover.db -o ruts.tif
    """
    from rille import store, terrain
    from rille.model import InputRefused

    terrain.require_geotiff(output)
    trace = store.read_trace(database, run)
    left = store.read_ruts(database, trace.run_id)
    name = store.read_scenario(database, trace.scenario).terrain
    if left is None or name is None:
        raise InputRefused(f"run {trace.run_id} of '{database}' left no ruts; it ran without soil under its wheels")
    terrain.write_ruts(left, store.read_terrain(database, name), output)
    facts = {"file": str(output), "run": trace.run_id, "posting_m": left.posting, "deepest_m": float(left.sinkage.max())}
    if as_json:
        print_json(facts)
    else:
        say(
            f"wrote {output}: ruts of run {trace.run_id}, up to {1e3 * facts['deepest_m']:.1f} mm deep, "
            f"cells of {1e3 * left.posting:.3g} mm"
        )


@app.command("list")
def list_landforms(
    scene: Annotated[Path | None, typer.Argument(help="Scene; without it, the landforms that are registered.")] = None,
    library: Annotated[list[Path] | None, typer.Option(help="Folder with own landforms, besides the user's; may be given again.")] = None,
    document: Annotated[Path | None, typer.Option(help="Write README.md and pictures of the built-in landforms into this folder.")] = None,
    as_json: Json = False,
) -> None:
    """List the registered landforms with their drivers, or what is placed in a scene.

    Example: rille terrain list examples/terrain/composed.toml
    """
    if document is not None:
        terrain_library.document(document, as_json)
    elif scene is not None:
        terrain_edit.list_placed(scene, as_json)
    else:
        terrain_library.list_register(library or [], as_json)


app.command("show")(terrain_library.show)
app.command("register")(terrain_library.register)
app.command("preview")(terrain_preview.preview)
app.command("extract")(terrain_extract.extract)
app.command("stats")(terrain_stats.stats)


def _show(scene: Path, picture: Path) -> None:
    """The map of a scene, after an edit."""
    from rille import terrain

    terrain_preview.quick_picture(terrain.build(scene, tell=say), scene, picture)


terrain_edit.attach(app, _show)
