"""``rille replay``: a run as a web page that moves, as a film, as an animation for other programs."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rille.cli.places import require_place
from rille.cli.talk import Json, print_json, progress, say

PAGE, ANIMATION, STILL, FILMS = ".html", ".glb", ".png", (".mp4", ".gif")
CAMERAS = ("follow", "chase", "top")


def replay(
    database: Annotated[Path, typer.Argument(help="Database with the run.")],
    run: Annotated[int | None, typer.Option(help="Number of the run; default: the latest.")] = None,
    against: Annotated[str | None, typer.Option(help="Another run, by its number, or a recording, by its name: shown as a ghost.")] = None,
    side: Annotated[bool, typer.Option("--side", help="With --against, on pages: two pictures side by side instead of a ghost.")] = False,
    out: Annotated[
        list[Path] | None,
        typer.Option("-o", "--out", help="File to write, repeatable: .html, .mp4, .gif, .glb or .png; default: DATABASE-run-N.html."),
    ] = None,
    at: Annotated[list[float] | None, typer.Option(help="Time of a still picture [s], repeatable; default: the end.")] = None,
    start: Annotated[float | None, typer.Option("--from", help="Begin of a film [s].")] = None,
    stop: Annotated[float | None, typer.Option("--to", help="End of a film [s].")] = None,
    speed: Annotated[float, typer.Option(min=1e-3, max=1e4, help="Simulated time per film time.")] = 1.0,
    fps: Annotated[float, typer.Option(min=1, max=120, help="Frames per second of a film.")] = 25.0,
    size: Annotated[str, typer.Option(help="Width x height of films and stills, in pixels.")] = "1280x720",
    camera: Annotated[
        str,
        typer.Option(help="Of films and stills: follow (fixed direction), chase (from behind), top, or a place X,Y,Z [m] in the world."),
    ] = "follow",
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    as_json: Json = False,
) -> int:
    """Watch a run in the browser: rover, ground with ruts, forces, slip, path, plots; play, scrub, compare. One file, works offline.
    The same as a film, as still pictures, and as an animated glTF for other programs.

    Example: rille replay rover.db --open

    Example: rille replay rover.db --run 3 --against 2 --side

    Example: rille replay rover.db --against recording_1 -o page.html -o film.mp4 -o rover.glb --speed 4 --camera chase

    Example: rille replay rover.db -o still.png --at 10 --at 20

    Example: rille replay rover.db -o short.gif --from 10 --to 14 --fps 12 --size 640x360 --camera 3,-4,2
    """
    from rille.model import InputRefused

    if side and against is None:
        raise InputRefused("--side needs --against: name the run or the recording that is to stand beside")
    targets = out or [database.with_name(f"{database.stem}-run-{_latest(database, run)}{PAGE}")]
    for target in targets:
        if target.suffix.lower() not in (PAGE, ANIMATION, STILL, *FILMS):
            raise InputRefused(f"'{target}' ends in none of {PAGE} {ANIMATION} {STILL} {' '.join(FILMS)}; choose one of these")
    require_place(*targets)
    eye = _camera(camera)
    pixels = _size(size)
    show = _Show(database, run, against)
    written: list[Path] = []
    with progress("replay") as update:
        for target in targets:
            suffix = target.suffix.lower()

            def tell(share: float, name: str = target.name) -> None:
                update(name, share)

            if suffix == PAGE:
                _write(target, show.page(side).encode())
                written.append(target)
            elif suffix == ANIMATION:
                _write(target, show.animation())
                if show.other is not None:
                    show.notes.append(f"'{target.name}' holds run {show.trace.run_id} alone: {show.other[1]} is in pages, films and stills")
                written.append(target)
            else:
                if side and show.other is not None:
                    show.notes.append(f"'{target.name}' shows {show.other[1]} as a ghost: side by side is for pages ({PAGE})")
                written += show.shoot(target, at or [], (start, stop), speed, fps, pixels, eye, tell)
    for note in show.notes:
        say(note)
    if as_json:
        print_json({"files": [str(path) for path in written], "run_id": show.trace.run_id, "notes": show.notes})
    else:
        for path in written:
            print(path)
    if open_page:
        import webbrowser

        webbrowser.open(written[0].resolve().as_uri())
    return 0


class _Show:
    """A run, what it is compared with, and the piece of the world that they passed."""

    def __init__(self, database: Path, run: int | None, against: str | None) -> None:
        import numpy as np

        from rille import store
        from rille.model import InputRefused
        from rille.view import scene3d

        self.notes: list[str] = []
        self.rover = store.read_rover(database)
        self.trace = store.read_trace(database, run)
        if len(self.trace.time) == 0:
            raise InputRefused(f"run {self.trace.run_id} of '{database}' holds no states; run the scenario again")
        self.scenario = scenario = store.read_scenario(database, self.trace.scenario)
        self.terrain = None if scenario.terrain is None else store.read_terrain(database, scenario.terrain)
        self.other = None if against is None else self._other(database, against)
        shown = [self.trace] if self.other is None else [self.trace, self.other[0]]
        self.view = scene3d.view_of(self.terrain, np.concatenate([body.position for trace in shown for body in trace.bodies]))
        self.title = f"{database.stem}: {self.trace.scenario}, run {self.trace.run_id}"
        self.layout = scene3d.layout(
            self.rover,
            self.view,
            title=self.title,
            gravity=scene3d.gravity_of(scenario),
        )

    def _other(self, database: Path, against: str) -> tuple[Any, str, list[Any]]:
        """Another run, or a recording as one: its trace, its label, channels for the plots."""
        from rille import store
        from rille.model import InputRefused, nearest_names
        from rille.view import scene3d

        names = store.recording_names(database)
        if against in names:
            recording = store.read_recording(database, against)
            if recording.kind != "time":
                raise InputRefused(f"recording '{against}' is of a bench: points, and nothing that moves; `rille compare` shows it")
            trace, notes = scene3d.recorded_trace(recording, self.rover, self.trace)
            self.notes += notes
            return trace, f"recording {against}", scene3d.extras(recording)
        if against.isdigit():
            trace = store.read_trace(database, int(against))
            if len(trace.time) == 0:
                raise InputRefused(f"run {against} of '{database}' holds no states; run the scenario again")
            self._tell_world(store.read_scenario(database, trace.scenario), f"run {against}")
            return trace, f"run {against}", []
        runs = [str(row.id) for row in store.list_runs(database)]
        raise InputRefused(f"'{database}' has neither a run nor a recording '{against}'; {nearest_names(against, [*names, *runs])}")

    def _tell_world(self, other: Any, label: str) -> None:
        """What differs in the world of another run, which is shown in this one's."""
        from rille.view import scene3d

        here, there = (f"terrain '{s.terrain}'" if s.terrain else "no terrain" for s in (self.scenario, other))
        if here != there:
            self.notes.append(f"{label} was on {there}; it is shown on that of run {self.trace.run_id}, {here}")
        if other.gravity != self.scenario.gravity:
            own, its = (scene3d.gravity_of(s) for s in (self.scenario, other))
            ways = "" if abs(own - its) > 1e-9 else ", in another direction"
            self.notes.append(f"{label} was under a gravity of {its:g} m/s^2{ways}; run {self.trace.run_id} under {own:g} m/s^2")

    def page(self, side: bool) -> str:
        """The page as HTML."""
        import numpy as np

        from rille.view import scene3d

        origin = np.array(self.view.origin)
        shown: list[tuple[Any, str, list[Any]]] = [(self.trace, f"run {self.trace.run_id}", [])]
        shown += [] if self.other is None else [self.other]
        runs = [
            scene3d.Shown(label=label, time=trace.time, states=scene3d.states(trace, self.rover, origin), events=trace.events, extra=extra)
            for trace, label, extra in shown
        ]
        mode = "single" if len(runs) == 1 else "side" if side else "ghost"
        scene = scene3d.scene_glb(self.rover, self.terrain, self.view)
        return scene3d.page(scene3d.source(self.layout, scene, runs, mode), self.title)

    def animation(self) -> bytes:
        """The run as an animated glTF."""
        from rille.view import scene3d

        return scene3d.animated_glb(self.rover, self.terrain, self.view, self.trace)

    def shoot(
        self, target: Path, at: list[float], span: tuple[Any, Any], speed: float, fps: float, size: Any, camera: Any, tell: Any
    ) -> list[Path]:
        """A film or stills."""
        from rille.model import InputRefused
        from rille.view import scene3d

        first, last = float(self.trace.time[0]), float(self.trace.time[-1])
        start, stop = (first if span[0] is None else span[0]), (last if span[1] is None else span[1])
        still = target.suffix.lower() == STILL
        if not still and not start < stop:
            raise InputRefused(f"the film begins at {start:g} s and ends at {stop:g} s; --from must come before --to")
        take = scene3d.Take(start=start, stop=stop, speed=speed, fps=fps, size=size, camera=camera)
        stills = (at or [last]) if still else []
        scene = scene3d.scene_glb(self.rover, self.terrain, self.view)
        ghost = None if self.other is None else scene3d.Ghost(trace=self.other[0], label=self.other[1])
        words = {"title": self.title, "gravity": self.layout["gravity"]}
        return scene3d.shoot(target, scene, self.rover, self.trace, self.view, take, stills=stills, ghost=ghost, progress=tell, **words)


def _latest(database: Path, run: int | None) -> int:
    from rille import store

    return max((row.id for row in store.list_runs(database)), default=0) if run is None else run  # that there is none is said later


def _camera(text: str) -> Any:
    """A way to move, or a place in W [m]."""
    from math import isfinite

    from rille.model import InputRefused

    if text in CAMERAS:
        return text
    try:
        place = tuple(float(number) for number in text.split(","))
    except ValueError:
        place = ()
    if len(place) != 3 or not all(map(isfinite, place)):
        raise InputRefused(f"camera is '{text}'; it must be one of {', '.join(CAMERAS)}, or a place such as 3,-4,2")
    return place


def _size(text: str) -> tuple[int, int]:
    from rille.model import InputRefused

    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and 64 <= int(width) <= 7680 and 64 <= int(height) <= 4320):
        raise InputRefused(f"size is '{text}'; it must be WIDTHxHEIGHT from 64x64 to 7680x4320 pixels, such as 1280x720")
    return int(width) // 2 * 2, int(height) // 2 * 2  # as H.264 needs


def _write(target: Path, content: bytes) -> None:
    """All of it, or nothing new."""
    from rille.model import InputRefused

    part = target.with_name(target.name + ".part")
    try:
        part.write_bytes(content)
        part.replace(target)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputRefused(f"'{target}' cannot be written: {error.strerror}") from None
