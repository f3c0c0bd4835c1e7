"""3-D view of ground: with a rover for scale in front, or all of it with a rod.

Heights are not enlarged. Near the rover the ground is drawn with all its heights, far from it with fewer.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from rille.model import InputRefused, Rover, Terrain
from rille.model.grid import bilinear
from rille.view.cad_pictures import project
from rille.view.compose import shadow_items
from rille.view.drawing import Camera, Drawing, Item, draw
from rille.view.ground import Patch, albedo, crop, painted, sunlight
from rille.view.obstacles import obstacle_items
from rille.view.pose import in_model
from rille.view.terrain_pictures.marks import Mark, place_labels
from rille.view.terrain_pictures.paper import Paper
from rille.view.terrain_pictures.raster import nice

Array = NDArray[np.float64]

SIZE = (1600, 1000)
MOST_NAMES = 16
ROD_COLORS = ("#d62828", "#f5f5f5")
LIGHT_INK = "#f4f1ea"
ASIDE = math.radians(25)  # the camera looks so far to the left of where the rover heads


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenery:
    """Ground around a point: ``near`` in full detail, ``far`` all of it; they are blended over the border of ``near``."""

    near: Patch
    far: Patch

    def share(self, x: Array, y: Array) -> Array:
        """Weight of ``near``, 0 on and outside its border."""
        reach = 0.15 * min(np.ptp(self.near.x), np.ptp(self.near.y))
        inner = np.minimum(np.minimum(x - self.near.x[0], self.near.x[-1] - x), np.minimum(y - self.near.y[-1], self.near.y[0] - y))
        return np.clip(inner / reach, 0.0, 1.0)

    def mixed(self, near: Array, far: Array, x: Array, y: Array) -> Array:
        """Values given on both patches, at points; broadcast."""

        def at(patch: Patch, values: Array) -> Array:
            return bilinear(values, (float(patch.x[0]), float(patch.y[0])), patch.posting, x, y, clamp=True)

        share = self.share(x, y)
        return share * at(self.near, near) + (1 - share) * at(self.far, far)

    def height(self, x: Array, y: Array) -> Array:
        """Height [m] at points."""
        return self.mixed(self.near.z, self.far.z, np.asarray(x, float), np.asarray(y, float))


def draw_oblique(
    terrain: Terrain,
    path: Path,
    *,
    marks: Sequence[Mark] = (),
    rover: Rover | None = None,
    at: tuple[float, float] | None = None,
    heading: float | None = None,
) -> list[str]:
    """Draw the view into a PNG.

    Parameters
    ----------
    marks : placed landforms; those that can be seen are named. rover : stands on the plane that fits the ground under its wheels.
    at : where the rover (without one: a rod of 2 m) stands [m], default the middle; with neither, all of the terrain is shown.
    heading : of the rover [rad]; the camera looks 25 deg to its left. By default it looks towards the middle of the placed landforms.

    Returns
    -------
    Notes about what could not be drawn (without EGL).

    Raises
    ------
    InputRefused : if ``at`` lies outside the terrain, or there is no height there.
    """
    path.unlink(missing_ok=True)  # an older picture must not pass for a new one
    low, high = _bounds(terrain)
    if rover is None and at is None:
        drawing, points, caption = _overview(terrain, low, high, marks)
    else:
        place = (low + high) / 2 if at is None else np.array(at, float)
        if np.any(place < low) or np.any(place > high):
            raise InputRefused(
                f"({place[0]:g}, {place[1]:g}) m lies outside the terrain, which spans x {low[0]:g} to {high[0]:g} m and "
                f"y {low[1]:g} to {high[1]:g} m; give another --at"
            )
        drawing, points, caption = _close(terrain, place, low, high, marks, rover, heading)
    notes = draw({path: drawing})
    if path.is_file():
        _write_names(path, drawing.camera, points, f"{terrain.name}: {caption}")
    return notes


def standing(rover: Rover, terrain: Terrain, place: Array, heading: float) -> tuple[Array, Array]:
    """Rotation (3, 3) and position (3,) [m] that put the model frame on the plane that fits the ground under the wheels.

    Least squares z = a + b x + c y over the points where the wheels meet the ground (without wheels: the corners of the model); the
    model is lowered or raised along the plane's normal until its lowest wheel points lie in it.
    """
    if rover.wheels:
        centers = np.array([wheel.center for wheel in rover.wheels])
        radii = np.array([wheel.radius for wheel in rover.wheels])
        feet, floor = centers[:, :2], float((centers[:, 2] - radii).mean())
    else:
        cloud = np.concatenate([item.vertices for item in _machine(rover, np.eye(3), np.zeros(3))])
        (x0, y0, floor), (x1, y1, _) = cloud.min(axis=0), cloud.max(axis=0)
        feet = np.array([[x0, y0], [x0, y1], [x1, y0], [x1, y1]])
    middle = (feet.min(axis=0) + feet.max(axis=0)) / 2
    cosine, sine = math.cos(heading), math.sin(heading)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    spots = (feet - middle) @ turn.T
    patch = crop(terrain, place, reach=float(np.abs(spots).max()) + 1.0)
    ground = patch.height(*(place + spots).T)
    plane = np.linalg.lstsq(np.column_stack([np.ones(len(spots)), spots]), ground, rcond=None)[0]
    up = np.array([-plane[1], -plane[2], 1.0])
    up /= np.linalg.norm(up)
    ahead = np.array([cosine, sine, 0.0])
    ahead -= (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    rotation = np.column_stack([ahead, np.cross(up, ahead), up])
    return rotation, np.array([*place, plane[0]]) - rotation @ np.array([*middle, floor])


def _machine(rover: Rover, rotation: Array, position: Array) -> list[Item]:
    parts = {part.name: part for part in rover.parts}
    return [
        Item(
            vertices=in_model(mesh.vertices.astype(float), instance) @ rotation.T + position,
            triangles=mesh.triangles,
            color=parts[instance.part].color,
        )
        for instance in rover.instances
        if instance.body is not None
        for mesh in parts[instance.part].meshes
        if mesh.purpose == "visual"
    ]


def _bounds(terrain: Terrain) -> tuple[Array, Array]:
    n_rows, n_cols = terrain.heights.shape
    low = np.array([terrain.x_west, terrain.y_north - (n_rows - 1) * terrain.posting_y])
    return low, low + np.array([(n_cols - 1) * terrain.posting_x, (n_rows - 1) * terrain.posting_y])


def _rod(foot: Array, height: float, radius: float) -> list[Item]:
    """A surveyor's rod with five bands."""
    around = np.linspace(0, 2 * np.pi, 17)[:-1]
    ring = radius * np.column_stack([np.cos(around), np.sin(around)])
    k, n = np.arange(16), np.roll(np.arange(16), -1)
    triangles = np.concatenate([np.column_stack([k, n, k + 16]), np.column_stack([n, n + 16, k + 16])])
    bands = []
    for band in range(5):
        ends = [np.column_stack([ring, np.full(16, height * (band + upper) / 5)]) for upper in (0, 1)]
        bands.append(Item(vertices=foot + np.concatenate(ends), triangles=triangles, color=ROD_COLORS[band % 2]))
    return bands


def _ground(terrain: Terrain, scenery: Scenery, x: Array, y: Array, sun: Array) -> Item:
    """The ground on a grid of x ascending and y descending [m], whose distances may differ, with its light baked in."""
    gx, gy = np.meshgrid(x, y)
    z = scenery.height(gx, gy)
    light = scenery.mixed(sunlight(scenery.near, sun), sunlight(scenery.far, sun), gx, gy)
    n_rows, n_cols = z.shape
    corner = (np.arange(n_rows - 1)[:, None] * n_cols + np.arange(n_cols - 1)[None, :]).ravel()[:, None]
    triangles = np.concatenate([corner + [0, n_cols, 1], corner + [1, n_cols, n_cols + 1]])
    vertices = np.column_stack([gx.ravel(), gy.ravel(), z.ravel()])
    return Item(vertices=vertices, triangles=triangles, lit=False, rgb=painted(albedo(terrain, x, y), light))


def graded(low: float, high: float, center: float, finest: float, flat: float, most: int = 1000) -> Array:
    """Coordinates from low to high [m], ``finest`` apart within ``flat`` of the centre, farther apart in proportion to the distance
    beyond; at most ``most``, then all distances grow alike."""
    at = np.linspace(low, high, 20001)
    density = 1 / (finest * np.maximum(1.0, np.abs(at - center) / flat))
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(at))])
    return np.interp(np.linspace(0, count[-1], int(np.clip(count[-1], 2, most))), count, at)


def _close(
    terrain: Terrain, place: Array, low: Array, high: Array, marks: Sequence[Mark], rover: Rover | None, heading: float | None
) -> tuple[Drawing, list[tuple[str, Array]], str]:
    """The rover large in front, the ground behind it up to the horizon."""
    if heading is None:
        goal = np.mean([(m.x, m.y) for m in marks], axis=0) if marks else (low + high) / 2
        angle = math.atan2(goal[1] - place[1], goal[0] - place[0])
    else:
        angle = heading + ASIDE
    view = np.array([math.cos(angle), math.sin(angle)])
    if rover is not None:
        rotation, position = standing(rover, terrain, place, angle - ASIDE)
        figure = _machine(rover, rotation, position)
        if not figure:
            raise InputRefused("the rover has no visual meshes to show; build it with `rille cad build`")
    else:
        foot = np.array([*place, float(crop(terrain, place, 1.0).height(*place[:, None])[0])])
        figure = _rod(foot, 2.0, 0.035)
    cloud = np.concatenate([item.vertices for item in figure])
    size = float(np.linalg.norm(np.ptp(cloud, axis=0)))
    middle = (cloud.min(axis=0) + cloud.max(axis=0)) / 2
    near = crop(terrain, place, reach=18 * size, most=900)
    scenery = Scenery(near=near, far=crop(terrain, (low + high) / 2, reach=float((high - low).max()), most=900))
    left = np.array([-view[1], view[0]])
    sun = np.array([*(-0.45 * view + 0.89 * left), 0.45])
    sun /= np.linalg.norm(sun)
    posting = min(terrain.posting_x, terrain.posting_y)
    x, y = (graded(low[k], high[k], place[k], max(posting / 2, size / 120), 3 * size) for k in (0, 1))
    ground = _ground(terrain, scenery, x, y[::-1], sun)
    rocks = obstacle_items(terrain)
    shadows = shadow_items([*figure, *obstacle_items(terrain, place, 12 * size)], near, sun, lift=0.03)
    eye = place - 2.7 * size * view + 1.0 * size * left
    floor = float(scenery.height(*eye[:, None])[0])
    focus = middle[:2] + 3.0 * size * view + 0.45 * size * left
    camera = Camera(
        position=(float(eye[0]), float(eye[1]), max(middle[2] + 1.45 * size, floor + 0.9 * size)),
        focus=(float(focus[0]), float(focus[1]), float(middle[2] - 0.4 * size)),
        view_angle=44.0,
    )
    points = _visible(marks, scenery, camera)
    length, width, height = (float(v) for v in _own_size(rover)) if rover is not None else (0.0, 0.0, 2.0)
    what = f"the rover is {length:.2f} m long, {width:.2f} m wide, {height:.2f} m high" if rover is not None else "the rod is 2 m high"
    drawing = Drawing(items=[ground, *shadows, *rocks, *figure], camera=camera, size=SIZE, sun=tuple(map(float, sun)))  # type: ignore[arg-type]
    return drawing, points, f"{what}; heights not enlarged"


def _own_size(rover: Rover) -> Array:
    cloud = np.concatenate([item.vertices for item in _machine(rover, np.eye(3), np.zeros(3))])
    return np.ptp(cloud, axis=0)


def _overview(terrain: Terrain, low: Array, high: Array, marks: Sequence[Mark]) -> tuple[Drawing, list[tuple[str, Array]], str]:
    """All of the terrain from the south-west, with a rod in its front corner."""
    span = high - low
    patch = crop(terrain, (low + high) / 2, reach=float(span.max()), most=1000)
    scenery = Scenery(near=patch, far=patch)
    sun = np.array([-0.80, 0.35, 0.55])
    sun /= np.linalg.norm(sun)
    ground = _ground(terrain, scenery, patch.x, patch.y, sun)
    tall = nice(0.05 * float(span.max()))
    spot = low + 0.09 * span
    rod = _rod(np.array([*spot, float(patch.height(*spot[:, None])[0])]), tall, tall / 28)
    camera = fitted(np.array([-0.38, -0.80, 0.62]), low, high, patch)
    items = [ground, *obstacle_items(terrain), *rod]
    drawing = Drawing(items=items, camera=camera, size=SIZE, sun=tuple(map(float, sun)))  # type: ignore[arg-type]
    caption = f"{span[0]:g} m \u00d7 {span[1]:g} m seen from the south-west; the rod is {tall:g} m high; heights not enlarged"
    return drawing, _visible(marks, scenery, camera), caption


def fitted(toward: Array, low: Array, high: Array, patch: Patch) -> Camera:
    """The nearest camera in a direction that has the whole ground in its picture, and in its middle."""
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (patch.z.min(), patch.z.max())])
    focus = corners.mean(axis=0)
    toward = toward / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    room = np.array([SIZE[0] - 80, SIZE[1] - 120])
    distance = 1.5 * float(np.linalg.norm(high - low))
    camera = Camera(position=(0.0, 0.0, 0.0), focus=(0.0, 0.0, 0.0), view_angle=34.0)
    for _ in range(12):  # fixed-point iteration: the picture shrinks nearly as the distance grows
        camera = replace(camera, position=tuple(map(float, focus + distance * toward)), focus=tuple(map(float, focus)))
        pixels = project(corners, camera, SIZE)
        first, last = pixels.min(axis=0), pixels.max(axis=0)
        aside = ((first + last) / 2 - np.array(SIZE) / 2 - [0, -20]) * 2 * distance * math.tan(math.radians(17)) / SIZE[1]
        focus = focus + aside[0] * right - aside[1] * np.cross(toward, right)
        distance *= float(np.max((last - first) / room))
    return camera


def _visible(marks: Sequence[Mark], scenery: Scenery, camera: Camera) -> list[tuple[str, Array]]:
    """Names and points (3,) [m] of landforms that are in the picture and that no ground hides, the ones that look largest first."""
    eye = np.array(camera.position)
    ahead = np.array(camera.focus) - eye
    found = []
    for mark in marks:
        rim = np.zeros((0, 2)) if mark.outline is None else mark.outline
        middle = np.array([[mark.x, mark.y]])
        spots = np.concatenate([middle, middle + 0.35 * (rim - middle), middle + 0.6 * (rim - middle)])
        spots = np.column_stack([spots, scenery.height(spots[:, 0], spots[:, 1])])
        distance = float(np.linalg.norm(spots[0] - eye))
        size = 1.0 if mark.outline is None else float(np.ptp(rim, axis=0).max())
        if size / distance < 0.01:
            continue
        pixels = project(spots, camera, SIZE)
        shown = ((spots - eye) @ ahead > 0) & np.all((pixels > 20) & (pixels < np.array(SIZE) - [20, 60]), axis=1)
        rays = eye + np.linspace(0, 1, 300)[5:-3, None, None] * (spots - eye)
        seen = np.all(scenery.height(rays[..., 0], rays[..., 1]) < rays[..., 2] + 0.01 * size, axis=0)
        if np.any(seen & shown):
            found.append((size / distance, mark.name, spots[np.argmax(seen & shown)]))
    return [(name, point) for _, name, point in sorted(found, key=lambda f: -f[0])[:MOST_NAMES]]


def _write_names(path: Path, camera: Camera, points: Sequence[tuple[str, Array]], caption: str) -> None:
    """Names with lines to their landforms, and a caption, over the drawn view."""
    paper = Paper(*SIZE)
    with Image.open(path) as drawn:
        paper.image.paste(drawn.convert("RGB"))
    shown = [(name, tuple(project(point, camera, SIZE)[0])) for name, point in points]
    raised = [(name, (at[0], at[1] - 26.0)) for name, at in shown]
    labels, _ = place_labels(paper, raised, (10, 10, SIZE[0] - 10, SIZE[1] - 50), size=17)
    tips = dict(shown)
    for label in labels:
        foot = np.array(tips[label.text])
        end = np.clip(foot, label.box[:2], label.box[2:])
        paper.lines([np.array([foot, end])], "#101216", 3.0)
        paper.lines([np.array([foot, end])], LIGHT_INK, 1.3)
        paper.dots(foot[None], 3.0, LIGHT_INK, rim="#101216")
    for label in labels:
        middle = (label.box[0] + label.box[2]) / 2, (label.box[1] + label.box[3]) / 2
        paper.text(middle, label.text, size=17, color=LIGHT_INK, anchor="mm", halo=3, ground="#101216")
    paper.text((20, SIZE[1] - 22), caption, size=16, color=LIGHT_INK, anchor="ls", halo=3, ground="#101216")
    paper.save(path)
