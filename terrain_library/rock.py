"""Rounded rock as a bump of the ground."""

import numpy as np

from rille.terrain.landform import Driver, Landform


def profile(x, y, drivers):
    """Cap of an ellipsoid: the part above the ground of a rock that is embedded to the given fraction of its height.

    z = H (sqrt(1 - d^2) - (2 e - 1)) / (2 - 2 e) where the ellipsoid stands above the ground; visible height H, embedded fraction e of
    the full height, d the distance over the largest half diameter.
    """
    half, height, embedded = drivers["diameter"] / 2, drivers["height"], drivers["embedded"]
    d = np.minimum((x / half) ** 2 + (y / (half * drivers["aspect"])) ** 2, 1.0)
    above = np.sqrt(1.0 - d) - max(2.0 * embedded - 1.0, 0.0)
    return height * np.maximum(above, 0.0) / (1.0 - max(2.0 * embedded - 1.0, 0.0))


LANDFORM = Landform(
    name="rock",
    meaning="single rounded rock, partly embedded",
    frame="origin at the centre of its base, x along its longest diameter, height zero at the ground",
    source="rille: ellipsoidal cap; height about half the diameter (M. P. Golombek et al. 2003)",
    drivers=(
        Driver(name="diameter", unit="m", meaning="longest horizontal diameter", lower=0.01, upper=100.0),
        Driver(name="height", unit="m", meaning="height above the ground", lower=0.001, upper=100.0),
        Driver(name="aspect", unit="dimensionless", meaning="width over length", lower=0.2, upper=1.0, default=0.8),
        Driver(
            name="embedded",
            unit="dimensionless",
            meaning="fraction of the full height below the ground",
            lower=0.0,
            upper=0.95,
            default=0.5,
            reason="nothing is seen of a rock that is embedded entirely",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: drivers["diameter"] / 2,
)
