"""Smooth round mound."""

import numpy as np

from rille.terrain.landform import Driver, Landform, Radial
from rille.terrain.relief import circle


def shape(r, state=0.0):
    """cos^2(pi r / 2) for r < 1: value and slope vanish at the foot."""
    return np.where(r < 1.0, np.cos(np.pi * np.minimum(r, 1.0) / 2) ** 2, 0.0)


def profile(x, y, drivers):
    """h cos^2(pi d / (2 R)) for d < R: height and slope vanish at the foot; steepest slope pi h / (2 R) half way up."""
    return drivers["height"] * shape(np.hypot(x, y) / (drivers["diameter"] / 2))


LANDFORM = Landform(
    name="mound",
    meaning="smooth round hill (or hollow, with a negative height)",
    frame="origin at the centre, height zero at the foot",
    source="rille: squared cosine; volume h R^2 (pi/2 - 2/pi)",
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="foot to foot",
            lower=0.1,
            upper=10000.0,
            reason="below, roughness of the soil; above, a landform of a whole map",
            source="rille",
        ),
        Driver(
            name="height",
            unit="m",
            meaning="height of the top above the foot",
            lower=-1000.0,
            upper=1000.0,
            reason="slopes of larger ones would pass 45 deg at any diameter in range",
            source="rille",
        ),
    ),
    profile=profile,
    radial=Radial(
        semi_axes=lambda drivers: (drivers["diameter"] / 2, drivers["diameter"] / 2),
        amplitude=lambda drivers: drivers["height"],
        shape=shape,
    ),
    footprint=lambda drivers: (drivers["diameter"] / 2, drivers["diameter"] / 2),
    outline=lambda drivers: circle(drivers["diameter"] / 2),
    example={"diameter": 6.0, "height": 1.0},
)
