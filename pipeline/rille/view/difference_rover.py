"""The machine with its parts lit by how much the model misses there."""

import html
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover
from rille.model.difference import TargetDifference
from rille.view.cad_pictures import project, spread
from rille.view.drawing import Camera, Drawing, Item, draw
from rille.view.page import number, picture_source
from rille.view.pose import placed_meshes

Array = NDArray[np.float64]

SIZE = (1500, 900)
VIEW_ANGLE = 30.0
BACKGROUND = ("#e9edf1", "#ffffff")
REST = "#c9cdd2"  # measured nowhere
LEVELS = (0.0, 0.3, 0.65, 1.0)  # of the colours, on a logarithmic scale from the noise to the worst
SHADES = ("#d7e3ea", "#f3d27a", "#e07b39", "#a11d1d")
NAMED = 6  # targets with a label


def body_scores(rover: Rover, targets: Sequence[TargetDifference]) -> dict[str, TargetDifference]:
    """The worst target of every body: a joint's, wheel's or drive's is the body that it moves."""
    moved = {joint.name: joint.child for joint in rover.joints}
    bodies = {body.name: body.name for body in rover.bodies}
    of_wheel = {wheel.name: moved[wheel.joint] for wheel in rover.wheels}
    of_drive = {drive.name: moved[drive.joint] for drive in rover.drives}
    places = {"joint": moved, "wheel": of_wheel, "drive": of_drive, "part": bodies}
    found: dict[str, TargetDifference] = {}
    for target in targets:
        body = places[target.kind].get(target.name) or moved.get(target.name) or bodies.get(target.name)
        if body is not None and math.isfinite(target.normalised):
            worse = found.get(body)
            if worse is None or target.normalised > worse.normalised:
                found[body] = target
    return found


def heat(normalised: float, highest: float) -> str:
    """Colour of an RMS over noise: pale up to the noise, red at ``highest``, logarithmic between."""
    part = math.log(max(normalised, 1.0)) / math.log(max(highest, 3.0))
    channels = [np.interp(part, LEVELS, [int(shade[k : k + 2], 16) for shade in SHADES]) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(float(channel)):02x}" for channel in channels)


def rover_picture(rover: Rover, targets: Sequence[TargetDifference]) -> tuple[str, list[str]]:
    """HTML of the picture with its scale and labels of the worst targets, and notes about what could not be drawn."""
    scores = body_scores(rover, targets)
    if not scores:
        return "", []
    highest = max(3.0, max(target.normalised for target in scores.values()))
    items, clouds = [], {}
    for body, mesh, vertices in placed_meshes(rover):
        lit = body in scores
        color = heat(scores[body].normalised, highest) if lit else REST
        items.append(Item(vertices=vertices, triangles=mesh.triangles, color=color, opacity=1.0 if lit else 0.45))
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
    named = sorted((body for body in scores if body in clouds and scores[body].differs), key=lambda body: -scores[body].normalised)[:NAMED]
    middles = [(np.vstack(clouds[body]).min(axis=0) + np.vstack(clouds[body]).max(axis=0)) / 2 for body in named]
    labels = _labels([scores[body] for body in named], project(np.array(middles).reshape(-1, 3), camera, SIZE))
    alt = "The machine; its parts are coloured by RMS over noise. " + ", ".join(
        f"{scores[body].name}: {number(scores[body].normalised)}" for body in named
    )
    return (
        f'<figure class="picture" id="machine-picture"><div class="overlaid"><img alt="{html.escape(alt)}" src="{source}">{labels}</div>'
        f"{_scale(highest)}</figure>",
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


def _labels(targets: Sequence[TargetDifference], points: Array) -> str:
    """SVG over the picture: names left and right with lines to their parts."""
    drawn = []
    for side in (False, True):
        chosen = [k for k in range(len(targets)) if (points[k, 0] > SIZE[0] / 2) == side]
        heights = spread([float(points[k, 1]) for k in chosen], 84, 50, SIZE[1] - 60)
        x, anchor, step = (SIZE[0] - 24, "end", -14) if side else (24, "start", 14)
        for k, y in zip(chosen, heights, strict=True):
            name, value = targets[k].name, f"{number(targets[k].normalised)} \u00d7 noise"
            wide = 12.4 * max(len(name), len(value))
            inner = x - wide + step if side else x + wide + step
            drawn.append(
                f'<polyline points="{inner:.0f},{y - 8:.0f} {points[k, 0]:.0f},{points[k, 1]:.0f}"/>'
                f'<circle cx="{points[k, 0]:.0f}" cy="{points[k, 1]:.0f}" r="5"/>'
                f'<text text-anchor="{anchor}"><tspan x="{x}" y="{y:.0f}">{html.escape(name)}</tspan>'
                f'<tspan x="{x}" dy="26">{value}</tspan></text>'
            )
    return f'<svg viewBox="0 0 {SIZE[0]} {SIZE[1]}" aria-hidden="true">{"".join(drawn)}</svg>'


def _scale(highest: float) -> str:
    """The colours in words."""
    stops = ", ".join(f"{shade} {100 * level:.0f}%" for level, shade in zip(LEVELS, SHADES, strict=True))
    ticks = [tick for tick in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000) if tick <= highest]
    places = "".join(f'<span style="left:{100 * math.log(tick) / math.log(highest):.1f}%">{tick}</span>' for tick in ticks)
    return (
        f'<div class="scale" aria-hidden="true"><div><div class="ramp" style="background:linear-gradient(90deg, {stops})"></div>'
        f'<div class="ticks">{places}</div></div><span>RMS of the residual over noise</span>'
        f'<span><i class="swatch" style="background:{REST}"></i>not measured</span></div>'
    )
