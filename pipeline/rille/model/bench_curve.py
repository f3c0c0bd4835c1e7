"""Curves of bench points: what is swept along them, and their conditions in words."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rille.model.comparison import Regimes

Array = NDArray[np.float64]
WORDS = {"slip_ratio": ("slip ratio", "", 1.0), "slip_angle": ("slip angle", "deg", 180 / np.pi), "normal_load": ("load", "N", 1.0)}


def conditions_of(regimes: Regimes) -> dict[str, Array]:
    """Conditions of a comparison of bench points by name without the wheel: slip_ratio, slip_angle, normal_load, (m,) each."""
    return {name.partition("/")[0]: values for name, values in regimes.values.items() if name.partition("/")[0] in WORDS}


def sweep_of(regimes: Regimes) -> str:
    """The condition by which the points of every curve are in order: the one that was swept."""
    for name, values in conditions_of(regimes).items():
        along = [values[regimes.window == k] for k in np.unique(regimes.window)]
        if all((np.diff(part) >= 0).all() for part in along) and max(np.ptp(part) for part in along) > 0:
            return name
    return "slip_ratio"


def curve_label(conditions: Mapping[str, Array], sweep: str) -> str:
    """What the points of a curve share: "slip angle 15 deg, load 22.1 to 25.3 N"."""
    parts = []
    for name in ("slip_angle", "slip_ratio", "normal_load"):
        if name == sweep:
            continue
        word, unit, factor = WORDS[name]
        low, high = factor * conditions[name].min(), factor * conditions[name].max()
        same = high - low <= 0.005 * abs(high) + 1e-9
        parts.append(f"{word} {f'{high:.3g}' if same else f'{low:.3g} to {high:.3g}'} {unit}".strip())
    return ", ".join(parts)
