"""Lengths and places in the words of evidence."""

import numpy as np
from numpy.typing import NDArray


def mm(length: float) -> str:
    """A length [m] in millimetres."""
    return f"{length * 1e3:.2f} mm"


def at(point: NDArray[np.float64]) -> str:
    """A point [m] in millimetres."""
    return "(" + ", ".join(f"{v * 1e3:.1f}" for v in point) + ") mm"
