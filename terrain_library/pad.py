"""Level pad with an embankment."""

import numpy as np

from rille.terrain.landform import Driver, Landform, smooth_step
from rille.terrain.relief import bank, bank_run, box_distance


def _run(drivers):
    """Horizontal length of the embankment [m]."""
    return bank_run(drivers["rounding"], drivers["rounding"]) * abs(drivers["height"]) / np.tan(drivers["bank"])


def profile(x, y, drivers):
    """Its height on the pad, an embankment of the given slope all around (corners are parts of cones), 0 beyond."""
    height = drivers["height"]
    d = box_distance(x, y, drivers["length"] / 2, drivers["width"] / 2)
    fall = bank(d * np.tan(drivers["bank"]) / max(abs(height), 1e-300), drivers["rounding"], drivers["rounding"])
    return height * fall


def weight(x, y, drivers):
    """1 on pad and embankment; falls to 0 over the shoulder."""
    d = box_distance(x, y, drivers["length"] / 2, drivers["width"] / 2)
    return smooth_step((_run(drivers) + drivers["shoulder"] - d) / drivers["shoulder"])


def footprint(drivers):
    """Pad, embankment and shoulder."""
    more = _run(drivers) + drivers["shoulder"]
    return float(drivers["length"] / 2 + more), float(drivers["width"] / 2 + more)


def outline(drivers):
    """Pad and embankment."""
    half_x, half_y = drivers["length"] / 2 + _run(drivers), drivers["width"] / 2 + _run(drivers)
    return np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])


LANDFORM = Landform(
    name="pad",
    meaning="level pad that replaces the ground, on (or cut into) it with an embankment",
    frame="origin in the middle, x along its length, height zero at the mean ground around it",
    source="rille: box with a bank of constant slope",
    drivers=(
        Driver(name="length", unit="m", meaning="of the level part", lower=0.1, upper=5000.0, reason="a wheel at least", source="rille"),
        Driver(
            name="width",
            unit="m",
            meaning="of the level part",
            lower=0.1,
            upper=5000.0,
            link=lambda values: values["length"],
            law="length",
            reason="a wheel at least",
            source="rille",
        ),
        Driver(
            name="height",
            unit="m",
            meaning="above the mean ground around it; negative: cut into it",
            lower=-100.0,
            upper=100.0,
            default=0.0,
            reason="higher is no pad",
            source="rille",
        ),
        Driver(
            name="bank",
            unit="rad",
            meaning="slope of the embankment",
            lower=0.05,
            upper=1.5,
            default=np.deg2rad(30.0),
            reason="flatter is no bank; a height field holds no overhang",
            source="rille: below the angle of repose of 25 to 40 deg (Kleinhans et al. 2011)",
        ),
        Driver(
            name="rounding",
            unit="dimensionless",
            meaning="share of the embankment that is rounded at each edge",
            lower=0.0,
            upper=1.0,
            default=0.2,
            reason="at 1 the roundings meet",
            source="rille",
        ),
        Driver(
            name="shoulder",
            unit="m",
            meaning="distance beyond over which it joins uneven ground",
            lower=0.05,
            upper=1000.0,
            link=lambda values: max(0.15 * min(values["length"], values["width"]), 0.05),
            law="0.15 of the shorter side",
            reason="shorter is a wall on uneven ground",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=footprint,
    weight=weight,
    outline=outline,
    blend="replace",
    level=True,
    example={"length": 6.0, "width": 4.0, "height": 0.5},
)
