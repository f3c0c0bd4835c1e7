"""A height over one coordinate, through given points."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused

Array = NDArray[np.float64]


def curve(points: Array, interpolation: str, *, centred: bool) -> Callable[[Array], Array]:
    """The curve through points (u, z), shape (n, 2), u rising; 0 beyond the last, and, unless ``centred``, before the first.

    ``smooth``: piecewise cubic without overshoot (Fritsch & Carlson 1980, with the slopes of Fritsch & Butland 1984), which goes over
    into the ground, and across the centre of a radial form, with slope zero where the heights meet there. ``linear``: straight lines.
    """
    u, z = points.T
    first = -u[-1] if centred else u[0]
    if interpolation == "linear":
        return lambda at: np.where((at < u[-1]) & (at >= first), np.interp(at, u, z), 0.0)
    from scipy.interpolate import PchipInterpolator

    step = u[-1] - u[0]
    before = (-u[1:][::-1], z[1:][::-1]) if centred else (np.array([u[0] - step]), np.zeros(1))
    ends = z[-1] == 0.0, centred or z[0] == 0.0
    ghosts = np.concatenate([before[0] if ends[1] else [], u, [u[-1] + step] if ends[0] else []])
    heights = np.concatenate([before[1] if ends[1] else [], z, [0.0] if ends[0] else []])
    inner = PchipInterpolator(ghosts, heights, extrapolate=False)
    return lambda at: np.where((at < u[-1]) & (at >= first), inner(np.clip(at, u[0], u[-1])), 0.0)


def check_points(points: Array, what: str, *, centred: bool, steep: bool, flat: bool) -> Array:
    """Points in order, refused where they make no curve.

    steep : a height at the ends is meant. flat : no height at the ends is asked for, since the landform's weight fades it.
    """
    if not (np.diff(points[:, 0]) > 0).all():
        k = int(np.argmin(np.diff(points[:, 0]) > 0))
        raise InputRefused(
            f"{what} go from {points[k, 0]:g} to {points[k + 1, 0]:g} at point {k + 2}; the first coordinate must rise from point to point"
        )
    if centred and points[0, 0] != 0.0:
        raise InputRefused(f"{what} begin at the distance {points[0, 0]:g}; give the centre first, for example [0, {points[0, 1]:g}]")
    for end in [points[-1]] if centred else [points[0], points[-1]]:
        if end[1] != 0.0 and not steep and not flat:
            raise InputRefused(
                f"{what} end at {end[0]:g} with the height {end[1]:g}; "
                "let them end at height 0, or set steep = true if a wall is meant there"
            )
    return points
