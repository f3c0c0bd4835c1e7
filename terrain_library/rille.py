"""Rille: a sinuous channel."""

import numpy as np

from rille.terrain.landform import Driver, Landform
from rille.terrain.relief import bank, bank_run, ends, meander, meander_refusal, ribbon


def _floor(drivers):
    """Width of the floor [m]: what both banks leave of the width."""
    return drivers["width"] - 2 * bank_run(drivers["rounding"], drivers["rounding"]) * drivers["depth"] / np.tan(drivers["bank"])


def check(drivers):
    """There must be room for the banks, and meanders that do not cross."""
    floor = _floor(drivers)
    if floor < 0:
        return (
            f"banks of {np.rad2deg(drivers['bank']):.3g} deg and {drivers['depth']:g} m need {drivers['width'] - floor:.4g} m, more "
            f"than its width of {drivers['width']:g} m; make it shallower or wider, or its banks steeper"
        )
    return meander_refusal(drivers["length"], drivers["wavelength"], drivers["amplitude"])


def profile(x, y, drivers):
    """-depth on the floor, banks of the given slope with rounded edges up to the rim, a levee (squared sine) outside; ends fade.

    The distance d is taken from the centre line, a sine-generated curve (Langbein & Leopold 1966), so slopes hold in bends, too.
    """
    width, depth, levee = drivers["width"], drivers["depth"], drivers["levee_width"]
    line = meander(drivers["length"], drivers["wavelength"], drivers["amplitude"])
    reach = width / 2 + (levee if drivers["levee"] > 0 else 0.0)
    s, d = line.coordinates(x, y, reach)
    inside = d < reach
    d, s = np.where(inside, d, reach), np.where(inside, s, 0.0)
    channel = -depth * bank((d - _floor(drivers) / 2) * np.tan(drivers["bank"]) / depth, drivers["rounding"], drivers["rounding"])
    outside = np.clip((d - width / 2) / levee, 0.0, 1.0)
    height = channel + drivers["levee"] * np.sin(np.pi * outside) ** 2
    return np.where(inside, height * ends(s, float(line.s[-1]), drivers["fade"]), 0.0)


def footprint(drivers):
    """The centre line, and half of the width with its levees around it."""
    line = meander(drivers["length"], drivers["wavelength"], drivers["amplitude"])
    reach = drivers["width"] / 2 + (drivers["levee_width"] if drivers["levee"] > 0 else 0.0)
    return float(line.x.max() + reach), float(np.abs(line.y).max() + reach)


def outline(drivers):
    """A band along the centre line, rim to rim; 32 points a wavelength."""
    line = meander(drivers["length"], drivers["wavelength"], drivers["amplitude"])
    few = np.unique(np.append(np.arange(0, len(line.s), 8), len(line.s) - 1))
    return ribbon(line.x[few], line.y[few], line.direction[few], drivers["width"] / 2)


LANDFORM = Landform(
    name="rille",
    meaning="sinuous channel with floor, banks and, if asked for, levees; its ends fade",
    frame="origin on the middle of the centre line, x along the axis of its meanders, height zero at the plain beside it",
    source=(
        "centre line: W. B. Langbein & L. B. Leopold 1966, USGS Prof. Paper 422-H; its dimensions: D. E. Mecklenburg & A. D. Jayakaran "
        "2012, J. Am. Water Resour. Assoc. 48, 635; proportions: D. M. Hurwitz et al. 2013, Planet. Space Sci. 79, 1"
    ),
    drivers=(
        Driver(
            name="length",
            unit="m",
            meaning="end to end along the axis",
            lower=1.0,
            upper=600000.0,
            reason="the longest lunar rille is 566 km long",
            source="Hurwitz et al. 2013",
        ),
        Driver(
            name="width",
            unit="m",
            meaning="rim to rim",
            lower=0.1,
            upper=5000.0,
            reason="the widest lunar rille is 4.3 km wide",
            source="Hurwitz et al. 2013",
        ),
        Driver(
            name="depth",
            unit="m",
            meaning="floor below the plain",
            lower=0.01,
            upper=600.0,
            link=lambda values: 49.0 / 480.0 * values["width"],
            law="0.102 width",
            reason="the deepest lunar rille is 534 m deep",
            source="medians 49 m and 480 m of more than 200 lunar rilles: Hurwitz et al. 2013",
        ),
        Driver(
            name="bank",
            unit="rad",
            meaning="slope of the banks",
            lower=0.05,
            upper=1.4,
            default=np.deg2rad(25.0),
            reason="flatter ones are no banks, steeper ones need rock",
            source="rille: below the angle of repose of 25 to 40 deg (Kleinhans et al. 2011)",
        ),
        Driver(
            name="rounding",
            unit="dimensionless",
            meaning="share of the bank that is rounded at the rim and as much at the floor",
            lower=0.0,
            upper=1.0,
            default=0.3,
            reason="at 1 the two roundings meet",
            source="rille",
        ),
        Driver(
            name="wavelength",
            unit="m",
            meaning="of the meanders, along the axis",
            lower=0.5,
            upper=100000.0,
            link=lambda values: 11.0 * values["width"],
            law="11 width",
            reason="shorter ones are roughness",
            source="rivers, about 11 widths: L. B. Leopold & M. G. Wolman 1960, Geol. Soc. Am. Bull. 71, 769",
        ),
        Driver(
            name="amplitude",
            unit="m",
            meaning="of the meanders to each side of the axis; 0: straight",
            lower=0.0,
            upper=39000.0,
            link=lambda values: 0.1434 * values["wavelength"],
            law="0.1434 wavelength, which is a sinuosity of 1.19",
            reason="beyond 0.39 wavelengths a bend runs back on itself",
            source="median sinuosity 1.19: Hurwitz et al. 2013",
        ),
        Driver(
            name="levee",
            unit="m",
            meaning="height of the levees outside the rims; 0: none",
            lower=0.0,
            upper=100.0,
            default=0.0,
            reason="of the order of the depth at most",
            source="rille: lunar rilles show none",
        ),
        Driver(
            name="levee_width",
            unit="m",
            meaning="width of each levee",
            lower=0.05,
            upper=5000.0,
            link=lambda values: max(0.3 * values["width"], 0.05),
            law="0.3 width",
            reason="as wide as the widest rille",
            source="rille",
        ),
        Driver(
            name="fade",
            unit="m",
            meaning="length over which each end fades, at most half of the channel",
            lower=0.05,
            upper=300000.0,
            link=lambda values: max(min(2 * values["width"], values["length"] / 3), 0.05),
            law="2 width, at most length / 3",
            reason="half of the longest rille",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=footprint,
    outline=outline,
    check=check,
    example={"length": 30.0, "width": 2.4, "depth": 0.4, "wavelength": 13.0, "amplitude": 2.6},
)
