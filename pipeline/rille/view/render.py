"""All pictures of a run."""

from collections.abc import Callable
from pathlib import Path

from rille.model import InputRefused, Rover, Ruts, Terrain, Trace
from rille.view.compose import mechanism_drawing, traverse_drawings
from rille.view.drawing import draw
from rille.view.plots import plot_map, plot_ruts, plot_traces


def render(
    trace: Trace,
    rover: Rover,
    terrain: Terrain | None,
    folder: Path,
    *,
    time: float | None = None,
    ruts: Ruts | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[list[Path], list[str]]:
    """Draw a run into a folder; 3-D pictures show the stored state nearest to ``time`` [s], without it the last one.

    Returns
    -------
    The files: ``traces.png``, and with terrain ``map.png``, ``scene.png``, ``rover.png`` and (with ruts) ``ruts.png``, without it
    ``scene.png``; and notes about
    what could not be drawn (3-D pictures need EGL).

    Raises
    ------
    InputRefused : if the run holds no states, or the folder cannot be made.
    """
    say = progress or (lambda what, fraction: None)
    if len(trace.time) == 0:
        raise InputRefused(f"run {trace.run_id} holds no states to draw; run the scenario again")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputRefused(f"the folder '{folder}' cannot be made: {error}") from None
    if time is not None:
        if not trace.time[0] <= time <= trace.time[-1] + 1e-9:
            raise InputRefused(f"time is {time:g} s; run {trace.run_id} goes from {trace.time[0]:g} to {trace.time[-1]:g} s")
        shown = trace.until(time)
    else:
        shown = trace
    paths = [folder / "traces.png"]
    say("plots", 0.0)
    plot_traces(trace, rover, paths[0])
    drawings = {}
    has_meshes = any(part.meshes for part in rover.parts)
    if terrain is not None:
        paths.append(folder / "map.png")
        plot_map(trace, rover, terrain, paths[-1])
        if ruts is not None and ruts.sinkage.max() > 0:
            paths.append(folder / "ruts.png")
            plot_ruts(ruts, terrain, paths[-1], f"{terrain.name}: ruts of run {trace.run_id}")
    if has_meshes:
        made = {"scene": mechanism_drawing(rover, shown)} if terrain is None else traverse_drawings(rover, shown, terrain)
        drawings = {folder / f"{name}.png": drawing for name, drawing in made.items()}
    for path in drawings:
        path.unlink(missing_ok=True)  # an older picture must not pass for a new one
    say("3-D pictures", 0.3)
    notes = draw(drawings)
    if not has_meshes:
        notes.append("the model has no visual meshes, so there is no 3-D picture")
    say("done", 1.0)
    return [*paths, *(path for path in drawings if path.is_file())], notes
