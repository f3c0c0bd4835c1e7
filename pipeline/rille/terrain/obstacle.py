"""Obstacles of a scene: convex solids that stand in the ground and do not move."""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rille.model import InputRefused, Obstacle, Pose, Terrain
from rille.model.quantity import to_si
from rille.model.rotation import matrix_of
from rille.model.sheet import Sheet
from rille.terrain.dem import height_at

Number = float | int | str

N_CORNERS = 24  # of an irregular rock: more look smoother, and cost more in every contact


class ObstacleSheet(Sheet):
    """[[obstacle]]: a rock or block that does not move.

    size : box: three lengths; sphere: radius; cylinder: radius and height; rock: three diameters of an irregular hull (``seed``).
    embedded : share of its height that lies below the ground at its centre; it lies deeper where it would not touch the ground at all.
    z : height of its centre instead. roll, pitch : its tilt.
    """

    name: str = Field(min_length=1)
    kind: Literal["box", "sphere", "cylinder", "rock"]
    size: list[Number] = Field(min_length=1, max_length=3)
    x: Number
    y: Number
    z: Number | None = None
    embedded: float = Field(0.2, ge=0, lt=1)
    heading: Number = 0.0
    roll: Number = 0.0
    pitch: Number = 0.0
    seed: int = 0
    material: str | None = None


def rock_hull(diameters: tuple[float, float, float], seed: int) -> NDArray[np.float64]:
    """Corners (n, 3) [m] of an irregular convex rock in an ellipsoid of the given diameters, from its centre.

    Directions by the golden spiral, radii uniform in 0.75..1 of the ellipsoid (seeded), so that faces are of similar size.
    """
    k = np.arange(N_CORNERS) + 0.5
    polar, around = np.arccos(1 - 2 * k / N_CORNERS), math.pi * (1 + math.sqrt(5)) * k
    points = np.column_stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
    radii = np.random.default_rng(seed).uniform(0.75, 1.0, N_CORNERS)
    return points * radii[:, None] * np.array(diameters) / 2


def place_obstacle(sheet: ObstacleSheet, terrain: Terrain) -> Obstacle:
    """Stand an obstacle in the ground.

    Raises
    ------
    InputRefused : for sizes that its kind does not have, or a place off the map.
    """
    subject = f"obstacle '{sheet.name}'"
    wanted = {"box": 3, "sphere": 1, "cylinder": 2, "rock": 3}[sheet.kind]
    if len(sheet.size) != wanted:
        raise InputRefused(f"{subject} is a {sheet.kind} with {len(sheet.size)} sizes; it needs {wanted}")
    size = tuple(to_si(v, "length", f"size of {subject}") for v in sheet.size)
    if min(size) <= 0:
        raise InputRefused(f"{subject} has the size {min(size):g} m; it must be above 0")
    x, y = to_si(sheet.x, "length", f"x of {subject}"), to_si(sheet.y, "length", f"y of {subject}")
    rotation = _quaternion(*(to_si(v, "angle", f"the orientation of {subject}") for v in (sheet.roll, sheet.pitch, sheet.heading)))
    vertices = rock_hull((size[0], size[1], size[2]), sheet.seed) if sheet.kind == "rock" else None
    if sheet.z is not None:
        z = to_si(sheet.z, "length", f"z of {subject}")
    else:
        ground = float(height_at(terrain, np.array([x]), np.array([y]))[0])
        if not math.isfinite(ground):
            raise InputRefused(f"{subject} stands at x = {x:g} m, y = {y:g} m, off the map or on a missing height; move it")
        low, high = _extent(sheet.kind, size, vertices, rotation)
        z = ground - low - sheet.embedded * (high - low)
        skin = _skin(sheet.kind, size, vertices) @ matrix_of(rotation).T
        touching = height_at(terrain, x + skin[:, 0], y + skin[:, 1]) - skin[:, 2]  # its z where that point meets the ground
        if np.isfinite(touching).any():
            z = min(z, float(np.nanmax(touching)))  # a tilted one may end where the ground is lower than at its centre
    pose = Pose(position=(x, y, z), rotation=rotation)
    if vertices is not None:
        return Obstacle(name=sheet.name, kind="hull", pose=pose, vertices=vertices, material=sheet.material)
    return Obstacle(name=sheet.name, kind=sheet.kind, pose=pose, size=size, material=sheet.material)  # type: ignore[arg-type]


def _skin(kind: str, size: tuple[float, ...], vertices: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Points (n, 3) [m] of its surface, from its centre, close enough to find where it first meets the ground."""
    if vertices is not None:
        return vertices
    if kind == "box":
        steps = np.linspace(-0.5, 0.5, 9)
        return np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3) * np.array(size)
    around, along = np.meshgrid(np.linspace(0.0, math.tau, 97), np.linspace(-1.0, 1.0, 17))
    if kind == "cylinder":
        rings = [np.stack([share * np.cos(around), share * np.sin(around), along], axis=-1) for share in (0.0, 0.5, 1.0)]
        return np.concatenate(rings).reshape(-1, 3) * np.array([size[0], size[0], size[1] / 2])
    ring = np.sqrt(1.0 - along**2)
    return size[0] * np.stack([ring * np.cos(around), ring * np.sin(around), along], axis=-1).reshape(-1, 3)


def _quaternion(roll: float, pitch: float, heading: float) -> tuple[float, float, float, float]:
    """Rz(heading) Ry(pitch) Rx(roll) as w x y z."""
    (cr, sr), (cp, sp), (ch, sh) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, heading))
    return (cr * cp * ch + sr * sp * sh, sr * cp * ch - cr * sp * sh, cr * sp * ch + sr * cp * sh, cr * cp * sh - sr * sp * ch)


def _up_in_body(rotation: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """World's z in the axes of the body."""
    w, x, y, z = rotation
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


def _extent(
    kind: str, size: tuple[float, ...], vertices: NDArray[np.float64] | None, rotation: tuple[float, float, float, float]
) -> tuple[float, float]:
    """Lowest and highest point against the centre [m]."""
    up = _up_in_body(rotation)
    if vertices is not None:
        heights = vertices @ up
        return float(heights.min()), float(heights.max())
    if kind == "sphere":
        return -size[0], size[0]
    half = np.array([size[0] * math.hypot(up[0], up[1]), size[1] / 2 * up[2], 0.0]) if kind == "cylinder" else up * np.array(size) / 2
    reach = float(np.abs(half).sum())
    return -reach, reach
