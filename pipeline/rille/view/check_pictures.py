"""The worst pose of a mechanism: which bodies run into each other, and where."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import Mesh, Rover
from rille.model.kinematics import forward_kinematics
from rille.view.drawing import Camera, Drawing, Item, draw
from rille.view.pose import placed_meshes

Array = NDArray[np.float64]

FIRST, SECOND, OVERLAP, REST = "#2f7de1", "#f0a202", "#d7141a", "#7d848c"
SIZE = (1000, 900)
VIEW_ANGLE = 38.0


def draw_worst_pose(
    rover: Rover,
    positions: Mapping[str, float],
    body_a: str,
    body_b: str,
    overlap: Mesh,
    path: Path,
    *,
    title: str,
    subtitle: str = "",
) -> list[str]:
    """Draw a pose whole and close up: two bodies in strong colours, the region that they share in red, everything else pale.

    Parameters
    ----------
    positions : of the joints [rad or m]. overlap : the shared region in M, in this pose. path : of the PNG.
    title, subtitle : what is written above.

    Returns
    -------
    Notes about what could not be drawn, empty if all was.
    """
    items = _items(rover, positions, body_a, body_b)
    if not items:
        return ["the model has no visual meshes, so there is no picture of the worst pose"]
    region = overlap.vertices.astype(float)
    middle = region.mean(axis=0)
    # a hair larger than it is, so that it wins against the faces of the bodies that bound it
    shared = Item(vertices=middle + 1.01 * (region - middle), triangles=overlap.triangles, color=OVERLAP, lit=False)
    middle = (shared.vertices.min(axis=0) + shared.vertices.max(axis=0)) / 2
    extent = float(np.linalg.norm(np.ptp(shared.vertices, axis=0)))
    cloud = np.concatenate([item.vertices for item in items])
    size = float(np.linalg.norm(np.ptp(cloud, axis=0)))
    toward = _direction(cloud, middle, max(extent, 0.02 * size))
    whole = _fitting(cloud, toward)
    close = max(2.2 * extent, 0.16 * size)
    near = Camera(position=_triple(middle + 1.5 * close * toward), focus=_triple(middle), view_angle=VIEW_ANGLE)
    sun = toward + np.array([0.3, 0.2, 0.9])
    path.unlink(missing_ok=True)  # an older picture must not pass for a new one
    with tempfile.TemporaryDirectory(prefix="rille-view-") as folder:
        files = [Path(folder) / "whole.png", Path(folder) / "close.png"]
        notes = draw(
            {
                file: Drawing(
                    items=[shared, *items],
                    camera=camera,
                    size=SIZE,
                    background=("#eef1f5", "#ffffff"),
                    sun=_triple(sun / np.linalg.norm(sun)),
                )
                for file, camera in zip(files, (whole, near), strict=True)
            }
        )
        if not notes:
            _compose(files, (whole, near), middle, (body_a, body_b), path, title, subtitle)
    return notes


def _items(rover: Rover, positions: Mapping[str, float], body_a: str, body_b: str) -> list[Item]:
    """Meshes of all bodies in the pose; p_pose = X_MB (p_zero - frame)."""
    frames = {body.name: np.array(body.frame) for body in rover.bodies}
    poses = forward_kinematics(rover, positions)
    looks = {body_a: (FIRST, 0.38), body_b: (SECOND, 0.38)}
    items = []
    for body, mesh, placed in placed_meshes(rover):
        pose = poses[body]
        color, opacity = looks.get(body, (REST, 0.13))
        vertices = (placed - frames[body]) @ pose[:3, :3].T + pose[:3, 3]
        items.append(Item(vertices=vertices, triangles=mesh.triangles, color=color, opacity=opacity))
    return items


def _direction(cloud: Array, middle: Array, radius: float) -> Array:
    """From where the overlap is hidden least: few vertices in the tube between it and the camera. Slightly from above."""
    best, least = np.array([0.6, -0.7, 0.4]), np.inf
    arms = cloud - middle
    for height in (0.25, 0.5, 0.8, -0.3):
        for turn in np.deg2rad(np.arange(-60, 300, 30)):
            toward = np.array([np.cos(turn), np.sin(turn), height])
            toward /= np.linalg.norm(toward)
            along = arms @ toward
            across = np.linalg.norm(arms - along[:, None] * toward, axis=1)
            hidden = float(((along > radius / 2) & (across < radius)).mean()) + (0.02 if height < 0 else 0.0)
            if hidden < least - 1e-3:
                best, least = toward, hidden
    return best / np.linalg.norm(best)


def _fitting(cloud: Array, toward: Array) -> Camera:
    """The camera, looking from ``toward``, that sees all points with a margin of a tenth."""
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    frame = np.array([right, np.cross(toward, right), toward])
    seen = cloud @ frame.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    arms = seen - middle
    slopes = np.tan(np.deg2rad(VIEW_ANGLE) / 2) * np.array([SIZE[0] / SIZE[1], 1.0]) / 1.1
    distance = float((arms[:, 2] + (np.abs(arms[:, :2]) / slopes).max(axis=1)).max())
    focus = middle @ frame
    return Camera(position=_triple(focus + distance * toward), focus=_triple(focus), view_angle=VIEW_ANGLE)


def _compose(
    files: list[Path], cameras: tuple[Camera, Camera], point: Array, bodies: tuple[str, str], path: Path, title: str, subtitle: str
) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.patches import Patch

    figure, axes = pyplot.subplots(1, 2, figsize=(16, 8.2), layout="constrained")
    for axis, file, camera, name in zip(axes, files, cameras, ("whole", "close up"), strict=True):
        axis.imshow(pyplot.imread(file))
        x, y = _project(point, camera)
        axis.annotate(
            "overlap",
            (x, y),
            xytext=(0.5 * SIZE[0] + (0.28 * SIZE[0] if x <= 0.5 * SIZE[0] else -0.28 * SIZE[0]), 0.08 * SIZE[1]),
            color=OVERLAP,
            fontsize=14,
            ha="center",
            bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none"},
            arrowprops={"arrowstyle": "->", "color": OVERLAP, "lw": 1.8, "shrinkB": 8},
        )
        axis.set_title(name, fontsize=13, color="#444a52")
        axis.set_axis_off()
    shown = zip((FIRST, SECOND, OVERLAP), (*bodies, "overlap that is not there at the zero pose"), strict=True)
    figure.legend(handles=[Patch(color=c, label=n) for c, n in shown], loc="outside lower center", ncols=3, fontsize=13, frameon=False)
    figure.suptitle(title + (f"\n{subtitle}" if subtitle else ""), fontsize=15)
    try:
        figure.savefig(path, dpi=100)
    finally:
        pyplot.close(figure)


def _project(point: Array, camera: Camera) -> tuple[float, float]:
    """Pixel of a point: pinhole at ``position`` looking at ``focus``."""
    forward = np.array(camera.focus) - np.array(camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    arm = point - np.array(camera.position)
    scale = SIZE[1] / 2 / np.tan(np.deg2rad(camera.view_angle) / 2) / (arm @ forward)
    return float(SIZE[0] / 2 + scale * (arm @ right)), float(SIZE[1] / 2 - scale * (arm @ np.cross(right, forward)))


def _triple(v: Array) -> tuple[float, float, float]:
    x, y, z = map(float, v)
    return x, y, z
