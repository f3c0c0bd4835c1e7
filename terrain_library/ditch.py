"""Ditch: a trench with the soil that was dug out of it on both sides."""

import numpy as np

from rille.terrain.landform import Driver, Landform
from rille.terrain.relief import bank, bank_run, ends


def section(drivers):
    """Of the cross-section: half width of the trench, its area, height of the spoil, half width of one spoil bank [m, m^2, m, m].

    Trench: A = depth (floor + run), run = (1 + rounding) depth / tan(bank), since a rounded bank holds half of its run. Spoil: two
    ridges of two flanks each, A swell = 2 h^2 (1 + rounding) / tan(repose).
    """
    depth, rounding = drivers["depth"], drivers["rounding"]
    run = bank_run(rounding, rounding) * depth / np.tan(drivers["bank"])
    area = depth * (drivers["floor"] + run)
    height = np.sqrt(area * drivers["swell"] * np.tan(drivers["repose"]) / (2 * bank_run(rounding, rounding)))
    return drivers["floor"] / 2 + run, area, height, bank_run(rounding, rounding) * height / np.tan(drivers["repose"])


def profile(x, y, drivers):
    """Trench and spoil banks fade together over the ends, so every cross-section holds as much spoil as was cut (times swell)."""
    depth, rounding = drivers["depth"], drivers["rounding"]
    half, _, height, half_spoil = section(drivers)
    n = np.abs(y)
    trench = -depth * bank((n - drivers["floor"] / 2) * np.tan(drivers["bank"]) / depth, rounding, rounding)
    crest = half + drivers["berm"] + half_spoil
    slope = np.tan(drivers["repose"]) / max(height, 1e-300)
    spoil = height * bank(np.abs(n - crest) * slope, rounding, rounding)
    return (trench + spoil) * ends(x, drivers["length"] / 2, drivers["fade"])


def footprint(drivers):
    """Its length, and out to the foot of the spoil."""
    half, _, _, half_spoil = section(drivers)
    return drivers["length"] / 2, float(half + drivers["berm"] + 2 * half_spoil)


LANDFORM = Landform(
    name="ditch",
    meaning="trench with spoil banks on both sides; at swell 1 the spoil's volume is the cut's",
    frame="origin on the middle of its floor line, x along it, height zero at the ground before digging",
    source=(
        "rille: trapezoid with rounded edges, spoil at its angle of repose; "
        "cut volume (length - fade) depth (floor + (1 + rounding) depth / tan(bank))"
    ),
    drivers=(
        Driver(name="length", unit="m", meaning="end to end", lower=0.2, upper=10000.0, reason="shorter ones are holes", source="rille"),
        Driver(
            name="depth",
            unit="m",
            meaning="floor below the ground",
            lower=0.005,
            upper=100.0,
            reason="from wheel tracks to quarries",
            source="rille",
        ),
        Driver(
            name="floor",
            unit="m",
            meaning="width of the floor",
            lower=0.0,
            upper=1000.0,
            link=lambda values: 0.5 * values["depth"],
            law="0.5 depth",
            reason="0 is a V",
            source="rille",
        ),
        Driver(
            name="bank",
            unit="rad",
            meaning="slope of the trench's walls",
            lower=0.1,
            upper=1.5,
            default=np.deg2rad(50.0),
            reason="undisturbed soil holds steep walls, but a height field none that hang over",
            source="rille",
        ),
        Driver(
            name="repose",
            unit="rad",
            meaning="slope of the spoil",
            lower=0.1,
            upper=0.79,
            default=np.deg2rad(35.0),
            reason="loose soil slides beyond its friction angle, at most about 45 deg",
            source="25 deg (rounded grains) to 40 deg (angular): Kleinhans et al. 2011, J. Geophys. Res. 116, E11004",
        ),
        Driver(
            name="berm",
            unit="m",
            meaning="level ground between trench and spoil",
            lower=0.0,
            upper=100.0,
            link=lambda values: 0.3 * values["depth"],
            law="0.3 depth",
            reason="0: the spoil begins at the rim",
            source="rille",
        ),
        Driver(
            name="swell",
            unit="dimensionless",
            meaning="volume of the spoil over that of the cut; 1 conserves volume",
            lower=0.0,
            upper=1.6,
            default=1.0,
            reason="0: the soil was carried away; dense soil loosens by less than 1.6",
            source="rille",
        ),
        Driver(
            name="rounding",
            unit="dimensionless",
            meaning="share of banks and flanks that is rounded at each edge",
            lower=0.0,
            upper=1.0,
            default=0.2,
            reason="at 1 the roundings meet",
            source="rille",
        ),
        Driver(
            name="fade",
            unit="m",
            meaning="length over which each end fades, at most half of the length",
            lower=0.01,
            upper=5000.0,
            link=lambda values: max(min(2 * values["depth"], values["length"] / 4), 0.01),
            law="2 depth, at most length / 4",
            reason="half of the longest ditch",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=footprint,
    conserves="volume",
    example={"length": 8.0, "depth": 0.6, "floor": 0.6},
)
