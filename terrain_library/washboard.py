"""Washboard: bars across a test lane."""

import numpy as np

from rille.terrain.landform import Driver, Landform
from rille.terrain.relief import ends


def _bars(drivers):
    """Number of whole bars in the length; at least one."""
    return max(int(np.floor(drivers["length"] / drivers["spacing"] + 1e-9)), 1)


def check(drivers):
    """Bars do not overlap."""
    if drivers["bar"] <= drivers["spacing"]:
        return ""
    return f"its bars are {drivers['bar']:g} m long, more than their spacing of {drivers['spacing']:g} m; make them shorter"


def profile(x, y, drivers):
    """Bars of equal spacing: half sine h cos(pi u / b) (shape 0), trapezoid with a level top (shape 1), or a mixture; u from its middle."""
    spacing, bar, shape = drivers["spacing"], drivers["bar"], drivers["shape"]
    middle = (_bars(drivers) - 1) / 2
    u = np.abs(x - (np.clip(np.round(x / spacing + middle), 0, 2 * middle) - middle) * spacing)
    rest = np.maximum(bar / 2 - u, 0.0)
    sine = np.where(rest > 0, np.cos(np.pi * np.minimum(u / bar, 0.5)), 0.0)
    trapezoid = np.minimum(rest / ((1 - drivers["top"]) * bar / 2), 1.0)
    across = ends(y, drivers["width"] / 2 + drivers["side"], drivers["side"])
    return drivers["height"] * ((1 - shape) * sine + shape * trapezoid) * across


LANDFORM = Landform(
    name="washboard",
    meaning="bars across a lane, as in vehicle test courses: half sines or trapezoids",
    frame="origin in the middle of the lane, x along the drive, height zero at the ground between the bars",
    source="rille: half sines h sin(pi s / bar), trapezoids",
    drivers=(
        Driver(
            name="length",
            unit="m",
            meaning="of the lane; it holds floor(length / spacing) bars, at least one",
            lower=0.05,
            upper=1000.0,
            reason="one bar at least",
            source="rille",
        ),
        Driver(name="width", unit="m", meaning="of the lane", lower=0.05, upper=100.0, reason="a wheel at least", source="rille"),
        Driver(
            name="height",
            unit="m",
            meaning="of the bars",
            lower=-1.0,
            upper=1.0,
            reason="negative: grooves; more is a step",
            source="rille",
        ),
        Driver(name="spacing", unit="m", meaning="from bar to bar", lower=0.02, upper=50.0, reason="shorter is roughness", source="rille"),
        Driver(
            name="bar",
            unit="m",
            meaning="length of a bar along the drive, at most the spacing",
            lower=0.01,
            upper=50.0,
            link=lambda values: 0.5 * values["spacing"],
            law="0.5 spacing",
            reason="bars do not overlap",
            source="rille",
        ),
        Driver(
            name="shape",
            unit="dimensionless",
            meaning="0: half sine; 1: trapezoid; between: a mixture",
            lower=0.0,
            upper=1.0,
            default=0.0,
            reason="two shapes",
            source="rille",
        ),
        Driver(
            name="top",
            unit="dimensionless",
            meaning="level share of a trapezoid",
            lower=0.0,
            upper=0.95,
            default=0.4,
            reason="0: a roof; flanks need some length",
            source="rille",
        ),
        Driver(
            name="side",
            unit="m",
            meaning="distance beside the lane over which the bars fade",
            lower=0.005,
            upper=50.0,
            link=lambda values: max(2 * abs(values["height"]), 0.02),
            law="2 height, at least 0.02 m",
            reason="shorter is a wall",
            source="rille",
        ),
    ),
    profile=profile,
    check=check,
    footprint=lambda drivers: (
        float((_bars(drivers) - 1) * drivers["spacing"] / 2 + drivers["bar"] / 2 + 0.1 * drivers["spacing"]),
        float(drivers["width"] / 2 + drivers["side"]),
    ),
    example={"length": 8.0, "width": 3.0, "height": 0.1, "spacing": 1.0},
)
