"""Collision bodies of the larger rocks of a population."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Obstacle, Population, Pose
from rille.model.quantity import to_si
from rille.terrain.landform import Landform
from rille.terrain.population.sheet import PopulationSheet

Array = NDArray[np.float64]

MOST = 5000  # bodies of one population: each is looked at in every step
AROUND = 10  # corners of a ring
RINGS = (0.0, 0.5, 0.8, 0.97)  # of the visible part, in shares of the footprint
BESIDE = (1.05,)  # where the ground around a rock is looked at
ROOTS = ((0.75, 0.55), (0.0, 1.0))  # of the buried part: share of the footprint, share of the depth
LEAST_BURIED = 0.15  # share of the visible height that is buried at least, so that nothing floats when soil gives way


def collision_bodies(
    sheet: PopulationSheet, population: Population, landform: Landform, at: Callable[[Array, Array], Array]
) -> tuple[Obstacle, ...]:
    """Hulls of the rocks of at least ``collide`` in diameter; none if the sheet does not ask for any.

    The visible corners lie on the surface: the bump and the body coincide there, and between corners the hull lies below the bump
    by at most the sagitta of a chord, (1 - cos(pi / 10)) = 5 % of the radius. The other corners lie below the lowest ground around
    the rock, as deep as the driver ``embedded`` says (share of the full height that is buried), at least LEAST_BURIED of the
    visible height. Rocks that reach beyond the known ground get no body.

    Parameters
    ----------
    at : (x, y) (n,) [m] in W -> heights (n,) [m] of the finished surface, NaN where it is unknown.

    Raises
    ------
    InputRefused : for a size that is not above 0, or more than MOST bodies.
    """
    if sheet.collide is None:
        return ()
    subject = f"population '{sheet.name}'"
    smallest = to_si(sheet.collide, "length", f"collide of {subject}")
    if smallest <= 0:
        raise InputRefused(f"collide of {subject} is {smallest:g} m; it must be above 0: the diameter from which rocks become bodies")
    assert landform.radial is not None
    radial, drivers = landform.radial, population.drivers
    diameter = drivers["diameter"] * population.scale
    chosen = np.flatnonzero(diameter >= smallest)
    if len(chosen) > MOST:
        enough = np.sort(diameter)[-MOST]
        raise InputRefused(
            f"{len(chosen)} rocks of {subject} would become collision bodies, more than {MOST}; raise collide to {enough:.2g} m"
        )
    if len(chosen) == 0:
        return ()
    mine = {name: values[chosen] for name, values in drivers.items()}
    a, b = (np.broadcast_to(v, chosen.shape) * population.scale * radial.reach for v in radial.semi_axes(mine))
    profile = _profiles(landform, mine) * population.scale
    u, v = _plan(RINGS)
    x, y = _to_scene(population, chosen, a, b, u, v)
    surface = at(x.ravel(), y.ravel()).reshape(x.shape)
    rim = at(*(v.ravel() for v in _to_scene(population, chosen, a, b, *_plan(BESIDE)))).reshape(len(chosen), -1).min(axis=1)
    z = np.maximum(surface, rim[:, None] + profile)
    height = z.max(axis=1) - rim
    embedded = mine.get("embedded", np.zeros(len(chosen)))
    depth = height * np.maximum(embedded / (1 - np.minimum(embedded, 0.95)), LEAST_BURIED)
    below = [(share, part) for share, part in ROOTS for _ in range(1 if share == 0 else AROUND)]
    x_root, y_root = _to_scene(population, chosen, a, b, *_plan(tuple(share for share, _ in ROOTS)))
    z_root = rim[:, None] - depth[:, None] * np.array([part for _, part in below])
    corners = np.stack([np.hstack([x, x_root]), np.hstack([y, y_root]), np.hstack([z, z_root])], axis=-1)
    return tuple(
        _body(f"{sheet.name}_{k + 1}", points, sheet.material)
        for k, points, tall in zip(chosen, corners, height, strict=True)
        if np.isfinite(points).all() and tall > 0
    )


def _plan(rings: tuple[float, ...]) -> tuple[Array, Array]:
    """Places (n,) in the unit disc: AROUND on each ring, every other ring turned by half a step; one at the centre."""
    u, v = [], []
    for k, ring in enumerate(rings):
        around = (np.arange(AROUND) + 0.5 * (k % 2)) * 2 * np.pi / AROUND if ring > 0 else np.zeros(1)
        u.append(ring * np.cos(around))
        v.append(ring * np.sin(around))
    return np.concatenate(u), np.concatenate(v)


def _profiles(landform: Landform, drivers: dict[str, Array]) -> Array:
    """Heights (n, corners) [m] of the visible corners above the ground, by the landform's formula."""
    assert landform.radial is not None
    radial = landform.radial
    r = radial.reach * np.hypot(*_plan(RINGS))
    n = len(drivers["diameter"])
    amplitude = np.broadcast_to(radial.amplitude(drivers), (n,))
    state = np.zeros(n) if radial.state is None else np.broadcast_to(radial.state(drivers), (n,))
    return np.array([amplitude[k] * radial.shape(r, float(state[k])) for k in range(n)])


def _to_scene(population: Population, chosen: NDArray[np.int_], a: Array, b: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """Places (n, corners) [m] in W of places in the unit disc."""
    c, s = np.cos(population.heading[chosen])[:, None], np.sin(population.heading[chosen])[:, None]
    along, across = a[:, None] * u, b[:, None] * v
    return population.x[chosen][:, None] + c * along - s * across, population.y[chosen][:, None] + s * along + c * across


def _body(name: str, points: Array, material: str | None) -> Obstacle:
    """A hull from its corners (n, 3) [m] in W; its centre is their mean."""
    from scipy.spatial import ConvexHull

    corners = points[np.sort(ConvexHull(points).vertices)]
    center = corners.mean(axis=0)
    pose = Pose(position=(float(center[0]), float(center[1]), float(center[2])), rotation=(1.0, 0.0, 0.0, 0.0))
    return Obstacle(name=name, kind="hull", pose=pose, vertices=corners - center, material=material)
