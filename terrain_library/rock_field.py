"""Field of rocks whose sizes follow the law of Golombek & Rapp."""

import math

import numpy as np

from rille.terrain.landform import Driver, Landform, Scattered
from rille.terrain.rock_laws import MOST_ROCKS, Build, draw_diameters, expected, rock_drivers


def count(drivers):
    """Mean number of rocks."""
    from rille.terrain.population.laws import golombek

    return expected(golombek(drivers["cover"]), drivers["smallest"], drivers["largest"], drivers["length"] * drivers["width"])


def children(drivers):
    """Rocks anywhere in the field (Poisson); each lies wholly inside."""
    from rille.terrain.population.laws import golombek

    rng = np.random.default_rng(round(drivers["seed"]))
    law = golombek(drivers["cover"])
    diameter = draw_diameters(rng, law, drivers["smallest"], drivers["largest"], int(rng.poisson(count(drivers))))
    x, y = (
        rng.uniform(-1.0, 1.0, len(diameter)) * np.maximum(side / 2 - diameter / 2, 0.0) for side in (drivers["length"], drivers["width"])
    )
    heading = rng.uniform(0.0, 2.0 * math.pi, len(diameter))
    build = Build(embedded=drivers["embedded"], angularity=drivers["angularity"])
    return (Scattered(landform="rock", x=x, y=y, heading=heading, drivers=rock_drivers(rng, diameter, build)),)


def check(drivers):
    """Sizes in order, and not more rocks than a landform may hold."""
    if drivers["smallest"] >= drivers["largest"]:
        return f"smallest is {drivers['smallest']:g} m and largest {drivers['largest']:g} m; smallest must be below largest"
    if drivers["largest"] > min(drivers["length"], drivers["width"]):
        shorter = min(drivers["length"], drivers["width"])
        return f"the largest rock measures {drivers['largest']:g} m, the field's shorter side {shorter:g} m; enlarge the field"
    rocks = count(drivers)
    if rocks > MOST_ROCKS:
        return f"it would hold about {rocks:.0f} rocks, more than {MOST_ROCKS}; raise smallest, shrink the field, or use a population"
    return ""


LANDFORM = Landform(
    name="rock_field",
    meaning="rocks scattered over a rectangle, many small and few large",
    frame="origin at the centre, x along its length, height zero at the ground between the rocks",
    source="M. P. Golombek & D. Rapp 1997, J. Geophys. Res. 102, 4117, eq. 1 and 3",
    drivers=(
        Driver(
            name="length",
            unit="m",
            meaning="extent along x",
            lower=0.5,
            upper=2000.0,
            default=20.0,
            reason="larger areas are populations",
            source="rille",
        ),
        Driver(
            name="width",
            unit="m",
            meaning="extent along y",
            lower=0.5,
            upper=2000.0,
            link=lambda drivers: drivers["length"],
            law="length",
            reason="larger areas are populations",
            source="rille",
        ),
        Driver(
            name="cover",
            unit="dimensionless",
            meaning="share k of the ground that rocks of all sizes cover: F(>= D) = k exp(-q D), q = 1.79 + 0.152 / k",
            lower=0.001,
            upper=0.4,
            default=0.07,
            reason="fields on Mars cover 0.02 to 0.35; 0.07 is Viking 1, 0.18 Viking 2",
            source="M. P. Golombek & D. Rapp 1997 (values of the Viking sites from memory)",
        ),
        Driver(
            name="smallest",
            unit="m",
            meaning="smallest diameter",
            lower=0.02,
            upper=50.0,
            default=0.1,
            reason="the law was measured from 0.02 m",
            source="M. P. Golombek & D. Rapp 1997",
        ),
        Driver(
            name="largest",
            unit="m",
            meaning="largest diameter",
            lower=0.03,
            upper=100.0,
            link=lambda drivers: min(max(10.0 * drivers["smallest"], min(2.0, drivers["length"] / 4, drivers["width"] / 4)), 100.0),
            law="2 m, at most a quarter of the field, at least 10 smallest, at most 100 m",
            reason="larger blocks are hills",
            source="rille",
        ),
        Driver(
            name="embedded",
            unit="dimensionless",
            meaning="mean fraction of their height below the ground, +- 0.2",
            lower=0.0,
            upper=0.95,
            default=0.4,
            reason="nothing is seen of rocks that are embedded entirely",
            source="rille: no published law was found",
        ),
        Driver(
            name="angularity",
            unit="dimensionless",
            meaning="mean angularity, +- 0.2: 0 rounded, 1 blocks",
            lower=0.0,
            upper=1.0,
            default=0.3,
            reason="exponent of the superellipsoid from 2 to 8",
            source="rille",
        ),
        Driver(
            name="seed",
            unit="dimensionless",
            meaning="another number gives other rocks",
            lower=0.0,
            upper=2147483647.0,
            default=1.0,
            reason="a seed is a whole number of 31 bits",
            source="rille",
        ),
    ),
    profile=lambda x, y, drivers: np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y))),
    footprint=lambda drivers: (drivers["length"] / 2, drivers["width"] / 2),
    children=children,
    check=check,
    example={"length": 12.0, "width": 8.0, "cover": 0.2, "smallest": 0.08, "seed": 3.0},
    steep=True,
)
