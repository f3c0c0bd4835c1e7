"""Rocks scattered by a size-frequency law: what a rock field and a crater's ejecta share."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Number = Callable[[Array], Array]

MOST_ROCKS = 50_000  # of one landform; more belong in a population

HEIGHT = (0.35, 0.65)  # height over diameter, uniform: about half as high as wide (M. P. Golombek et al. 2003)
ASPECT = (0.6, 1.0)  # width over length, uniform
SPREAD = 0.2  # of angularity and embedded fraction to either side of what is asked for


def expected(number: Number, smallest: float, largest: float, area: float) -> float:
    """Mean number of rocks between two diameters [m] on an ``area`` [m^2]; number : D -> N(>= D) per m^2."""
    return max(float((number(np.asarray(smallest)) - number(np.asarray(largest))) * area), 0.0)


def draw_diameters(rng: np.random.Generator, number: Number, smallest: float, largest: float, count: int) -> Array:
    """Diameters [m] (count,), largest last, of a law N(>= D): its cumulative form inverted on a table of 2048 steps in log D."""
    if count == 0:
        return np.empty(0)
    table = np.geomspace(smallest, largest, 2048)
    above = number(table)
    share = (above - above[-1]) / (above[0] - above[-1])  # falls from 1 to 0
    return np.sort(np.exp(np.interp(rng.random(count), share[::-1], np.log(table[::-1]))))


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """How rocks of a scatter look on average. embedded, angularity : see the landform ``rock``."""

    embedded: float
    angularity: float


def rock_drivers(rng: np.random.Generator, diameter: Array, build: Build) -> dict[str, Array]:
    """Drivers of the landform ``rock``, each (n,), for rocks of these diameters [m]."""
    n = len(diameter)
    return {
        "diameter": diameter,
        "height": diameter * rng.uniform(*HEIGHT, n),
        "aspect": rng.uniform(*ASPECT, n),
        "embedded": np.clip(build.embedded + rng.uniform(-SPREAD, SPREAD, n), 0.0, 0.95),
        "angularity": np.clip(build.angularity + rng.uniform(-SPREAD, SPREAD, n), 0.0, 1.0),
    }
