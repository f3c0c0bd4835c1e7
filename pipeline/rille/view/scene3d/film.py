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
from rille.view.scene3d.scene import View
from rille.view.scene3d.tracks import WHEEL

Array = NDArray[np.float64]
Camera = Literal["follow", "chase", "top"]
FILMS = (".mp4", ".gif")
PATH_LIFT = 0.02  # [m] of the path above the ground


@dataclass(frozen=True, slots=True, kw_only=True)
class Take:
    """How a film is taken. start, stop [s] of the run; speed: of the run per film; fps; size (width, height) in pixels."""

    start: float
    stop: float
    speed: float = 1.0
    fps: float = 25.0
    size: tuple[int, int] = (1280, 720)
    camera: Camera = "follow"

    def times(self) -> Array:
        """Simulated time of every frame [s]."""
        count = max(1, int(np.floor((self.stop - self.start) / self.speed * self.fps + 1e-9)) + 1)
        return np.asarray(self.start + np.arange(count) * self.speed / self.fps, dtype=np.float64)


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
    progress: Callable[[float], None] = lambda share: None,
) -> list[Path]:
    """Draw a film (``.mp4``, ``.gif``) or, at the times ``stills`` [s], pictures (``.png``); returns the files.

    An interrupted film leaves nothing behind.

    Raises
    ------
    InputRefused : if the times are not of the run, or drawing fails (3-D needs EGL).
    """
    times = np.array(stills) if stills else take.times()
    first, last = float(trace.time[0]), float(trace.time[-1])
    for time in (times[0], times[-1]) if not stills else times:
        if not first - 1e-9 <= time <= last + 1e-6:
            raise InputRefused(f"time is {time:g} s; run {trace.run_id} goes from {first:g} to {last:g} s")
    targets = [target] if not stills else _numbered(target, stills)
    with tempfile.TemporaryDirectory(prefix="rille-film-", dir=target.parent) as folder:
        job = Path(folder) / "job.npz"
        parts = [Path(folder) / f"{number}{target.suffix}" for number in range(len(targets))]
        carried = {joint.child for joint in rover.joints}
        root = next((k for k, body in enumerate(rover.bodies) if body.name not in carried), 0)
        sheet = {
            **{"take": asdict(take), "stills": bool(stills), "targets": [str(part) for part in parts], "title": title, "root": root},
            "bodies": [body.name for body in rover.bodies],
            "wheels": [{"name": wheel.name, "radius": wheel.radius, "width": wheel.width} for wheel in rover.wheels],
        }
        arrays: dict[str, Any] = {
            **{"scene": np.frombuffer(scene, np.uint8), "sheet": np.frombuffer(json.dumps(sheet).encode(), np.uint8)},
            **_motion(trace, rover, view, times),
        }
        np.savez(job, **arrays)
        _draw(job, progress)
        for part, end in zip(parts, targets, strict=True):
            part.replace(end)
    return targets


def _motion(trace: Trace, rover: Rover, view: View, times: Array) -> dict[str, Array]:
    """Poses at the frames, and wheels at all stored times, whose ruts and paths remain."""
    origin = np.array(view.origin)
    bodies, wheels = {b.name: b for b in trace.bodies}, {w.name: w for w in trace.wheels}
    positions, rotations = [], []
    for body in rover.bodies:
        found = bodies[body.name]
        turned = continuous(found.rotation)
        positions.append(np.column_stack([np.interp(times, trace.time, found.position[:, k] - origin[k]) for k in range(3)]))
        mixed = np.column_stack([np.interp(times, trace.time, turned[:, k]) for k in range(4)])
        rotations.append(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))
    tracks = [
        np.column_stack(
            [wheels[w.name].center - origin, wheels[w.name].ground_height - origin[2], *(getattr(wheels[w.name], f) for f in WHEEL)]
        )
        for w in rover.wheels
        if w.name in wheels
    ]
    carried = {joint.child for joint in rover.joints}
    root = next((k for k, body in enumerate(rover.bodies) if body.name not in carried), 0)
    path = np.array(positions[root])
    if tracks:  # on the ground below it
        ground = np.nanmean([track[:, 3] for track in tracks], axis=0)
        path[:, 2] = np.interp(times, trace.time, ground) + PATH_LIFT
    return {
        "path": path,
        **{"times": times, "stored": trace.time, "positions": np.array(positions), "rotations": np.array(rotations)},
        "tracks": np.array(tracks).reshape(len(tracks), len(trace.time), 11),
    }


def _draw(job: Path, progress: Callable[[float], None]) -> None:
    environment = os.environ | {"VTK_DEFAULT_OPENGL_WINDOW": os.environ.get("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")}
    command = [sys.executable, "-m", "rille.view.scene3d.film_process", str(job)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        for line in process.stdout:
            progress(float(line))
        said = process.stderr.read()
        code = process.wait()
    except BaseException:
        process.kill()
        process.wait()
        raise
    if code != 0:
        last = said.strip().splitlines()[-1] if said.strip() else f"it ended with {code}"
        raise InputRefused(f"the film could not be drawn: {last}; 3-D pictures need EGL (libegl1, libgl1-mesa-dri)")


def _numbered(target: Path, stills: Sequence[float]) -> list[Path]:
    if len(stills) == 1:
        return [target]
    return [target.with_name(f"{target.stem}-{time:g}s{target.suffix}") for time in stills]
