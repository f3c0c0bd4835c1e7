"""A list of coloured meshes and a camera, drawn by VTK in a process of its own.

VTK renders through EGL and segfaults where none works. In a child process that is a sentence, not a crash.
"""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """A mesh to draw: vertices (n, 3), triangles (m, 3); ``color`` or ``rgb`` (n, 3) uint8 or ``values`` (n,) with the bar's title."""

    vertices: Array
    triangles: Array
    color: str = "#ffffff"
    opacity: float = 1.0
    lit: bool = True
    rgb: Array | None = None
    values: Array | None = None
    title: str = ""
    limits: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """position, focus, up in W [m]; view_angle: vertical opening [deg]."""

    position: tuple[float, float, float]
    focus: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    view_angle: float = 40.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """One picture."""

    items: list[Item]
    camera: Camera
    size: tuple[int, int] = (1600, 1000)
    background: tuple[str, str] = ("#000000", "#0b0d12")
    sun: tuple[float, float, float] = (1.0, 0.0, 1.0)
    labels: list[tuple[tuple[float, float, float], str]] = field(default_factory=list)


def draw(pictures: dict[Path, Drawing]) -> list[str]:
    """Draw the pictures; return notes about what could not be drawn (empty if all were)."""
    if not pictures:
        return []
    nowhere = sorted({str(path.parent) for path in pictures if not path.parent.is_dir()})
    if nowhere:
        return [f"3-D pictures could not be written: the folder '{nowhere[0]}' does not exist; create it first"]
    with tempfile.TemporaryDirectory(prefix="rille-view-") as folder:
        job = Path(folder) / "job.npz"
        arrays: dict[str, Array] = {}
        sheets = []
        for path, drawing in pictures.items():
            items = []
            for item in drawing.items:
                key = f"a{len(arrays)}"
                arrays[key + "v"], arrays[key + "t"] = item.vertices, item.triangles
                if item.rgb is not None:
                    arrays[key + "c"] = item.rgb
                if item.values is not None:
                    arrays[key + "s"] = item.values
                items.append(
                    {"key": key, "color": item.color, "opacity": item.opacity, "lit": item.lit, "title": item.title, "limits": item.limits}
                )
            camera = drawing.camera
            sheets.append(
                {
                    "path": str(path),
                    "items": items,
                    "camera": [camera.position, camera.focus, camera.up, camera.view_angle],
                    "size": drawing.size,
                    "background": drawing.background,
                    "sun": drawing.sun,
                    "labels": drawing.labels,
                }
            )
        arrays["job"] = np.frombuffer(json.dumps(sheets, default=float).encode(), np.uint8)
        np.savez(job, **arrays)  # type: ignore[arg-type]
        command = [sys.executable, "-m", "rille.view.draw_process", str(job)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        except subprocess.TimeoutExpired:
            return ["3-D pictures were given up after 300 s: rendering hangs on this machine"]
    missing = [path for path in pictures if not path.is_file()]
    if done.returncode == 0 and not missing:
        return []
    last = (done.stderr.strip().splitlines() or ["no word"])[-1]
    how = f"signal {-done.returncode}" if done.returncode < 0 else f"code {done.returncode}"
    return [f"3-D pictures could not be drawn ({how}: {last}); is a working EGL installed (libegl1, libgl1, libgl1-mesa-dri)?"]
