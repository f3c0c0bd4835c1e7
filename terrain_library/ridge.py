"""Ridge, straight or bent, with ends that fade."""

import numpy as np

from rille.terrain.landform import Driver, Landform
from rille.terrain.relief import arc_coordinates, ends, ribbon


def profile(x, y, drivers):
    """h cos^2 across the crest, fading over its ends.

    z = h cos^2(pi n / (2 b)) ends(s): s, n place along the arc and offset to its left; b half width, w (1 - a) / 2 on the left of the
    crest and w (1 + a) / 2 on the right, measured from the crest, which stands a w / 2 to the left of the middle. Steepest slope
    pi h / (2 b).
    """
    length, width = drivers["length"], drivers["width"]
    s, n = arc_coordinates(x, y, drivers["bend"] / length)
    lean = drivers["asymmetry"]
    n = n - lean * width / 2
    half = np.where(n > 0, (1 - lean) * width / 2, (1 + lean) * width / 2)
    u = np.minimum(np.abs(n) / half, 1.0)
    across = np.where(u < 1.0, np.cos(np.pi / 2 * u) ** 2, 0.0)
    return drivers["height"] * across * ends(s, length / 2, drivers["fade"])


def check(drivers):
    """An arc whose radius is less than half of the width meets itself."""
    length, width, bend = drivers["length"], drivers["width"], abs(drivers["bend"])
    if bend * width <= 2 * length:
        return ""
    return (
        f"it is {width:g} m wide and bends by {np.rad2deg(bend):.3g} deg over {length:g} m, so tightly that it meets itself; bend it by "
        f"less than {np.rad2deg(2 * length / width):.3g} deg, or make it longer or narrower"
    )


def footprint(drivers):
    """The arc, and half a width around it."""
    length, width, bend = drivers["length"], drivers["width"], abs(drivers["bend"])
    half = bend / 2
    reach_x = length / 2 if bend == 0 else length / bend * np.sin(half)
    reach_y = 0.0 if bend == 0 else length / bend * (1 - np.cos(half))
    return float(reach_x + width / 2), float(reach_y + width / 2)


def outline(drivers):
    """A band along the arc."""
    length, curvature = drivers["length"], drivers["bend"] / drivers["length"]
    s = np.linspace(-length / 2, length / 2, 33)
    direction = curvature * s
    if curvature == 0:
        return ribbon(s, 0 * s, direction, drivers["width"] / 2)
    return ribbon(np.sin(direction) / curvature, (1 - np.cos(direction)) / curvature, direction, drivers["width"] / 2)


LANDFORM = Landform(
    name="ridge",
    meaning="ridge, straight or bent to an arc, its ends fading; a wrinkle ridge by default",
    frame="origin on the middle of its length, x along it, height zero at its foot; a positive bend turns left",
    source="rille: squared cosine along an arc; volume height width (length - fade) / 2 where straight",
    drivers=(
        Driver(
            name="length",
            unit="m",
            meaning="end to end, along the arc",
            lower=0.5,
            upper=50000.0,
            reason="of the longest on the Moon",
            source="rille",
        ),
        Driver(
            name="width", unit="m", meaning="foot to foot", lower=0.1, upper=10000.0, reason="of the widest on the Moon", source="rille"
        ),
        Driver(
            name="height",
            unit="m",
            meaning="height of the crest",
            lower=-1000.0,
            upper=1000.0,
            link=lambda values: 0.084 * values["width"],
            law="0.084 width",
            reason="negative: a trough; no ridge is higher",
            source="mean height 0.31 km and width 3.70 km of 2839 lunar wrinkle ridges: Yue et al. 2015, J. Geophys. Res. Planets 120, 978",
        ),
        Driver(
            name="bend",
            unit="rad",
            meaning="turn from end to end",
            lower=-np.pi,
            upper=np.pi,
            default=0.0,
            reason="half a circle",
            source="rille",
        ),
        Driver(
            name="asymmetry",
            unit="dimensionless",
            meaning="how far the crest stands to the left of the middle, in half widths; the left side is the steeper one then",
            lower=-0.8,
            upper=0.8,
            default=0.0,
            reason="beyond, one side is nearly a wall",
            source="rille",
        ),
        Driver(
            name="fade",
            unit="m",
            meaning="length over which each end fades, at most half of the length",
            lower=0.05,
            upper=25000.0,
            link=lambda values: min(2 * values["width"], values["length"] / 3),
            law="2 width, at most length / 3",
            reason="half of the longest ridge",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=footprint,
    outline=outline,
    check=check,
    example={"length": 14.0, "width": 3.0, "height": 0.5, "bend": 1.0, "asymmetry": 0.3},
)
