"""Cone of loose soil at its angle of repose."""

import numpy as np

from rille.terrain.landform import Driver, Landform, Radial
from rille.terrain.relief import bank, bank_run, circle


def shape(r, state):
    """A bank of revolution: tip rounded by a parabola, straight flank, foot that joins the ground by a parabola; state: rounding."""
    return bank(r * bank_run(state, state), state, state)


LANDFORM = Landform(
    name="cone",
    meaning="cone of loose soil at its angle of repose (or a funnel, with a negative angle)",
    frame="origin at the centre, height zero at the foot",
    source="rille: bank of revolution; volume pi R^2 h (3 + (1 + rounding^2) / (1 + rounding)^2) / 12, h = R tan(angle) / (1 + rounding)",
    drivers=(
        Driver(
            name="diameter", unit="m", meaning="foot to foot", lower=0.05, upper=5000.0, reason="of heaps and cinder cones", source="rille"
        ),
        Driver(
            name="angle",
            unit="rad",
            meaning="slope of the flank",
            lower=-0.79,
            upper=0.79,
            default=np.deg2rad(35.0),
            reason="loose soil slides beyond its friction angle, at most about 45 deg",
            source="25 deg (rounded grains) to 40 deg (angular): Kleinhans et al. 2011, J. Geophys. Res. 116, E11004",
        ),
        Driver(
            name="rounding",
            unit="dimensionless",
            meaning="share of the straight flank that is rounded at the tip and as much at the foot; 0: sharp",
            lower=0.0,
            upper=1.0,
            default=0.15,
            reason="at 1 the two roundings meet",
            source="rille",
        ),
    ),
    radial=Radial(
        semi_axes=lambda drivers: (drivers["diameter"] / 2, drivers["diameter"] / 2),
        amplitude=lambda drivers: drivers["diameter"] / 2 * np.tan(drivers["angle"]) / (1 + drivers["rounding"]),
        shape=shape,
        state=lambda drivers: drivers["rounding"],
    ),
    footprint=lambda drivers: (drivers["diameter"] / 2, drivers["diameter"] / 2),
    outline=lambda drivers: circle(drivers["diameter"] / 2),
    example={"diameter": 6.0},
)
