"""``rille view``: pictures of a run."""

from pathlib import Path
from typing import Annotated

import typer

from rille.cli.talk import Json, print_json, progress, say


def view(
    database: Annotated[Path, typer.Argument(help="Database with a run.")],
    run: Annotated[int | None, typer.Option(help="Number of the run; default: the latest.")] = None,
    time: Annotated[float | None, typer.Option(help="Time of the 3-D pictures [s]; default: the end.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the pictures; made if absent.")] = Path("pictures"),
    as_json: Json = False,
) -> None:
    """Draw the rover on its terrain with its wheel tracks, a map, and slip, sinkage and torque over time (PNG, off-screen).

    Example: rille view rover.db -o pictures --time 12
    """
    from rille import store
    from rille import view as pictures

    trace = store.read_trace(database, run)
    rover = store.read_rover(database)
    scenario = store.read_scenario(database, trace.scenario)
    terrain = store.read_terrain(database, scenario.terrain) if scenario.terrain is not None else None
    with progress("drawing") as update:
        paths, notes = pictures.render(
            trace, rover, terrain, output, time=time, ruts=store.read_ruts(database, trace.run_id), progress=update
        )
    if as_json:
        print_json({"pictures": [str(path) for path in paths], "notes": notes})
        return
    for path in paths:
        print(path)
    for note in notes:
        say(note)
