"""How far responses of a bench differ by chance: from repeats, or from what is usual."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import BenchPoints

Array = NDArray[np.float64]

ASSUMED_NOISE = 0.03  # of the range or the largest magnitude of a response, where nothing says more
LEAST_NOISE = 1e-3  # of the largest magnitude: no force or sinkage is measured better


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """1 sigma of one response, and where it comes from: ``stated``, ``repeats``, ``residuals`` of the fit, or ``assumed``."""

    sigma: float
    origin: str


def repeatability(points: BenchPoints, response: str, stated: float | None = None) -> Repeatability:
    """Noise of a response: stated, else pooled over repeats, else 3 % of its range or its largest magnitude.

    Repeats are points of one slip (within 0.02), slip angle (within 0.01 rad) and load (within 20 %). Where they differ in load or slip a
    little, a plane through them is taken out; those that are as many as the plane has numbers say nothing.
    """
    values = getattr(points, response)
    known = values[np.isfinite(values)]
    if stated is not None:
        return Repeatability(sigma=stated, origin="stated")
    squares, freedom = 0.0, 0
    for repeats in _repeats(points.where(np.isfinite(values))):
        plane = np.column_stack([np.ones(len(repeats)), _varied(repeats.load, 0.01), _varied(repeats.slip_ratio, 0.0, 1e-3)])
        numbers, _, rank, _ = np.linalg.lstsq(plane, getattr(repeats, response))
        squares += float(((getattr(repeats, response) - plane @ numbers) ** 2).sum())
        freedom += len(repeats) - int(rank)
    if freedom >= 5:
        return Repeatability(sigma=max(float(np.sqrt(squares / freedom)), least_noise(points, response)), origin="repeats")
    size = max(float(np.abs(known).max(initial=0.0)), float(np.ptp(known)) if len(known) else 0.0)
    return Repeatability(sigma=max(ASSUMED_NOISE * size, 1e-9), origin="assumed")


def least_noise(points: BenchPoints, response: str) -> float:
    """No noise is below this: repeats may be one number, rounded, and curves that were calculated have none."""
    values = getattr(points, response)
    return max(LEAST_NOISE * float(np.nanmax(np.abs(values))), 1e-9)


def _repeats(points: BenchPoints) -> list[BenchPoints]:
    """Points of one slip, slip angle and load, as far as a bench keeps them."""
    bins = np.column_stack([np.round(points.slip_ratio / 0.02), np.round(points.slip_angle / 0.01)])
    groups = []
    for condition in np.unique(bins, axis=0):
        alike = np.flatnonzero((bins == condition).all(axis=1))
        alike = alike[np.argsort(points.load[alike])]
        while len(alike):
            near = points.load[alike] <= 1.2 * points.load[alike[0]]
            groups.append(points.where(np.isin(np.arange(len(points)), alike[near])))
            alike = alike[~near]
    return groups


def _varied(values: Array, share: float, least: float = 0.0) -> Array:
    """Deviations from the mean; none where they are below a share of it, or below ``least``: those are the bench's own accuracy."""
    apart = values - values.mean()
    return apart if np.ptp(values) > max(share * float(np.abs(values.mean())), least) else np.zeros_like(apart)
