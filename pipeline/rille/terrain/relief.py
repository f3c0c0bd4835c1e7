"""Building blocks of relief landforms: banks of a given slope, ends that fade, distances to boxes and to curved centre lines."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.terrain.landform import smooth_step

Array = NDArray[np.float64]

SAMPLES = 256  # of a centre line per wavelength
MOST_WAVES = 2000  # along one centre line: half a million samples


def bank(u: Array, crest: float, toe: float) -> Array:
    """A bank of slope 1 and height 1: 1 for u <= 0, 0 for u >= :func:`bank_run`; parabolic roundings of lengths ``crest`` and ``toe``.

    Along a rounding the slope goes evenly from 0 to 1, as in vertical curves of roads, so value and slope join everywhere. The
    curve is symmetric about its middle where crest = toe; its integral over u is then half of its run.

    Parameters
    ----------
    u : distance from the crest's edge over height/tan(angle) [-]. crest, toe : [-], each between 0 (sharp) and 1.
    """
    run = bank_run(crest, toe)
    u = np.clip(u, 0.0, run)
    straight = 1.0 - (u - crest / 2)
    high = 1.0 - u**2 / (2 * max(crest, 1e-300))
    low = (run - u) ** 2 / (2 * max(toe, 1e-300))
    return np.select([u <= 0, u >= run, u < crest, u > run - toe], [1.0, 0.0, high, low], straight)


def bank_run(crest: float, toe: float) -> float:
    """Horizontal length of :func:`bank` [-]: 1 + (crest + toe) / 2."""
    return 1.0 + (crest + toe) / 2


def ends(s: Array, half: float, fade: float) -> Array:
    """1 in the middle, falling smoothly to 0 at s = +-half over ``fade`` [m] (at most ``half``); its integral is 2 half - fade."""
    return smooth_step((half - np.abs(s)) / min(fade, half))


def box_distance(x: Array, y: Array, half_x: float, half_y: float) -> Array:
    """Distance [m] to a box of half lengths around the origin; 0 inside."""
    return np.hypot(np.maximum(np.abs(x) - half_x, 0.0), np.maximum(np.abs(y) - half_y, 0.0))


def circle(semi_axis: float, corners: int = 48) -> Array:
    """Corners (n, 2) [m] of a polygon on a circle around the origin."""
    around = np.arange(corners) * (2 * math.pi / corners)
    return semi_axis * np.column_stack([np.cos(around), np.sin(around)])


def ribbon(x: Array, y: Array, direction: Array, half_width: float) -> Array:
    """Corners (2 n, 2) [m] of a band along a line of points (n,) with directions [rad]: its left side, then its right side back."""
    across = np.column_stack([-np.sin(direction), np.cos(direction)]) * half_width
    line = np.column_stack([x, y])
    return np.vstack([line + across, (line - across)[::-1]])


def arc_coordinates(x: Array, y: Array, curvature: float) -> tuple[Array, Array]:
    """Place along a circular arc and offset to its left [m]; the arc passes through the origin towards +x, left for curvature > 0 [1/m]."""
    if curvature == 0.0:
        return x, y
    radius, side = 1.0 / abs(curvature), math.copysign(1.0, curvature)
    along = radius * np.arctan2(x, radius - side * y)
    return along, side * (radius - np.hypot(x, radius - side * y))


@dataclass(frozen=True, kw_only=True)
class CentreLine:
    """A curve sampled densely: s, x, y [m], direction [rad], curvature [1/m], each (n,)."""

    s: Array
    x: Array
    y: Array
    direction: Array
    curvature: Array

    @cached_property
    def tree(self) -> Any:
        """Finds the nearest sample."""
        from scipy.spatial import KDTree

        return KDTree(np.column_stack([self.x, self.y]))

    def coordinates(self, x: Array, y: Array, reach: float) -> tuple[Array, Array]:
        """Place along the line and distance from it [m] of points; inf beyond ``reach``.

        The line is taken as the circle that osculates it at the nearest sample: with n, e the offset of the point across and along
        the sample's tangent and k the curvature, the distance is |2 n - k (n^2 + e^2)| / (1 + sqrt((1 - k n)^2 + (k e)^2)).
        """
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        along, away = np.full(x.shape, np.inf), np.full(x.shape, np.inf)
        near = (np.abs(x) <= self.x.max() + reach) & (np.abs(y) <= np.abs(self.y).max() + reach)
        points = np.column_stack([x[near], y[near]])
        if len(points) == 0:
            return along, away
        step = float(self.s[1] - self.s[0])
        distance, index = self.tree.query(points, distance_upper_bound=reach + step)
        found = np.isfinite(distance)
        k = index[found]
        dx, dy = points[found, 0] - self.x[k], points[found, 1] - self.y[k]
        cosine, sine, curvature = np.cos(self.direction[k]), np.sin(self.direction[k]), self.curvature[k]
        e, n = cosine * dx + sine * dy, cosine * dy - sine * dx
        ahead = 1.0 - curvature * n
        exact = np.abs(2 * n - curvature * (n**2 + e**2)) / (1.0 + np.hypot(ahead, curvature * e))
        place = self.s[k] + e / np.maximum(ahead, 0.1)
        at = np.flatnonzero(near.ravel())[found]
        along.ravel()[at], away.ravel()[at] = place, exact
        return along, away


def meander_refusal(length: float, wavelength: float, amplitude: float) -> str:
    """Why there is no such :func:`meander`; empty if there is."""
    if amplitude > 0.39 * wavelength:
        return (
            f"the amplitude of the meanders is {amplitude:g} m, more than 0.39 of their wavelength of {wavelength:g} m, beyond which a "
            "bend runs back on itself; take a smaller amplitude or a longer wavelength"
        )
    if length > MOST_WAVES * wavelength:
        return f"the length is {length:g} m, more than {MOST_WAVES} meanders of {wavelength:g} m; take longer or fewer ones"
    return ""


def meander_angle(wavelength: float, amplitude: float) -> float:
    """Largest angle [rad] between a sine-generated curve and its axis: omega of amplitude / wavelength = H0(omega) / (4 J0(omega)).

    Langbein & Leopold 1966 (direction = omega cos(2 pi s / M)); wavelength = M J0(omega), twice the amplitude = M H0(omega) / 2 with
    the Struve function H0 (Mecklenburg & Jayakaran 2012). omega is below 90 degrees, where the curve would turn back.
    """
    from scipy.special import j0, struve

    if amplitude == 0.0:
        return 0.0
    low, high = 0.0, math.pi / 2
    while low < (middle := (low + high) / 2) < high:  # bisection: the ratio grows with omega
        low, high = (middle, high) if struve(0, middle) < 4 * amplitude / wavelength * j0(middle) else (low, middle)
    return high


@lru_cache(maxsize=16)
def meander(length: float, wavelength: float, amplitude: float) -> CentreLine:
    """Sine-generated curve through the origin, from x = -length/2 to length/2 [m]; see :func:`meander_angle`."""
    from scipy.special import j0

    omega = meander_angle(wavelength, amplitude)
    path = wavelength / float(j0(omega))
    # Half the line: Gauss-Legendre over equal steps of s, until x passes length/2; the other half mirrors it in the origin.
    steps = math.ceil(SAMPLES * length / (2 * wavelength) * path / wavelength) + SAMPLES
    step = path / SAMPLES
    nodes, weights = np.polynomial.legendre.leggauss(4)
    at = (np.arange(steps)[:, None] + (nodes[None, :] + 1) / 2) * step
    direction = omega * np.cos(2 * np.pi * at / path)
    x = np.concatenate([[0.0], np.cumsum(np.cos(direction) @ weights) * step / 2])
    y = np.concatenate([[0.0], np.cumsum(np.sin(direction) @ weights) * step / 2])
    last = int(np.searchsorted(x, length / 2))
    half = np.arange(last + 1) * step
    share = (length / 2 - x[last - 1]) / (x[last] - x[last - 1])
    half[last] = half[last - 1] + share * step
    x[last], y[last] = length / 2, y[last - 1] + share * (y[last] - y[last - 1])
    s: Array = np.concatenate([-half[:0:-1], half]).astype(np.float64)
    xs, ys = np.concatenate([-x[last:0:-1], x[: last + 1]]), np.concatenate([-y[last:0:-1], y[: last + 1]])
    return CentreLine(
        s=s,
        x=xs,
        y=ys,
        direction=omega * np.cos(2 * np.pi * s / path),
        curvature=-omega * (2 * np.pi / path) * np.sin(2 * np.pi * s / path),
    )
