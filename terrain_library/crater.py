"""Fresh simple crater, with a driver that flattens it."""

import numpy as np

from rille.terrain.landform import Driver, Landform


def profile(x, y, drivers):
    """Height above the ground before the impact [m].

    z/D over r = distance/R (Fassett & Thomson 2014, eq. 4): a flat floor to r = 0.2, a wall to 0.98, a flank to 1.5. The driver
    ``relief`` scales it: 1 is fresh.
    """
    diameter = drivers["diameter"]
    r = np.hypot(x, y) / (diameter / 2)
    wall = -0.228809953 + 0.227533882 * r + 0.083116795 * r**2 - 0.039499407 * r**3
    flank = 0.188253307 - 0.187050452 * r + 0.01844746 * r**2 + 0.01505647 * r**3
    height = np.select([r <= 0.2, r <= 0.98, r <= 1.5], [-0.181, wall, np.maximum(flank, 0.0)], 0.0)
    return drivers["relief"] * diameter * height


LANDFORM = Landform(
    name="crater",
    meaning="simple impact crater: bowl, raised rim, flank",
    frame="origin at the centre, height zero at the ground before the impact",
    source="C. I. Fassett & B. J. Thomson 2014, J. Geophys. Res. Planets 119, eq. 4",
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="rim to rim",
            lower=0.1,
            upper=15000.0,
            reason="larger craters on the Moon are complex, not bowls",
        ),
        Driver(
            name="relief",
            unit="dimensionless",
            meaning="height and depth as a fraction of a fresh crater's",
            lower=0.01,
            upper=1.0,
            default=1.0,
            reason="1 is a fresh crater, degradation only flattens",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: 0.75 * drivers["diameter"],
)
