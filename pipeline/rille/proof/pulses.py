"""Pushes that were found, against those that were logged. Both are plain JSON values."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Json = Mapping[str, Any]


def matched(pulses: Sequence[Json], found: Sequence[Json], near: float) -> list[tuple[int, int]]:
    """Pairs (number of a pulse, number of what was found of it): recording, target and sign right, peaks within ``near`` [s], nearest
    first; none twice.
    """
    pairs = [
        (abs(pulse["time"] - one["peak_time"]), i, j)
        for i, pulse in enumerate(pulses)
        for j, one in enumerate(found)
        if (pulse["recording"], pulse["target"]) == (one["recording"], one["target"]) and pulse["amplitude"] * one["amplitude"] > 0
    ]
    taken: list[tuple[int, int]] = []
    for apart, i, j in sorted(pairs):
        if apart <= near and all(i != k and j != m for k, m in taken):
            taken.append((i, j))
    return taken


def score_pulses(truth: Json, found: Sequence[Json]) -> dict[str, Any]:
    """How many pulses were found among how many calls; how far off their peaks [s] and what share of their heights (medians)."""
    pairs = matched(truth["pulses"], found, truth["near"])
    late = [abs(found[j]["peak_time"] - truth["pulses"][i]["time"]) for i, j in pairs]
    ratio = [found[j]["amplitude"] / truth["pulses"][i]["amplitude"] for i, j in pairs]
    return {
        "right": len(pairs),
        "of": len(truth["pulses"]),
        "said": len(found),
        "time_error": float(np.median(late)) if late else None,
        "amplitude_ratio": float(np.median(ratio)) if ratio else None,
    }
