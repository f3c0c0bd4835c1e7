"""Bounded samples of a DEM of any size: the whole of it thinned out, and windows at its own posting."""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST = 4_000_000  # heights of each sample: seconds of work, 32 MB
SIDE = 4  # windows along each side of a DEM that is too large to be taken whole


class Surface(Protocol):
    """Heights in memory or in a file, read by two slices."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        ...

    def __getitem__(self, key: Any, /) -> Any:
        """Values of two slices of step 1."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """coarse : every ``stride``-th height of every ``stride``-th row, values and not means. windows : parts at the DEM's own posting.

    said : what was looked at, for the reader.
    """

    coarse: Array
    stride: int
    windows: tuple[Array, ...]
    said: str


def sample(surface: Surface, most: int = MOST) -> Samples:
    """All of a DEM of at most ``most`` heights, else a bounded part of it, spread evenly.

    Differences over long distances need the whole extent but not every height; those over short ones need neighbours but not the
    whole extent. Nothing is smoothed, so that differences keep their distribution.
    """
    n_rows, n_cols = surface.shape[0], surface.shape[1]
    if n_rows * n_cols <= most:
        whole = np.asarray(surface[0:n_rows, 0:n_cols], np.float64)
        return Samples(coarse=whole, stride=1, windows=(whole,), said=f"all {n_rows} x {n_cols} heights")
    stride = math.ceil(math.sqrt(n_rows * n_cols / most))
    coarse = np.concatenate([np.asarray(surface[i : i + 1, 0:n_cols], np.float64)[:, ::stride] for i in range(0, n_rows, stride)])
    side = int(math.sqrt(most)) // SIDE
    rows, cols = (_starts(n, side) for n in (n_rows, n_cols))
    windows = tuple(np.asarray(surface[i : i + side, j : j + side], np.float64) for i in rows for j in cols)
    said = f"{len(windows)} windows of {windows[0].shape[0]} x {windows[0].shape[1]} heights, and every {stride}th height in each direction"
    return Samples(coarse=coarse, stride=stride, windows=windows, said=said)


def _starts(length: int, side: int) -> list[int]:
    """First rows of windows spread evenly over a length."""
    if length <= side:
        return [0]
    count = min(SIDE, max(length // side, 1))
    room = length / count
    return [int(k * room + (room - side) / 2) for k in range(count)]
