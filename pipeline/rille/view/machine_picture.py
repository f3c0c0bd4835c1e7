"""The machine from the front right, its parts in colours, the ones that matter with labels."""

import html
import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover
from rille.view.cad_pictures import project, spread
from rille.view.drawing import Camera, Drawing, Item, draw
from rille.view.page import picture_source
from rille.view.pose import placed_meshes

Array = NDArray[np.float64]

SIZE = (1500, 900)
VIEW_ANGLE = 30.0
BACKGROUND = ("#e9edf1", "#ffffff")
REST = "#c9cdd2"  # parts that nothing is said of
FAINT = 0.45  # opacity of these


def machine_picture(
    rover: Rover, colors: Mapping[str, str], labels: Sequence[tuple[str, str, str]], *, alt: str, legend: str, zoom: float = 1.0
) -> tuple[str, list[str]]:
    """HTML of the picture, and notes about what could not be drawn.

    Parameters
    ----------
    colors : of bodies; the others are grey. labels : body, name, and what is said of it, each beside its part. alt : for who does not see
    it. legend : HTML below it. zoom : of the labels, for a picture that is shown small.
    """
    items: list[Item] = []
    clouds: dict[str, list[Array]] = {}
    for body, mesh, vertices in placed_meshes(rover):
        opacity = 1.0 if body in colors else FAINT
        items.append(Item(vertices=vertices, triangles=mesh.triangles, color=colors.get(body, REST), opacity=opacity))
        clouds.setdefault(body, []).append(vertices)
    if not items:
        return "", ["the model has no visual meshes, so there is no picture of it"]
    camera = _camera(np.concatenate([item.vertices for item in items]))
    eye, focus = np.array(camera.position), np.array(camera.focus)
    sun = (eye - focus) / np.linalg.norm(eye - focus) + np.array([0.2, 0.1, 0.7])
    with tempfile.TemporaryDirectory(prefix="rille-view-") as folder:
        path = Path(folder) / "rover.png"
        x, y, z = map(float, sun / np.linalg.norm(sun))
        drawing = Drawing(items=items, camera=camera, size=SIZE, background=BACKGROUND, sun=(x, y, z))
        notes = draw({path: drawing})
        if notes:
            return "", notes
        source = picture_source(path)
    shown = [label for label in labels if label[0] in clouds]
    middles = [(np.vstack(clouds[body]).min(axis=0) + np.vstack(clouds[body]).max(axis=0)) / 2 for body, _, _ in shown]
    drawn = _labels([label[1:] for label in shown], project(np.array(middles).reshape(-1, 3), camera, SIZE), zoom)
    return (
        f'<figure class="picture" id="machine-picture"><div class="overlaid"><img alt="{html.escape(alt)}" src="{source}">{drawn}</div>'
        f"{legend}</figure>",
        [],
    )


def _camera(cloud: Array) -> Camera:
    """Three-quarter view from the front right that sees all, with room for labels at the sides."""
    looks = np.array([0.62, -0.72, 0.42]) / np.linalg.norm([0.62, -0.72, 0.42])
    right = np.cross([0.0, 0.0, 1.0], looks)
    right /= np.linalg.norm(right)
    frame = np.array([right, np.cross(looks, right), looks])
    seen = cloud @ frame.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    arms = seen - middle
    slopes = math.tan(math.radians(VIEW_ANGLE) / 2) * np.array([0.58 * SIZE[0] / SIZE[1], 0.88])
    distance = float((arms[:, 2] + (np.abs(arms[:, :2]) / slopes).max(axis=1)).max())
    focus = middle @ frame
    place = focus + distance * looks
    return Camera(position=tuple(map(float, place)), focus=tuple(map(float, focus)), view_angle=VIEW_ANGLE)  # type: ignore[arg-type]


def _labels(texts: Sequence[tuple[str, str]], points: Array, zoom: float) -> str:
    """SVG over the picture: names and values left and right, with lines to their parts."""
    drawn = []
    for side in (False, True):
        chosen = [k for k in range(len(texts)) if (points[k, 0] > SIZE[0] / 2) == side]
        heights = spread([float(points[k, 1]) for k in chosen], 84 * zoom, 50, SIZE[1] - 60)
        x, anchor, step = (SIZE[0] - 24, "end", -14) if side else (24, "start", 14)
        for k, y in zip(chosen, heights, strict=True):
            name, value = texts[k]
            wide = 12.4 * zoom * max(len(name), len(value))
            inner = x - wide + step if side else x + wide + step
            drawn.append(
                f'<polyline points="{inner:.0f},{y - 8 * zoom:.0f} {points[k, 0]:.0f},{points[k, 1]:.0f}"/>'
                f'<circle cx="{points[k, 0]:.0f}" cy="{points[k, 1]:.0f}" r="5"/>'
                f'<text text-anchor="{anchor}"><tspan x="{x}" y="{y:.0f}">{html.escape(name)}</tspan>'
                f'<tspan x="{x}" dy="{26 * zoom:.0f}">{html.escape(value)}</tspan></text>'
            )
    return f'<svg viewBox="0 0 {SIZE[0]} {SIZE[1]}" style="font-size:{21 * zoom:.0f}px" aria-hidden="true">{"".join(drawn)}</svg>'
