"""Fresh crater with its blanket of ejecta and the blocks that it threw out."""

import math
from functools import lru_cache

import numpy as np

from rille.terrain.crater_laws import (
    FASSETT_THOMSON,
    REACH,
    RIM,
    RIM_HEIGHT,
    STOPAR,
    ejecta_thickness,
    fresh_profile,
    largest_block,
    shallow_profile,
    small_crater_depth,
)
from rille.terrain.landform import Driver, Landform, Scattered, smooth_step
from rille.terrain.rock_laws import MOST_ROCKS, Build, draw_diameters, expected, rock_drivers

FADE = 0.7  # share of the extent from which the blanket thins out to exactly zero
DECAY = 0.7  # radii over which the density of blocks falls by e
INSIDE = 0.2  # density of blocks inside the rim over that at the rim
EXPONENT = 2.482
VIPER = "VIPER Environmental Specification VIPER-MSE-SPEC-001 (2021), as in NASA synthterrain"
RAYS = range(3, 14)  # harmonics of the azimuth


@lru_cache(maxsize=64)
def _ray_pattern(seed):
    """Azimuth and how much thicker the blanket is there: a closed curve of mean 0 within -1..1."""
    rng = np.random.default_rng([seed, 1])
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    waves = sum(rng.normal() * np.cos(k * turn + rng.uniform(0.0, 2.0 * np.pi)) for k in RAYS)
    return turn, waves / np.abs(waves).max()


def profile(x, y, drivers):
    """Bowl inside the rim; outside, the flank's uplift and ejecta t r^-3, thinned out over the last part of their extent.

    Ejecta make ``ejecta_share`` of the rim's height 0.0368 D; the rest is uplift, with the flank of Fassett & Thomson 2014.
    """
    diameter, share, extent = drivers["diameter"], drivers["ejecta_share"], drivers["extent"]
    r = np.hypot(x, y) / (diameter / 2)
    outside = np.maximum(r, RIM)
    blanket = share * RIM_HEIGHT * (outside / RIM) ** -3.0 * smooth_step((extent - r) / ((1.0 - FADE) * extent))
    if drivers["rays"] > 0.0:
        turn, waves = _ray_pattern(round(drivers["seed"]))
        along = np.interp(np.mod(np.arctan2(y, x), 2.0 * np.pi), turn, waves)
        blanket = blanket * (1.0 + drivers["rays"] * along * smooth_step((r - RIM) / 0.5))
    flank = (1.0 - share) * np.where(r < REACH, fresh_profile(outside), 0.0)
    return diameter * np.where(r <= RIM, shallow_profile(r, drivers["depth_ratio"]), flank + blanket)


def ejecta_share(drivers):
    """Thickness at the rim over its height, at most 1."""
    radius = drivers["diameter"] / 2
    return np.minimum(ejecta_thickness(radius) * RIM**-3.0 / (RIM_HEIGHT * drivers["diameter"]), 1.0)


def density(r):
    """Blocks per area at r = distance / radius over that at the rim."""
    return np.where(r < 1.0, INSIDE, np.exp(-(r - 1.0) / DECAY))


def _within(extent):
    """Distances over radius (n,), and the area [radii^2] within them, weighted by the density of blocks."""
    r = np.linspace(0.0, extent, 4001)
    ring = 2.0 * np.pi * r * density(r)
    return r, np.concatenate([[0.0], np.cumsum((ring[1:] + ring[:-1]) / 2.0 * np.diff(r))])


def _law(drivers):
    return lambda d: drivers["blocks"] * np.asarray(d, np.float64) ** -EXPONENT


def count(drivers):
    """Mean number of blocks."""
    area = _within(drivers["extent"])[1][-1] * (drivers["diameter"] / 2) ** 2
    return expected(_law(drivers), drivers["smallest"], drivers["largest"], area) if drivers["blocks"] > 0.0 else 0.0


def children(drivers):
    """Blocks around the rim (Poisson)."""
    rng = np.random.default_rng(round(drivers["seed"]))
    n = int(rng.poisson(count(drivers)))
    if n == 0:
        return ()
    diameter = draw_diameters(rng, _law(drivers), drivers["smallest"], drivers["largest"], n)
    r, within = _within(drivers["extent"])
    distance = np.interp(rng.random(n) * within[-1], within, r) * drivers["diameter"] / 2
    turn, heading = rng.uniform(0.0, 2.0 * math.pi, (2, n))
    build = Build(embedded=drivers["embedded"], angularity=0.5)
    return (
        Scattered(
            landform="rock",
            x=distance * np.cos(turn),
            y=distance * np.sin(turn),
            heading=heading,
            drivers=rock_drivers(rng, diameter, build),
        ),
    )


def check(drivers):
    """Sizes of blocks in order, and not more of them than a landform may hold."""
    if drivers["smallest"] >= drivers["largest"]:
        return f"smallest block is {drivers['smallest']:g} m and largest {drivers['largest']:g} m; smallest must be below largest"
    blocks = count(drivers)
    if blocks > MOST_ROCKS:
        return f"it would hold about {blocks:.0f} blocks, more than {MOST_ROCKS}; raise smallest or lower blocks"
    return ""


def outline(drivers):
    """The blanket where it is not yet thinned out."""
    turn = np.arange(64) * (2.0 * np.pi / 64)
    return FADE * drivers["extent"] * drivers["diameter"] / 2 * np.column_stack([np.cos(turn), np.sin(turn)])


LANDFORM = Landform(
    name="ejecta_crater",
    meaning="fresh crater with ejecta blanket, rays and blocks around it",
    frame="origin at the centre, height zero at the ground before the impact",
    source=f"{FASSETT_THOMSON}; T. R. McGetchin et al. 1973, Earth Planet. Sci. Lett. 20, 226: t = 0.14 R^0.74 r^-3",
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="rim to rim",
            lower=1.0,
            upper=15000.0,
            reason="larger craters on the Moon are complex, smaller ones throw out no blocks",
            source="R. J. Pike 1974, Geophys. Res. Lett. 1, 291: simple craters end at 10 to 15 km",
        ),
        Driver(
            name="depth_ratio",
            unit="dimensionless",
            meaning="rim to floor over diameter; inside the rim depths are scaled, the rim stays 0.0368 diameter high",
            lower=0.04,
            upper=0.25,
            link=lambda drivers: small_crater_depth(drivers["diameter"]),
            law="0.21, 0.17, 0.15, 0.13 from 400, 200, 100, 40 m, 0.11 and 0.10 below (Stopar et al. 2017)",
            reason="at 0.25 the wall stands at 33 deg, about as steep as loose soil can; below 0.04 the floor would lie above the ground",
            source=STOPAR,
        ),
        Driver(
            name="ejecta_share",
            unit="dimensionless",
            meaning="share of ejecta in the height of the rim; the rest is uplift",
            lower=0.0,
            upper=1.0,
            link=ejecta_share,
            law="0.14 (diameter / 2)^0.74 m of ejecta (McGetchin et al. 1973) over the rim height, at most 1 (below 30 m of diameter)",
            reason="a rim holds no more ejecta than its height",
            source="McGetchin et al. 1973; 0.45 with 0.033 R of V. L. Sharpton 2014, J. Geophys. Res. Planets 119, 154",
        ),
        Driver(
            name="extent",
            unit="dimensionless",
            meaning="radii from the centre to where the blanket has thinned out; over the last third it falls below r^-3",
            lower=2.0,
            upper=8.0,
            default=3.0,
            reason="within 2 radii it is continuous; beyond 8 it is thinner than 0.002 of the rim",
            source="rille",
        ),
        Driver(
            name="rays",
            unit="dimensionless",
            meaning="how much thicker and thinner than its mean the blanket gets around the crater",
            lower=0.0,
            upper=0.9,
            default=0.4,
            reason="at 1 it would be bare between the rays",
            source="rille",
        ),
        Driver(
            name="blocks",
            unit="1/m^2",
            meaning=f"those of at least 1 m per m^2 at the rim; N(>= D) = blocks D^-{EXPONENT}, falling outside as exp(-(r - 1) / {DECAY})",
            lower=0.0,
            upper=0.05,
            default=0.0003,
            reason="0.05 covers a tenth of the ground with blocks of 1 m",
            source=VIPER,
        ),
        Driver(
            name="largest",
            unit="m",
            meaning="diameter of the largest block",
            lower=0.02,
            upper=100.0,
            link=lambda drivers: np.minimum(largest_block(drivers["diameter"]), 100.0),
            law="0.29 diameter^(2/3), at most 100 m (Bart & Melosh 2007, from memory)",
            reason="larger blocks are hills",
            source="G. D. Bart & H. J. Melosh 2007, Geophys. Res. Lett. 34, L07203 (from memory)",
        ),
        Driver(
            name="smallest",
            unit="m",
            meaning="diameter of the smallest block",
            lower=0.01,
            upper=50.0,
            link=lambda drivers: np.maximum(drivers["largest"] / 20.0, 0.01),
            law="largest / 20, at least 0.01 m",
            reason="smaller ones are soil",
            source="rille",
        ),
        Driver(
            name="embedded",
            unit="dimensionless",
            meaning="mean fraction of the blocks' height below the ground, +- 0.2",
            lower=0.0,
            upper=0.95,
            default=0.3,
            reason="nothing is seen of blocks that are embedded entirely",
            source="rille: no published law was found",
        ),
        Driver(
            name="seed",
            unit="dimensionless",
            meaning="another number gives other rays and blocks",
            lower=0.0,
            upper=2147483647.0,
            default=1.0,
            reason="a seed is a whole number of 31 bits",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: (drivers["extent"] * drivers["diameter"] / 2, drivers["extent"] * drivers["diameter"] / 2),
    outline=outline,
    children=children,
    check=check,
    example={"diameter": 24.0, "depth_ratio": 0.17, "blocks": 0.003, "seed": 5.0},
)
