"""What is drawn besides machine and ground: the shadow, the forces of the soil, the path."""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from rille.view.scene3d.ruts import Pressed
from rille.view.scene3d.tracks import WHEEL

Array = NDArray[Any]
SHADOW, PATH = "#2b2927", "#6fb1f0"
FORCES = {"normal_load": "#f2f4f7", "drawbar_pull": "#5fd38d", "side_force": "#c79bff"}  # as on the page (web/colours.js)
LIFT = 0.004  # of shadow and path above the ground, in sizes of the machine
REACH = 0.42  # length of an arrow of a wheel's share of the weight, in sizes of the machine
LEAST = 0.02  # arrows below this share of REACH are left out
EDGE = 0.08  # longest edge of what casts the shadow, in sizes of the machine: it follows the ground so


class Shadow:
    """The machine's meshes slid along the light onto the ground. pieces : (number of the body, vertices (n, 3), triangles (m, 3))."""

    def __init__(self, plotter: Any, pieces: list[tuple[int, Array, Array]], sun: Array, size: float) -> None:
        import pyvista

        self._sun, self._lift = sun, LIFT * size
        self._pieces, faces, count = [], [], 0
        for body, vertices, triangles in pieces:
            fine, split = trimesh.remesh.subdivide_to_size(vertices, triangles, EDGE * size, max_iter=12)[:2]
            self._pieces.append((body, np.asarray(fine)))
            faces.append(np.asarray(split) + count)
            count += len(fine)
        corners = np.concatenate(faces)
        self._mesh = pyvista.PolyData(np.zeros((count, 3)), np.column_stack([np.full(len(corners), 3), corners]).ravel())
        plotter.add_mesh(self._mesh, color=SHADOW, lighting=False)

    def fall(self, poses: list[Array], ground: Pressed) -> None:
        """Cast it where bodies have these poses (4, 4)."""
        cloud = np.concatenate([vertices @ poses[body][:3, :3].T + poses[body][:3, 3] for body, vertices in self._pieces])
        foot = cloud
        for _ in range(4):  # the ground below the foot of the ray, found by going there
            drop = np.maximum(cloud[:, 2] - ground.height(foot[:, 0], foot[:, 1]), 0.0)
            foot = cloud - drop[:, None] / self._sun[2] * self._sun
        self._mesh.points = np.column_stack([foot[:, :2], ground.height(foot[:, 0], foot[:, 1]) + self._lift])


class Arrows:
    """Forces of the soil on each wheel, beside it: as long as they are large against a wheel's share of the weight."""

    def __init__(self, plotter: Any, wheels: list[dict[str, Any]], share: float, size: float) -> None:
        import pyvista

        self._wheels, self._share, self.reach = wheels, share, REACH * size
        shape = pyvista.Arrow(start=(0, 0, 0), direction=(1, 0, 0), tip_length=0.2, tip_radius=0.045, shaft_radius=0.018)
        self._actors = [[plotter.add_mesh(shape, color=color, lighting=False) for color in FORCES.values()] for _ in wheels]

    def point(self, tracks: Array, stored: int, poses: list[Array], root: Array) -> None:
        """Show the forces of a stored time. tracks (wheels, n, 11); poses (4, 4) of bodies; root (3,): middle of the machine [m]."""
        for wheel, track, actors in zip(self._wheels, tracks, self._actors, strict=True):
            state = track[stored]
            axle = poses[wheel["body"]][:3, :3] @ wheel["axle"]
            level = np.hypot(axle[0], axle[1]) or 1.0
            forward = np.array([axle[1], -axle[0], 0.0]) / level
            outer = np.sign((state[:3] - root) @ axle) or 1.0
            bottom = state[3] if np.isfinite(state[3]) else state[2] - wheel["radius"]
            foot = np.array([*state[:2], bottom + 0.1 * wheel["radius"]])
            foot[:2] += (outer * (0.5 * wheel["width"] + 0.35 * wheel["radius"]) * axle)[:2]
            directions = (np.array([0.0, 0.0, 1.0]), forward, axle)
            for actor, field, direction in zip(actors, FORCES, directions, strict=True):
                force = state[4 + WHEEL.index(field)] / self._share
                shown = bool(np.isfinite(force) and abs(force) > LEAST and np.isfinite(foot).all())
                actor.SetVisibility(shown)
                if shown:
                    actor.user_matrix = _along(foot, np.sign(force) * direction, abs(force) * self.reach, self.reach)


class Path:
    """The way of the root, on the ground where there is one. route : (n, 3) [m] at stored times."""

    def __init__(self, plotter: Any, route: Array, ground: Pressed | None, size: float) -> None:
        import pyvista

        self._route = np.array(route)
        if ground is not None:
            self._route[:, 2] = ground.height(route[:, 0], route[:, 1]) + 2 * LIFT * size
        self._line = pyvista.MultipleLines(points=np.vstack([self._route[:1], self._route]))
        plotter.add_mesh(self._line, color=PATH, line_width=max(1.5, plotter.window_size[1] / 200), lighting=False)

    def until(self, stored: int) -> None:
        """Show it up to a stored time."""
        points = np.repeat(self._route[stored : stored + 1], len(self._route) + 1, axis=0)
        points[: stored + 1] = self._route[: stored + 1]
        self._line.points = points


def _along(foot: Array, direction: Array, length: float, reach: float) -> Array:
    """Places the unit arrow along x; short ones are as thick as long ones, as far as their tips allow."""
    side = np.cross(direction, [0.3, 0.9, 0.1])
    side /= np.linalg.norm(side)
    thick = min(reach, 4 * length)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([direction * length, side * thick, np.cross(direction, side) * thick])
    matrix[:3, 3] = foot
    return matrix
