"""What a page shows: the scene as one binary glTF in W's own axes (z up), and the layout of the numbers that move it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover, Scenario, Terrain
from rille.view.ground import crop
from rille.view.scene3d.glb import Glb
from rille.view.scene3d.land import MARGIN, SUN, add_ground
from rille.view.scene3d.machine import add_bodies, axle

Array = NDArray[np.float64]
GRAVITY_UNKNOWN = 9.80665


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Which piece of the world is shown. center : (x, y) [m] in W. reach : half the side of the fine ground [m]. origin : [m] that all
    numbers are less of, so that float32 is enough."""

    center: tuple[float, float]
    reach: float
    origin: tuple[float, float, float]


def view_of(terrain: Terrain | None, path: Array, reach: float | None = None) -> View:
    """The view of places (n, 3) [m] that a machine passes: all of them and a margin, or ``reach`` around their middle."""
    low, high = path.min(axis=0), path.max(axis=0)
    middle = (low + high) / 2
    center = (float(middle[0]), float(middle[1]))
    needed = float((high - low)[:2].max() / 2 + MARGIN) if reach is None else reach
    height = float(middle[2])
    if terrain is not None:
        height = float(crop(terrain, np.array(center), needed, 3).height(np.array(center[:1]), np.array(center[1:]))[0])
    return View(center=center, reach=needed, origin=(float(round(center[0])), float(round(center[1])), float(round(height, 1))))


def scene_glb(rover: Rover, terrain: Terrain | None, view: View) -> bytes:
    """Machine and ground as a binary glTF in W's own axes, less ``view.origin``.

    Its top nodes say in their extras what they are (``rille``) and their ``name``. ``body``: one for each, at the zero pose, parts below
    it; ``terrain``: a fine grid, also with ``rows, columns, posting_x, posting_y, x_west, y_north``, vertex i columns + j is row i from the
    north, column j; ``surroundings``: the coarse rest; ``obstacles``.
    """
    glb = Glb()
    origin = np.array(view.origin)
    add_bodies(glb, rover, origin)
    if terrain is not None:
        add_ground(glb, terrain, np.array(view.center), view.reach, origin)
    return glb.to_bytes()


def layout(rover: Rover, view: View, *, title: str, gravity: float = GRAVITY_UNKNOWN) -> dict[str, Any]:
    """Names and order of the numbers of a state, and what the page must know of them. gravity [m/s^2]."""
    carried = {joint.child for joint in rover.joints}
    single = [joint for joint in rover.joints if joint.kind in ("hinge", "prismatic")]
    limits = {joint.name: joint.limit for joint in rover.joints}
    children = {joint.name: joint.child for joint in rover.joints}

    def bounds(joint: str) -> dict[str, float | None]:
        limit = limits[joint]
        return {"lower": None if limit is None else limit.lower, "upper": None if limit is None else limit.upper}

    return {
        "title": title,
        "origin": list(view.origin),
        "gravity": gravity,
        "sun": list(SUN),
        "weight": gravity * sum(body.properties.mass for body in rover.bodies),
        "bodies": [{"name": body.name, "root": body.name not in carried} for body in rover.bodies],
        "joints": [{"name": joint.name, "kind": joint.kind, **bounds(joint.name)} for joint in single],
        "wheels": [
            {
                **{"name": wheel.name, "body": children[wheel.joint], "joint": wheel.joint, "radius": wheel.radius, "width": wheel.width},
                "axle": list(axle(rover, wheel)),
            }
            for wheel in rover.wheels
        ],
        "drives": [
            {
                **{"name": drive.name, "joint": drive.joint, "mode": drive.mode},
                **{"max_speed": drive.max_speed, "max_torque": drive.max_torque, **bounds(drive.joint)},
            }
            for drive in rover.drives
        ],
    }


def gravity_of(scenario: Scenario) -> float:
    """Magnitude of a scenario's gravity [m/s^2]."""
    return float(np.linalg.norm(scenario.gravity))
