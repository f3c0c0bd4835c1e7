"""All pictures of a run."""

from collections.abc import Callable
from pathlib import Path

from rille.model import InputRefused, Rover, Terrain, Trace
from rille.view.compose import mechanism_drawing, traverse_drawings
from rille.view.drawing import draw
from rille.view.plots import plot_map, plot_traces


def render(
    trace: Trace,
    rover: Rover,
    terrain: Terrain | None,
    folder: Path,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[list[Path], list[str]]:
    """Draw a run into a folder.

    Returns
    -------
    The files: ``traces.png``, and with terrain ``map.png``, ``scene.png``, ``rover.png``, without it ``scene.png``; and notes about
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
    paths = [folder / "traces.png"]
    say("plots", 0.0)
    plot_traces(trace, paths[0])
    drawings = {}
    has_meshes = any(part.meshes for part in rover.parts)
    if terrain is not None:
        paths.append(folder / "map.png")
        plot_map(trace, rover, terrain, paths[-1])
    if has_meshes:
        made = {"scene": mechanism_drawing(rover, trace)} if terrain is None else traverse_drawings(rover, trace, terrain)
        drawings = {folder / f"{name}.png": drawing for name, drawing in made.items()}
    for path in drawings:
        path.unlink(missing_ok=True)  # an older picture must not pass for a new one
    say("3-D pictures", 0.3)
    notes = draw(drawings)
    if not has_meshes:
        notes.append("the model has no visual meshes, so there is no 3-D picture")
    say("done", 1.0)
    return [*paths, *(path for path in drawings if path.is_file())], notes
