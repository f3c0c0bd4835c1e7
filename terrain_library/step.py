"""Step: a ledge that a rover climbs or drops from."""

import numpy as np

from rille.terrain.landform import Driver, Landform, smooth_step


def profile(x, y, drivers):
    """A face from x = 0 up to the height, a level tread, then smooth shoulders down to the ground behind and on both sides.

    face: z = x tan(angle), 0 <= x <= height / tan(angle); at 90 deg the height stands from the first value with x > 0 on.
    """
    height, shoulder = drivers["height"], drivers["shoulder"]
    face = np.clip(x * np.tan(drivers["angle"]) / height, 0.0, 1.0)
    behind = smooth_step((_run(drivers) + drivers["length"] + shoulder - x) / shoulder)
    aside = smooth_step((drivers["width"] / 2 + shoulder - np.abs(y)) / shoulder)
    return height * face * behind * aside


def _run(drivers):
    return drivers["height"] / np.tan(drivers["angle"])


def outline(drivers):
    """From the foot of the face to the end of the shoulders."""
    far, half = _run(drivers) + drivers["length"] + drivers["shoulder"], drivers["width"] / 2 + drivers["shoulder"]
    return np.array([[0.0, -half], [far, -half], [far, half], [0.0, half]])


LANDFORM = Landform(
    name="step",
    meaning="ledge with a face, a level tread, and shoulders behind and beside it",
    frame="origin at the foot of the face in the middle of its width, x up the step, height zero at the foot",
    source="rille: plane face, cubic shoulders",
    drivers=(
        Driver(
            name="height",
            unit="m",
            meaning="of the tread above the foot",
            lower=0.001,
            upper=100.0,
            reason="from pebbles to cliffs",
            source="rille",
        ),
        Driver(
            name="width",
            unit="m",
            meaning="of the tread across",
            lower=0.05,
            upper=10000.0,
            reason="narrower than a wheel is a rock",
            source="rille",
        ),
        Driver(
            name="length",
            unit="m",
            meaning="of the tread, before it falls back",
            lower=0.05,
            upper=10000.0,
            reason="shorter is an edge",
            source="rille",
        ),
        Driver(
            name="angle",
            unit="rad",
            meaning="slope of the face",
            lower=0.1,
            upper=np.pi / 2,
            default=np.pi / 2,
            reason="a height field holds no overhang; between two heights a wall has their distance as its run",
            source="rille",
        ),
        Driver(
            name="shoulder",
            unit="m",
            meaning="distance over which it falls back to the ground",
            lower=0.01,
            upper=1000.0,
            link=lambda values: max(4 * values["height"], 0.01),
            law="4 height, at least 0.01 m",
            reason="shorter is a second face",
            source="rille: steepest shoulder 1.5 height / shoulder, 21 deg",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: (
        float(_run(drivers) + drivers["length"] + drivers["shoulder"]),
        float(drivers["width"] / 2 + drivers["shoulder"]),
    ),
    outline=outline,
    steep=True,
    example={"height": 0.4, "width": 3.0, "length": 2.0},
)
