"""``rille replay``: a run as a web page that moves, as a film, as an animation for other programs."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rille.cli.talk import Json, print_json, progress, say

STILLS = ".png"


def replay(
    database: Annotated[Path, typer.Argument(help="Database with the run.")],
    run: Annotated[int | None, typer.Option(help="Number of the run; default: the latest.")] = None,
    against: Annotated[str | None, typer.Option(help="Another run, by its number, or a recording, by its name: shown beside it.")] = None,
    side: Annotated[bool, typer.Option("--side", help="Two pictures side by side instead of a ghost in one.")] = False,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Page to write; default: DATABASE-run-N.html beside the database.")
    ] = None,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    as_json: Json = False,
) -> int:
    """Watch a run in the browser: rover, ground with ruts, forces, slip, path, plots; play, scrub, compare. One file, works offline.

    Example: rille replay rover.db --open

    Example: rille replay rover.db --run 3 --against 2 --side
    """
    import numpy as np

    from rille import store
    from rille.model import InputRefused
    from rille.view import scene3d

    rover = store.read_rover(database)
    trace = store.read_trace(database, run)
    if len(trace.time) == 0:
        raise InputRefused(f"run {trace.run_id} of '{database}' holds no states; run the scenario again")
    scenario = store.read_scenario(database, trace.scenario)
    terrain = None if scenario.terrain is None else store.read_terrain(database, scenario.terrain)
    others = [] if against is None else [_other(database, against)]
    with progress("replay") as update:
        update("scene", 0.1)
        path = np.concatenate([body.position for shown in (trace, *others) for body in shown.bodies])
        view = scene3d.view_of(terrain, path)
        origin = np.array(view.origin)
        title = f"{database.stem}: {trace.scenario}, run {trace.run_id}"
        layout = scene3d.layout(
            rover, view, title=title, gravity=scene3d.gravity_of(scenario), step=trace.step, duration=float(trace.time[-1])
        )
        scene = scene3d.scene_glb(rover, terrain, view)
        update("runs", 0.6)
        runs = [
            scene3d.Shown(label=f"run {t.run_id}", time=t.time, states=scene3d.states(t, rover, origin), events=t.events)
            for t in (trace, *others)
        ]
        mode = "single" if not others else "side" if side else "ghost"
        update("page", 0.8)
        text = scene3d.page(scene3d.source(layout, scene, runs, mode), title)
    target = out if out is not None else database.with_name(f"{database.stem}-run-{trace.run_id}.html")
    _write(target, text)
    if as_json:
        print_json({"page": str(target), "run_id": trace.run_id, "duration": float(trace.time[-1]), "bytes": len(text.encode())})
    else:
        print(target)
    if open_page:
        import webbrowser

        webbrowser.open(target.resolve().as_uri())
    return 0


def _other(database: Path, against: str) -> Any:
    from rille import store
    from rille.model import InputRefused

    if against.isdigit():
        return store.read_trace(database, int(against))
    raise InputRefused(f"'{against}' is no number of a run")


def _write(target: Path, text: str) -> None:
    """All of it, or nothing new."""
    from rille.model import InputRefused

    part = target.with_name(target.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(target)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputRefused(f"'{target}' cannot be written: {error.strerror}") from None
