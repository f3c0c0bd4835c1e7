"""Straight ramp between two levels."""

import numpy as np

from rille.terrain.landform import Driver, Landform, smooth_step


def profile(x, y, drivers):
    """Rises along +x at ``angle`` over ``length``, then falls back over the shoulder; blends to the sides over the shoulder, too."""
    length, width, shoulder = drivers["length"], drivers["width"], drivers["shoulder"]
    ascent = np.tan(drivers["angle"]) * np.clip(x + length / 2, 0.0, length)
    beyond = smooth_step((length / 2 + shoulder - x) / shoulder)
    aside = smooth_step((width / 2 + shoulder - np.abs(y)) / shoulder)
    return ascent * beyond * aside


LANDFORM = Landform(
    name="slope",
    meaning="straight ramp of constant angle",
    frame="origin in the middle of the ramp's plan, x uphill, height zero at its foot",
    source="rille: plane with cubic shoulders",
    drivers=(
        Driver(
            name="angle",
            unit="rad",
            meaning="slope",
            lower=-0.79,
            upper=0.79,
            reason="loose soil slides beyond its friction angle, at most about 45 deg",
            source="rille",
        ),
        Driver(
            name="length",
            unit="m",
            meaning="length of the ramp in plan",
            lower=0.1,
            upper=10000.0,
            reason="shorter is a step",
            source="rille",
        ),
        Driver(
            name="width", unit="m", meaning="width of the ramp", lower=0.1, upper=10000.0, reason="narrower than a wheel", source="rille"
        ),
        Driver(
            name="shoulder",
            unit="m",
            meaning="distance over which it blends out",
            lower=0.1,
            upper=1000.0,
            default=2.0,
            reason="shorter is a step",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: (drivers["length"] / 2 + drivers["shoulder"], drivers["width"] / 2 + drivers["shoulder"]),
    example={"angle": 0.15, "length": 4.0, "width": 3.0},
)
