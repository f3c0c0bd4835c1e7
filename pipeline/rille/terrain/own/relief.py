"""A grid of heights in the frame of a landform to be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.terrain.grid import Grid

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Relief:
    """heights [m], of the grid's shape, 0 = the ground. length : of what is seen, along x [m]. frame, reference : where it stands and how
    it was made, in words. notes : sentences.

    embedded : fraction of its height that lies below the ground unless asked otherwise, of a solid; None: no solid.
    """

    grid: Grid
    heights: Array
    length: float
    frame: str
    reference: str
    embedded: float | None = None
    notes: tuple[str, ...] = ()


def two_lengths(text: str, what: str) -> tuple[float, float]:
    """``"1 m, 20 cm"`` in metres.

    Raises
    ------
    InputRefused : if it is not two lengths.
    """
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise InputRefused(f"{what} is '{text}', {len(parts)} values; give two lengths, separated by a comma")
    first, second = (to_si(_number(part), "length", what) for part in parts)
    return first, second


def length_of(text: str, what: str) -> float:
    """``"20 cm"`` or ``"0.2"`` in metres, above 0."""
    value = to_si(_number(text), "length", what)
    if not value > 0:
        raise InputRefused(f"{what} is {text}; it must be above 0")
    return value


def height_of(text: str, what: str) -> float:
    """``"20 cm"`` or ``"0.2"`` in metres."""
    return to_si(_number(text), "length", what)


def _number(text: str) -> float | str:
    """A bare number is already SI."""
    try:
        return float(text)
    except ValueError:
        return text
