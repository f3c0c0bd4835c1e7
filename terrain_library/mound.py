"""Smooth round mound."""

import numpy as np

from rille.terrain.landform import Driver, Landform


def profile(x, y, drivers):
    """h cos^2(pi d / (2 R)) for d < R: height and slope vanish at the foot; steepest slope pi h / (2 R) half way up."""
    radius = drivers["diameter"] / 2
    d = np.minimum(np.hypot(x, y) / radius, 1.0)
    return drivers["height"] * np.cos(np.pi * d / 2) ** 2


LANDFORM = Landform(
    name="mound",
    meaning="smooth round hill (or hollow, with a negative height)",
    frame="origin at the centre, height zero at the foot",
    source="rille: squared cosine",
    drivers=(
        Driver(name="diameter", unit="m", meaning="foot to foot", lower=0.1, upper=10000.0),
        Driver(name="height", unit="m", meaning="height of the top above the foot", lower=-1000.0, upper=1000.0),
    ),
    profile=profile,
    footprint=lambda drivers: drivers["diameter"] / 2,
)
