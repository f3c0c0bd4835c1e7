"""Angular boulder: an ellipsoid broken along plane facets."""

from functools import lru_cache

import numpy as np

from rille.terrain.landform import Driver, Landform

UPRIGHT = 0.05  # facets whose normals rise less than this are walls


@lru_cache(maxsize=64)
def _facets(count, seed):
    """Unit normals (count, 3) spread over the upper half and distances (count,) from the centre of the unit sphere."""
    rng = np.random.default_rng(seed)
    rise = 1.0 - 1.1 * (np.arange(count) + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count) + rng.uniform(0.0, 2.0 * np.pi)
    flat = np.sqrt(1.0 - rise**2)
    normals = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), rise]) + rng.normal(0.0, 0.22, (count, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True), rng.uniform(0.62, 0.9, count)


def _top(x, y, count, seed):
    """Height of the body above its widest level where the unit sphere, cut by the facets, is above it; else 0."""
    z = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    for normal, distance in zip(*_facets(count, seed), strict=True):
        room = distance - normal[0] * x - normal[1] * y
        z = np.minimum(z, room / normal[2] if normal[2] > UPRIGHT else np.where(room > 0, np.inf, 0.0))
    return np.maximum(z, 0.0)


@lru_cache(maxsize=64)
def _extent(count, seed):
    """Height of the highest point of the unit body and distance of the farthest from its axis, to about 0.005."""
    x, y = np.meshgrid(*[np.linspace(-1.0, 1.0, 257)] * 2)
    top = _top(x, y, count, seed)
    return float(top.max()), float(np.hypot(x, y)[top > 0.0].max())


def profile(x, y, drivers):
    """Height above the ground [m] of what the ground does not hide; the body's top stands at ``height``."""
    half, count, seed = drivers["diameter"] / 2, round(drivers["facets"]), round(drivers["seed"])
    highest, farthest = _extent(count, seed)
    ground = highest * max(2.0 * drivers["embedded"] - 1.0, 0.0)
    u, v = x / half, y / (half * drivers["aspect"])
    above = np.where(u**2 + v**2 < 1.0, _top(u * farthest, v * farthest, count, seed) - ground, 0.0)
    return drivers["height"] * np.clip(above / (highest - ground), 0.0, 1.0)


LANDFORM = Landform(
    name="boulder",
    meaning="angular boulder with plane facets, partly embedded, upright on whatever slope",
    frame="origin at the centre of its base, x along its longest diameter, height zero at the lowest ground under its rim",
    source="rille: ellipsoid cut by seeded planes",
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="twice the distance of its farthest point from the centre; the other side may be cut shorter",
            lower=0.05,
            upper=100.0,
            reason="smaller ones are rocks, larger ones hills",
            source="rille",
        ),
        Driver(
            name="height",
            unit="m",
            meaning="height of its top above the ground",
            lower=0.01,
            upper=100.0,
            link=lambda drivers: 0.5 * drivers["diameter"],
            law="0.5 diameter (M. P. Golombek et al. 2003, from memory)",
            reason="not higher than the longest boulder",
            source="M. P. Golombek et al. 2003 (from memory)",
        ),
        Driver(
            name="aspect",
            unit="dimensionless",
            meaning="width over length",
            lower=0.2,
            upper=1.0,
            default=0.8,
            reason="at 1 it is round; narrower splinters break",
            source="rille",
        ),
        Driver(
            name="embedded",
            unit="dimensionless",
            meaning="fraction of the full height below the ground; beyond 0.5 its widest part is hidden",
            lower=0.0,
            upper=0.95,
            default=0.3,
            reason="nothing is seen of a boulder that is embedded entirely",
            source="rille: no published law was found",
        ),
        Driver(
            name="facets",
            unit="dimensionless",
            meaning="number of planes along which it broke",
            lower=5.0,
            upper=60.0,
            default=16.0,
            reason="fewer leave it open, more look round",
            source="rille",
        ),
        Driver(
            name="seed",
            unit="dimensionless",
            meaning="another number gives another boulder",
            lower=0.0,
            upper=2147483647.0,
            default=1.0,
            reason="a seed is a whole number of 31 bits",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: (drivers["diameter"] / 2, drivers["diameter"] / 2 * drivers["aspect"]),
    blend="max",
    example={"diameter": 3.0, "seed": 4.0},
    steep=True,
)
