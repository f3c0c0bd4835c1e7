"""What is in the 3-D pictures, and where the camera stands."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover, Terrain, Trace
from rille.model.rotation import matrix_of
from rille.view.drawing import Camera, Drawing, Item
from rille.view.ground import Patch, colors, crop
from rille.view.obstacles import obstacle_items
from rille.view.pose import to_world

Array = NDArray[np.float64]

PAGE = (1600, 1000)
"""Width and height of a picture of a mechanism [pixel]."""
GHOSTS = 5
"""How many earlier states such a picture shows."""
FILLED = 0.92
"""How much of the page, either way, such a picture may fill."""


def machine_items(rover: Rover, trace: Trace, index: int, opacity: float = 1.0) -> list[Item]:
    """All visual meshes of the rover at stored time ``index``."""
    parts = {part.name: part for part in rover.parts}
    bodies = {body.name: body for body in rover.bodies}
    traces = {body.name: body for body in trace.bodies}
    items = []
    for instance in rover.instances:
        if instance.body not in traces:
            continue
        part = parts[instance.part]
        for mesh in part.meshes:
            if mesh.purpose == "visual":
                vertices = to_world(mesh.vertices.astype(float), instance, bodies[instance.body], traces[instance.body], index)
                items.append(Item(vertices=vertices, triangles=mesh.triangles, color=part.color, opacity=opacity))
    return items


def track_items(rover: Rover, trace: Trace, patch: Patch) -> list[Item]:
    """A ribbon on the ground behind every wheel while it touched it, coloured by its slip ratio."""
    widths = {wheel.name: wheel.width for wheel in rover.wheels}
    joints = {wheel.name: wheel.joint for wheel in rover.wheels}
    children = {joint.name: (joint.child, joint.axis) for joint in rover.joints}
    traces = {body.name: body for body in trace.bodies}
    slips = np.concatenate([wheel.slip_ratio for wheel in trace.wheels]) if trace.wheels else np.zeros(1)
    low, high = np.percentile(slips, (2, 98))
    limits = (float(low) if low < -0.02 else 0.0, max(0.1, float(high)))
    items = []
    for wheel in trace.wheels:
        carried = wheel.normal_load > 0
        touched = np.flatnonzero(carried[:-1] & carried[1:])
        if len(touched) == 0:
            continue
        body, axis = children[joints[wheel.name]]
        axles = np.array([matrix_of(q) @ np.array(axis) for q in traces[body].rotation])
        edges = [wheel.center + side * widths[wheel.name] / 2 * axles for side in (-1, 1)]
        for edge in edges:
            edge[:, 2] = patch.height(edge[:, 0], edge[:, 1]) + 0.008
        vertices = np.stack(edges, axis=1).reshape(-1, 3)
        k = 2 * touched[:, None]
        triangles = np.concatenate([k + [0, 2, 1], k + [1, 2, 3]])
        items.append(
            Item(
                vertices=vertices,
                triangles=triangles,
                lit=False,
                values=np.repeat(wheel.slip_ratio, 2),
                title="" if items else "slip ratio [-]",
                limits=limits,
                opacity=0.9,
            )
        )
    return items


def ground_item(patch: Patch, terrain: Terrain, sun: Array) -> Item:
    """The ground with its light baked in."""
    x, y = np.meshgrid(patch.x, patch.y)
    n_rows, n_cols = patch.z.shape
    corner = (np.arange(n_rows - 1)[:, None] * n_cols + np.arange(n_cols - 1)[None, :]).ravel()[:, None]
    triangles = np.concatenate([corner + [0, n_cols, 1], corner + [1, n_cols, n_cols + 1]])
    vertices = np.column_stack([x.ravel(), y.ravel(), patch.z.ravel()])
    return Item(vertices=vertices, triangles=triangles, lit=False, rgb=colors(patch, terrain, sun))


def shadow_items(items: list[Item], patch: Patch, sun: Array, lift: float = 0.012) -> list[Item]:
    """The rover's shadow: its meshes slid along the light until they lie ``lift`` [m] over the ground."""
    shadows = []
    for item in items:
        fallen = item.vertices.copy()
        foot = item.vertices
        for _ in range(5):  # the ground below the foot of the ray, found by going there
            drop = item.vertices[:, 2] - patch.height(foot[:, 0], foot[:, 1])
            foot = item.vertices - np.maximum(drop, 0)[:, None] / sun[2] * sun
        fallen[:, :2] = foot[:, :2]
        fallen[:, 2] = patch.height(foot[:, 0], foot[:, 1]) + lift
        shadows.append(Item(vertices=fallen, triangles=item.triangles, color="#17171a", lit=False))
    return shadows


def traverse_drawings(rover: Rover, trace: Trace, terrain: Terrain) -> dict[str, Drawing]:
    """``scene``: the rover large in front, its tracks behind it back to the start. ``rover``: close up."""
    carried = {joint.child for joint in rover.joints}
    root = next((body for body in trace.bodies if body.name not in carried), trace.bodies[0])
    here, start = root.position[-1], root.position[0]
    away = here[:2] - start[:2]
    length = float(np.linalg.norm(away))
    ahead = away / length if length > 0.5 else (matrix_of(root.rotation[-1]) @ np.array([1.0, 0, 0]))[:2]
    ahead = ahead / np.linalg.norm(ahead)
    left = np.array([-ahead[1], ahead[0]])
    machine = machine_items(rover, trace, -1)
    cloud = np.concatenate([item.vertices for item in machine])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    size = float(np.linalg.norm(high - low))
    middle = (low + high) / 2

    patch = crop(terrain, here[:2], reach=max(30.0, 1.6 * length))
    toward = 0.55 * ahead - 0.83 * left  # low and to the side, so that relief shows and the near side of the rover is lit
    sun = np.array([*toward, 0.5])
    sun /= np.linalg.norm(sun)
    ground = ground_item(patch, terrain, sun)
    tracks = track_items(rover, trace, patch)
    rocks = obstacle_items(terrain)
    everything = [ground, *tracks, *shadow_items([*machine, *rocks], patch, sun), *rocks, *machine]
    vector = tuple(map(float, sun))

    def camera(forward: float, side: float, up: float, focus: Array, angle: float) -> Camera:
        place = middle[:2] + size * (forward * ahead + side * left)
        floor = float(patch.height(np.array([place[0]]), np.array([place[1]]))[0])
        z = max(middle[2] + up * size, floor + 0.25 * size)
        return Camera(position=(float(place[0]), float(place[1]), z), focus=tuple(map(float, focus)), view_angle=angle)  # type: ignore[arg-type]

    back = np.array([*(middle[:2] - 0.45 * size * ahead + 0.12 * size * left), middle[2] - 0.08 * size])
    return {
        "scene": Drawing(items=everything, camera=camera(1.15, -0.75, 0.50, back, 46.0), sun=vector),  # type: ignore[arg-type]
        "rover": Drawing(items=everything, camera=camera(0.62, -1.05, 0.28, middle, 40.0), sun=vector),  # type: ignore[arg-type]
    }


def mechanism_drawing(rover: Rover, trace: Trace) -> Drawing:
    """A machine without ground: solid at the end of the trace, behind it fading ghosts of the way there, seen square to the plane that it
    moves in.
    """
    items = machine_items(rover, trace, len(trace.time) - 1)
    size = float(np.linalg.norm(np.ptp(np.concatenate([item.vertices for item in items]), axis=0)))
    for k, index in enumerate(_way_here(rover, trace, size), start=1):
        items += machine_items(rover, trace, index, opacity=max(0.15, 0.6 - 0.09 * k))
    cloud = np.concatenate([item.vertices for item in items])
    middle = (cloud.min(axis=0) + cloud.max(axis=0)) / 2
    moved = np.concatenate([body.position - body.position.mean(axis=0) for body in trace.bodies])
    axis = _turning_axis(rover, moved)
    side = np.cross([0, 0, 1.0], axis)
    side = side / np.linalg.norm(side) if np.linalg.norm(side) > 1e-6 else np.array([1.0, 0, 0])
    toward = 0.92 * axis + 0.25 * side + np.array([0, 0, 0.22])
    toward = toward / np.linalg.norm(toward)
    sun = toward + np.array([0, 0, 0.75])
    return Drawing(
        items=items,
        camera=_fitted(cloud, middle, toward, view_angle=36.0),
        size=PAGE,
        background=("#eef1f5", "#ffffff"),
        sun=tuple(map(float, sun / np.linalg.norm(sun))),  # type: ignore[arg-type]
    )


def _way_here(rover: Rover, trace: Trace, size: float) -> list[int]:
    """Stored states before the last one, the nearest first, equally apart along the way that the machine took to where it is.

    The way of a step is the largest of any body: by which it moves, and by which it turns its farthest point. It is followed back for half
    of ``size`` [m]: further back, ghosts would hide each other.
    """
    steps = np.zeros(len(trace.time) - 1)
    for body in trace.bodies:
        turned = 2 * np.arccos(np.minimum(np.abs((body.rotation[1:] * body.rotation[:-1]).sum(axis=1)), 1.0))
        own = machine_items(replace(rover, instances=tuple(i for i in rover.instances if i.body == body.name)), trace, -1)
        radius = max((float(np.linalg.norm(item.vertices - body.position[-1], axis=1).max()) for item in own), default=0.0)
        steps = np.maximum(steps, np.linalg.norm(np.diff(body.position, axis=0), axis=1) + radius * turned)
    back = np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]])  # from a stored state to the last one
    far = min(size / 2, float(back[0]))
    wanted = [int(np.argmin(np.abs(back - k * far / GHOSTS))) for k in range(1, GHOSTS + 1)]
    return [index for index in dict.fromkeys(wanted) if back[index] > 1e-3 * size]


def _fitted(cloud: Array, focus: Array, toward: Array, view_angle: float) -> Camera:
    """The camera in direction ``toward`` (unit) from ``focus`` that is as near as lets it see all points of ``cloud``, shape (n, 3) [m].

    A point at depth d before the focus and r off the line of sight is seen from the distance d + r / tan(half the opening) on.
    """
    right = np.cross([0, 0, 1.0], toward)
    right = right / np.linalg.norm(right)
    rays = cloud - focus
    tall = FILLED * np.tan(np.radians(view_angle) / 2)
    width, height = PAGE
    off = np.maximum(np.abs(rays @ np.cross(toward, right)) / tall, np.abs(rays @ right) / (tall * width / height))
    distance = float((rays @ toward + off).max())
    place = focus + distance * toward
    return Camera(position=tuple(map(float, place)), focus=tuple(map(float, focus)), view_angle=view_angle)  # type: ignore[arg-type]


def _turning_axis(rover: Rover, moved: Array) -> Array:
    """Direction to look from: the first level hinge from its side of -y; else, from above, the first hinge; else that of least motion."""
    axes = [np.array(joint.axis) for joint in rover.joints if joint.kind == "hinge"]
    level = next((axis for axis in axes if abs(axis[2]) < 0.5), None)
    if level is not None:
        return level if level[1] <= 0 else -level
    axis = axes[0] if axes else np.linalg.svd(moved, full_matrices=False)[2][-1]
    return axis if axis[2] >= 0 else -axis  # the sign of a singular vector means nothing
