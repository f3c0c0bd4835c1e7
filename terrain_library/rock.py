"""Rock as a bump of the ground: from a pebble that hardly shows, over an ellipsoid, to a block or slab with a flat top."""

import numpy as np

from rille.terrain.landform import Driver, Landform, Radial

SHARPEST = 4.0  # factor between the exponent of an ellipsoid, 2, and that of the most angular block


def state(drivers):
    """0: only the tip shows; 0.5: an ellipsoid down to its widest; 1: a block, which looks the same however deep it is embedded."""
    buried = np.maximum(2.0 * drivers["embedded"] - 1.0, 0.0)
    angularity = drivers["angularity"]
    return 0.5 + 0.5 * angularity - 0.5 * buried * (1.0 - angularity)


def cut(state):
    """Height of the ground above the widest level over that of the top, m."""
    return np.maximum(1.0 - 2.0 * state, 0.0)


def semi_axes(drivers):
    """Half lengths [m] of what stands above the ground."""
    visible = drivers["diameter"] / 2 * np.sqrt(1.0 - cut(state(drivers)) ** 2)
    return visible, visible * drivers["aspect"]


def shape(r, state):
    """Height over height of the top; r = 1 where the rock meets the ground.

    Up to state 0.5 the cap of an ellipsoid that the ground cuts at m: (sqrt(1 - (1 - m^2) r^2) - m) / (1 - m); beyond, the
    superellipsoid (1 - r^p)^(1/p), p = 2 at 0.5 to 8 at 1.
    """
    r = np.asarray(r, np.float64)
    if state > 0.5:
        p = 2.0 * SHARPEST ** (2.0 * state - 1.0)
        return np.maximum(1.0 - np.minimum(r, 1.0) ** p, 0.0) ** (1.0 / p)
    m = min(float(cut(state)), 0.99)
    above = np.sqrt(np.maximum(1.0 - (1.0 - m * m) * r**2, 0.0)) - m
    return np.where(r < 1.0, np.maximum(above, 0.0) / (1.0 - m), 0.0)


LANDFORM = Landform(
    name="rock",
    meaning="single rock, partly embedded: rounded, angular, or a slab",
    frame="origin at the centre of its base, x along its longest diameter, height zero at the ground",
    source="rille: cap of an ellipsoid or superellipsoid; height about half the diameter (M. P. Golombek et al. 2003)",
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="longest horizontal diameter of the whole rock",
            lower=0.01,
            upper=100.0,
            reason="smaller grains are soil, larger blocks are hills: take a mound",
            source="rille",
        ),
        Driver(
            name="height",
            unit="m",
            meaning="height of the top above the ground; a slab is a tenth as high as long",
            lower=0.001,
            upper=100.0,
            link=lambda drivers: 0.5 * drivers["diameter"],
            law="0.5 diameter (M. P. Golombek et al. 2003, from memory)",
            reason="not higher than the longest rock",
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
            default=0.5,
            reason="nothing is seen of a rock that is embedded entirely",
            source="rille: no published law was found",
        ),
        Driver(
            name="angularity",
            unit="dimensionless",
            meaning="0: ellipsoid; 0.5: rounded block; 1: block with a flat top and upright sides",
            lower=0.0,
            upper=1.0,
            default=0.0,
            reason="exponent of the superellipsoid from 2 to 8",
            source="rille",
        ),
    ),
    radial=Radial(semi_axes=semi_axes, amplitude=lambda drivers: drivers["height"], shape=shape, state=state),
    footprint=lambda drivers: tuple(float(a) for a in semi_axes(drivers)),
    crowd="max",
    example={"diameter": 2.0, "height": 0.9, "angularity": 0.35},
    steep=True,
)
