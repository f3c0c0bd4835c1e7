"""Sine test track for the wheels of one or both sides."""

import numpy as np

from rille.terrain.landform import Driver, Landform, smooth_step
from rille.terrain.relief import ends


def _sides(drivers):
    """Distance [m] over which a track fades towards the other one and outwards."""
    outer = drivers["side"]
    return (min(outer, (drivers["gauge"] - drivers["track"]) / 2) if drivers["gauge"] > 0 else outer), outer


def check(drivers):
    """Two tracks lie beside each other."""
    if drivers["gauge"] == 0 or drivers["gauge"] > drivers["track"]:
        return ""
    return (
        f"its two tracks are {drivers['track']:g} m wide and {drivers['gauge']:g} m apart, so they overlap; widen the gauge, narrow the "
        "tracks, or take gauge = 0 for one track"
    )


def profile(x, y, drivers):
    """h/2 sin(2 pi x' / wavelength + phase) on each track, x' from its beginning; it grows and fades over ``fade``.

    The track named left lies at y = +gauge/2 and has phase 0; the one named right at -gauge/2 leads it by ``phase``.
    """
    length, half_track = drivers["length"], drivers["track"] / 2
    inner, outer = _sides(drivers)
    along = 2 * np.pi * (x + length / 2) / drivers["wavelength"]
    tracks = ((1.0, 0.0), (-1.0, drivers["phase"])) if drivers["gauge"] > 0 else ((1.0, 0.0),)
    height = np.zeros(np.broadcast(x, y).shape)
    for side, phase in tracks:
        outwards = side * y - drivers["gauge"] / 2
        over = np.where(outwards > 0, (half_track + outer - outwards) / outer, (half_track + inner + outwards) / inner)
        height += np.sin(along + phase) * smooth_step(over)
    return drivers["height"] / 2 * height * ends(x, length / 2, drivers["fade"])


def footprint(drivers):
    """Its length, and both tracks with their outer sides."""
    return drivers["length"] / 2, drivers["gauge"] / 2 + drivers["track"] / 2 + drivers["side"]


LANDFORM = Landform(
    name="sine_track",
    meaning="sine waves under the left and the right wheels, with a phase between them; or under all",
    frame="origin in the middle, x along the drive, tracks named left (+y) and right (-y), height zero at the mean level",
    source="rille: sine",
    drivers=(
        Driver(name="length", unit="m", meaning="of the track", lower=0.1, upper=1000.0, reason="a wave at least", source="rille"),
        Driver(name="wavelength", unit="m", meaning="of the sine", lower=0.02, upper=100.0, reason="shorter is roughness", source="rille"),
        Driver(
            name="height",
            unit="m",
            meaning="trough to crest: twice the amplitude",
            lower=0.0005,
            upper=5.0,
            reason="more is a hill",
            source="rille",
        ),
        Driver(
            name="gauge",
            unit="m",
            meaning="distance of the middle lines of the tracks; 0: one track for all wheels",
            lower=0.0,
            upper=20.0,
            default=0.0,
            reason="as wide as a large vehicle",
            source="rille",
        ),
        Driver(
            name="track",
            unit="m",
            meaning="width of a track",
            lower=0.02,
            upper=50.0,
            link=lambda values: values["gauge"] / 2 if values["gauge"] > 0.04 else 3.0,
            law="gauge / 2; 3 m for one track",
            reason="a wheel at least",
            source="rille",
        ),
        Driver(
            name="phase",
            unit="rad",
            meaning="by which the right track leads the left one",
            lower=-2 * np.pi,
            upper=2 * np.pi,
            default=np.pi,
            reason="a whole wave",
            source="rille: half a wave twists the chassis most",
        ),
        Driver(
            name="fade",
            unit="m",
            meaning="length over which the waves grow and fade, at most half of the track",
            lower=0.01,
            upper=500.0,
            link=lambda values: min(values["wavelength"], values["length"] / 4),
            law="a wavelength, at most length / 4",
            reason="half of the longest track",
            source="rille",
        ),
        Driver(
            name="side",
            unit="m",
            meaning="distance over which a track fades sideways; between tracks at most half of the gap",
            lower=0.005,
            upper=50.0,
            link=lambda values: max(2 * values["height"], 0.02),
            law="2 height, at least 0.02 m",
            reason="shorter is a wall",
            source="rille",
        ),
    ),
    profile=profile,
    check=check,
    footprint=footprint,
    example={"length": 12.0, "wavelength": 2.0, "height": 0.3, "gauge": 2.4, "track": 1.0},
)
