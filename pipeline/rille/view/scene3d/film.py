"""A run as a film or as still pictures, drawn off-screen by a child process."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Rover, Trace
from rille.view.scene3d.animation import continuous
from rille.view.scene3d.machine import axle
from rille.view.scene3d.scene import GRAVITY_UNKNOWN, View
from rille.view.scene3d.tracks import WHEEL

Array = NDArray[np.float64]
Camera = Literal["follow", "chase", "top"] | tuple[float, float, float]
FILMS = (".mp4", ".gif")
MOST_FRAMES = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Take:
    """How a film is taken. start, stop [s] of the run; speed: of the run per film; fps; size (width, height) in pixels; camera: how it
    moves, or the place in W [m] from which it looks at the machine."""

    start: float
    stop: float
    speed: float = 1.0
    fps: float = 25.0
    size: tuple[int, int] = (1280, 720)
    camera: Camera = "follow"

    @property
    def count(self) -> int:
        """Number of frames."""
        return max(1, int(np.floor((self.stop - self.start) / self.speed * self.fps + 1e-9)) + 1)

    def times(self) -> Array:
        """Simulated time of every frame [s]."""
        return np.asarray(self.start + np.arange(self.count) * self.speed / self.fps, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ghost:
    """Another run, or a recording as one, that is shown transparent; its name."""

    trace: Trace
    label: str


def shoot(
    target: Path,
    scene: bytes,
    rover: Rover,
    trace: Trace,
    view: View,
    take: Take,
    *,
    stills: Sequence[float] = (),
    title: str = "",
    gravity: float = GRAVITY_UNKNOWN,
    ghost: Ghost | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> list[Path]:
    """Draw a film (``.mp4``, ``.gif``) or, at the times ``stills`` [s], pictures (``.png``); returns the files.

    gravity [m/s^2] scales the arrows of forces. An interrupted film leaves nothing behind.

    Raises
    ------
    InputRefused : if the times are not of the run, frames are too many, or drawing fails (3-D needs EGL).
    """
    first, last = float(trace.time[0]), float(trace.time[-1])
    for time in stills or (take.start, take.stop):
        if not first - 1e-9 <= time <= last + 1e-6:
            raise InputRefused(f"time is {time:g} s; run {trace.run_id} goes from {first:g} to {last:g} s")
    if not stills and take.count > MOST_FRAMES:
        raise InputRefused(f"the film would have {take.count} frames; it must have at most {MOST_FRAMES}: raise --speed or lower --fps")
    times = np.unique(np.array(stills, dtype=float)) if stills else take.times()
    targets = [target] if not stills else _numbered(target, times)
    with tempfile.TemporaryDirectory(prefix="rille-film-", dir=target.parent, ignore_cleanup_errors=True) as folder:
        job = Path(folder) / "job.npz"
        parts = [Path(folder) / f"{number}{target.suffix.lower()}" for number in range(len(targets))]
        sheet = {
            **{"take": asdict(take), "stills": bool(stills), "targets": [str(part) for part in parts], "title": title},
            **{"root": _root(rover), "origin": view.origin, "ghost": "" if ghost is None else ghost.label},
            **{"bodies": [body.name for body in rover.bodies], "wheels": _wheels(rover)},
            "share": gravity * sum(body.properties.mass for body in rover.bodies) / max(1, len(rover.wheels)),
        }
        arrays: dict[str, Any] = {
            "scene": np.frombuffer(scene, np.uint8),
            "sheet": np.frombuffer(json.dumps(sheet).encode(), np.uint8),
            **_motion(trace, rover, view, times),
        }
        if ghost is not None:
            poses = _poses(ghost.trace, rover, view, times)
            arrays |= {"ghost_positions": poses[0], "ghost_rotations": poses[1]}
        np.savez(job, **arrays)
        _draw(job, Path(folder) / "said", progress)
        for part, end in zip(parts, targets, strict=True):
            part.replace(end)
    return targets


def _root(rover: Rover) -> int:
    carried = {joint.child for joint in rover.joints}
    return next((k for k, body in enumerate(rover.bodies) if body.name not in carried), 0)


def _wheels(rover: Rover) -> list[dict[str, Any]]:
    names = [body.name for body in rover.bodies]
    children = {joint.name: joint.child for joint in rover.joints}
    return [
        {"radius": wheel.radius, "width": wheel.width, "axle": axle(rover, wheel), "body": names.index(children[wheel.joint])}
        for wheel in rover.wheels
    ]


def _poses(trace: Trace, rover: Rover, view: View, times: Array) -> tuple[Array, Array]:
    """Positions less origin (bodies, n, 3) [m], NaN before the first and after the last stored time, and quaternions (bodies, n, 4)."""
    bodies = {body.name: body for body in trace.bodies}
    positions, rotations = [], []

    def column(values: Array) -> Array:
        return np.interp(times, trace.time, values)

    outside = (times < trace.time[0] - 1e-9) | (times > trace.time[-1] + 1e-6)
    for body in rover.bodies:
        found = bodies[body.name]
        turned = continuous(found.rotation)
        place = np.column_stack([column(found.position[:, k] - view.origin[k]) for k in range(3)])
        mixed = np.column_stack([column(turned[:, k]) for k in range(4)])
        place[outside] = np.nan
        positions.append(place)
        rotations.append(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))
    return np.array(positions), np.array(rotations)


def _motion(trace: Trace, rover: Rover, view: View, times: Array) -> dict[str, Array]:
    """Poses at the frames; wheels and the root's way at all stored times, whose ruts and path remain."""
    origin = np.array(view.origin)
    wheels = {wheel.name: wheel for wheel in trace.wheels}
    found = [wheels[wheel.name] for wheel in rover.wheels]
    tracks = [np.column_stack([w.center - origin, w.ground_height - origin[2], *(getattr(w, f) for f in WHEEL)]) for w in found]
    positions, rotations = _poses(trace, rover, view, times)
    root = next(body for body in trace.bodies if body.name == rover.bodies[_root(rover)].name)
    return {
        **{"times": times, "stored": trace.time, "positions": positions, "rotations": rotations},
        **{"route": root.position - origin, "tracks": np.array(tracks).reshape(len(tracks), len(trace.time), 4 + len(WHEEL))},
    }


def _draw(job: Path, words: Path, progress: Callable[[float], None]) -> None:
    """Let the child draw; what it says on stderr goes into a file, so that it never waits for a reader."""
    environment = os.environ | {"VTK_DEFAULT_OPENGL_WINDOW": os.environ.get("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")}
    command = [sys.executable, "-m", "rille.view.scene3d.film_process", str(job)]
    with words.open("w") as said:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, text=True, env=environment)
        assert process.stdout is not None
        try:
            for line in process.stdout:
                progress(float(line))
            code = process.wait()
        except BaseException:
            process.kill()
            process.wait()
            raise
    if code != 0:
        lines = words.read_text(errors="replace").strip().splitlines()
        last = lines[-1] if lines else f"it ended with {code}"
        raise InputRefused(f"the film could not be drawn: {last}; 3-D pictures need EGL (libegl1, libgl1-mesa-dri)")


def _numbered(target: Path, stills: Array) -> list[Path]:
    if len(stills) == 1:
        return [target]
    return [target.with_name(f"{target.stem}-{time:.12g}s{target.suffix}") for time in stills]
