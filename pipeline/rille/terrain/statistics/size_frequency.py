"""Counts by diameter, with Poisson intervals: of what was asked for, placed and found."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Population

Array = NDArray[np.float64]

PER_OCTAVE = 2  # bins: the root-two bins of crater counting (Crater Analysis Techniques Working Group 1979)
LEVEL = 0.95


def edges(smallest: float, largest: float) -> Array:
    """Borders [m] of bins that hold the range: powers of the square root of two."""
    if not 0 < smallest < largest:
        return np.zeros(0)
    low, high = math.floor(math.log2(smallest) * PER_OCTAVE + 1e-9), math.ceil(math.log2(largest) * PER_OCTAVE - 1e-9)
    return 2.0 ** (np.arange(low, high + 1) / PER_OCTAVE)


def counts(diameter: Array, borders: Array) -> NDArray[np.int64]:
    """Number of diameters in each bin."""
    return np.histogram(diameter, borders)[0].astype(np.int64)


def poisson_band(expected: Array, level: float = LEVEL) -> tuple[Array, Array]:
    """Smallest and largest count between which a Poisson number of that mean lies with the probability ``level`` or more."""
    from scipy.stats import poisson

    tail = (1 - level) / 2
    return np.asarray(poisson.ppf(tail, expected), np.float64), np.asarray(poisson.ppf(1 - tail, expected), np.float64)


def poisson_interval(count: NDArray[Any], level: float = LEVEL) -> tuple[Array, Array]:
    """Interval of the mean that a count speaks for (Garwood 1936): quantiles of chi-squared / 2 with 2 n and 2 n + 2 degrees."""
    from scipy.stats import chi2

    tail = (1 - level) / 2
    low = np.where(count > 0, chi2.ppf(tail, np.maximum(2 * count, 1e-9)) / 2, 0.0)
    return low, np.asarray(chi2.ppf(1 - tail, 2 * count + 2) / 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Census:
    """What a population holds beside its law. borders (k + 1,) [m]; asked, low, high, placed (k,): numbers in each bin.

    The band [low, high] holds all bins together with at least 95 % (each with 1 - 0.05 / k). inside : all of them are in it.
    on_ground : some of its region lies on the ground; otherwise there is nothing to be counted.
    """

    borders: Array
    asked: Array
    low: Array
    high: Array
    placed: NDArray[np.int64]
    inside: bool
    on_ground: bool


def census(population: Population) -> Census:
    """Members whose centres lie in the box of the record, by diameter, against the law they were drawn from."""
    record = population.law
    x0, y0, x1, y1 = record["box"]
    diameter = diameters_in(population, (x0, y0, x1, y1))
    low, high = record["diameter"]
    borders = np.clip(edges(low, high), low, high)
    knots, number = np.array(record["expected"]["diameter"]), np.array(record["expected"]["number"])
    from_each = cumulative(knots, number, borders)
    asked = from_each[:-1] - from_each[1:]
    bins = len(asked)
    band = poisson_band(asked, 1 - (1 - LEVEL) / bins)
    borders[-1] = high * (1 + 1e-12)
    placed = counts(diameter, borders)
    inside = bool(((placed >= band[0]) & (placed <= band[1])).all())
    return Census(borders=borders, asked=asked, low=band[0], high=band[1], placed=placed, inside=inside, on_ground=x0 < x1 and y0 < y1)


def diameters_in(population: Population, box: tuple[float, float, float, float]) -> Array:
    """Diameters [m] of members with their centres in x_min, y_min, x_max, y_max [m]."""
    x0, y0, x1, y1 = box
    inside = (population.x >= x0) & (population.x <= x1) & (population.y >= y0) & (population.y <= y1)
    return population.scale * population.drivers["diameter"][inside]


def cumulative(knots: Array, number: Array, diameter: Array) -> Array:
    """Expected number from each diameter on, by its record at ``knots``: straight in log-log, 0 beyond the last."""
    positive = np.maximum(number, 1e-12 * max(float(number[0]), 1e-300))
    found = np.exp(np.interp(np.log(diameter), np.log(knots), np.log(positive)))
    return np.where(diameter >= knots[-1] * (1 - 1e-12), 0.0, np.where(diameter <= knots[0], number[0], np.minimum(found, number[0])))
