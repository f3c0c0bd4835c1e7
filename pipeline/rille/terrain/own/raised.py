"""A grid of heights as a landform: enlarged in plan, enlarged in height, embedded."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.terrain.landform import Profile, Values
from rille.terrain.own.sheet import HeightsSheet

Array = NDArray[np.float64]


def raised_form(
    sheet: HeightsSheet, folder: Path, subject: str
) -> tuple[Profile, Callable[[Values], tuple[float, float]], Callable[[Values], Array]]:
    """Profile, footprint and outline of a kept grid; it is read when it is first evaluated.

    With s = length / own length and t = height / own height: z = t Z(x / s, y / s), Z bilinear for a ``solid``, else cubic (B-spline
    through the values); a solid sinks in by ``embedded`` times its height, and what then lies below the ground is not seen.

    Raises
    ------
    InputRefused : for a file that is missing or no grid of numbers.
    """
    file = folder / sheet.file
    shape = _header(file, subject).shape
    west, north = sheet.west, sheet.north
    east, south = west + (shape[1] - 1) * sheet.posting[0], north - (shape[0] - 1) * sheet.posting[1]

    @cache
    def coefficients() -> Array:
        values = np.array(_header(file, subject), np.float64)
        if not np.isfinite(values).all():
            raise InputRefused(f"'{file}' of {subject} holds a height that is not finite; register it again")
        if sheet.solid or min(shape) < 3:
            return values
        from scipy.ndimage import spline_filter

        return np.asarray(spline_filter(values, order=3, mode="mirror"), np.float64)

    def profile(x: Array, y: Array, drivers: Values) -> Array:
        from scipy.ndimage import map_coordinates

        scale = drivers["length"] / sheet.length
        x, y = np.broadcast_arrays(np.asarray(x, np.float64) / scale, np.asarray(y, np.float64) / scale)
        where = [(north - y) / sheet.posting[1], (x - west) / sheet.posting[0]]
        order = 1 if sheet.solid or min(shape) < 3 else 3
        heights = map_coordinates(coefficients(), where, order=order, mode="mirror", prefilter=False)
        inside = (x >= west) & (x <= east) & (y >= south) & (y <= north)
        if sheet.solid:
            sunk = drivers.get("embedded", 0.0) * sheet.height
            heights = np.maximum(heights - sunk, 0.0)
        return drivers["height"] / sheet.height * np.where(inside, heights, 0.0)

    def footprint(drivers: Values) -> tuple[float, float]:
        scale = drivers["length"] / sheet.length
        return scale * max(-west, east), scale * max(north, -south)

    def outline(drivers: Values) -> Array:
        return drivers["length"] / sheet.length * np.array([[west, south], [east, south], [east, north], [west, north]])

    return profile, footprint, outline


def _header(file: Path, subject: str) -> Array:
    """The values, not yet read from the disk."""
    try:
        values = np.load(file, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # the header is read as Python, and a damaged one makes that stumble on anything
        raise InputRefused(f"the heights '{file}' of {subject} cannot be read ({error}); register it again") from None
    if not isinstance(values, np.ndarray) or values.ndim != 2 or min(values.shape) < 2 or values.dtype.kind != "f":
        raise InputRefused(f"'{file}' of {subject} is no grid of heights; register it again")
    return values
