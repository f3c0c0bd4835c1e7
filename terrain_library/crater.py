"""Fresh simple crater, with drivers that flatten it."""

import numpy as np

from rille.terrain.crater_laws import FASSETT_THOMSON, FRESH_DEPTH, REACH, STOPAR, shallow_profile, small_crater_depth
from rille.terrain.landform import Driver, Landform, Radial

DEEPEST = 0.25


def depth_ratio(drivers):
    """Depth over diameter between that of large fresh craters (shallowing 0) and that of their class of size (1)."""
    size_class = small_crater_depth(drivers["diameter"])
    return FRESH_DEPTH + drivers["shallowing"] * (size_class - FRESH_DEPTH)


LANDFORM = Landform(
    name="crater",
    meaning="fresh simple impact crater: bowl, raised rim, flank",
    frame="origin at the centre, height zero at the ground before the impact",
    source=FASSETT_THOMSON,
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="rim to rim",
            lower=0.1,
            upper=15000.0,
            reason="larger craters on the Moon are complex, not bowls",
            source="R. J. Pike 1974, Geophys. Res. Lett. 1, 291: simple craters end at 10 to 15 km",
        ),
        Driver(
            name="relief",
            unit="dimensionless",
            meaning="factor on all heights: rim, flank and bowl alike",
            lower=0.01,
            upper=1.0,
            default=1.0,
            reason="1 is a fresh crater, degradation only flattens",
            source="rille",
        ),
        Driver(
            name="shallowing",
            unit="dimensionless",
            meaning="0: as deep as large fresh craters; 1: as shallow as small ones are by their class of size; the rim stays",
            lower=0.0,
            upper=1.0,
            default=0.0,
            reason="between the two published depths",
            source=STOPAR,
        ),
        Driver(
            name="depth_ratio",
            unit="dimensionless",
            meaning="rim to floor over diameter, before relief; inside the rim depths are scaled, the rim stays 0.0368 diameter high",
            lower=0.04,
            upper=DEEPEST,
            link=depth_ratio,
            law="0.2178 + shallowing (class - 0.2178), class 0.21, 0.17, 0.15, 0.13 from 400, 200, 100, 40 m, 0.11, 0.10 below",
            reason="at 0.25 the wall stands at 33 deg, about as steep as loose soil can; below 0.04 the floor would lie above the ground",
            source=f"{FASSETT_THOMSON}; {STOPAR}",
        ),
    ),
    radial=Radial(
        semi_axes=lambda drivers: (drivers["diameter"] / 2, drivers["diameter"] / 2),
        amplitude=lambda drivers: drivers["relief"] * drivers["diameter"],
        shape=lambda r, state: shallow_profile(np.asarray(r, np.float64), DEEPEST * state),
        state=lambda drivers: drivers["depth_ratio"] / DEEPEST,
        reach=REACH,
    ),
    footprint=lambda drivers: (REACH / 2 * drivers["diameter"], REACH / 2 * drivers["diameter"]),
    example={"diameter": 20.0},
)
