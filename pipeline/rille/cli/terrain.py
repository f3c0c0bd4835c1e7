"""``rille terrain``: from scene to ground."""

from pathlib import Path
from typing import Annotated

import typer

from rille.cli.talk import Force, Json, print_json, progress, say

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Compose ground from measured DEMs and landforms.\n\nExample: rille terrain build scene.toml -o rover.db",
)


@app.command("build")
def build(
    scene: Annotated[Path, typer.Argument(help="Scene (TOML): base, landforms, soils.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Database; made if absent, else the terrain of that name is replaced.")
    ] = None,
    geotiff: Annotated[Path | None, typer.Option(help="Also write the heights as GeoTIFF.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Evaluate a scene into a database.

    Example: rille terrain build examples/terrain/composed.toml -o rover.db --geotiff composed.tif
    """
    import numpy as np

    from rille import store, terrain

    target = output or scene.with_suffix(".db")
    with progress(f"building {scene.name}") as update:
        ground = terrain.build(scene, progress=update)
    if not target.exists():
        store.create(target)
    store.write_terrain(target, ground, replace=force)
    if geotiff is not None:
        terrain.write_geotiff(ground, geotiff)
    n_rows, n_cols = ground.heights.shape
    facts = {
        "database": str(target),
        "terrain": ground.name,
        "rows": n_rows,
        "columns": n_cols,
        "posting_m": [ground.posting_x, ground.posting_y],
        "extent_m": [(n_cols - 1) * ground.posting_x, (n_rows - 1) * ground.posting_y],
        "heights_m": [float(np.nanmin(ground.heights)), float(np.nanmax(ground.heights))],
        "landforms": [landform.name for landform in ground.landforms],
        "soils": [soil.name for soil in ground.soils],
        "geotiff": None if geotiff is None else str(geotiff),
    }
    if as_json:
        print_json(facts)
        return
    width, height = facts["extent_m"]
    low, high = facts["heights_m"]
    say(
        f"{target}: terrain '{ground.name}', {width:g} m x {height:g} m at {ground.posting_x:g} m, heights {low:.2f} to {high:.2f} m, "
        f"{len(ground.landforms)} landforms, soils {', '.join(facts['soils'])}"
    )
    if geotiff is not None:
        say(f"wrote {geotiff}")


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
def list_landforms(as_json: Json = False) -> None:
    """List the registered landforms with their drivers.

    Example: rille terrain list
    """
    from rille import terrain

    register = terrain.landforms()
    if as_json:
        drivers = ("name", "unit", "meaning", "lower", "upper", "default")
        print_json(
            {
                name: {
                    "meaning": form.meaning,
                    "frame": form.frame,
                    "source": form.source,
                    "drivers": [{key: getattr(d, key) for key in drivers} for d in form.drivers],
                }
                for name, form in register.items()
            }
        )
        return
    for name, form in register.items():
        print(f"{name}: {form.meaning} ({form.source})")
        for driver in form.drivers:
            default = "must be given" if driver.default is None else f"default {driver.default:g}"
            print(f"    {driver.name} [{driver.unit}] {driver.meaning}; {driver.lower:g} to {driver.upper:g}, {default}")
