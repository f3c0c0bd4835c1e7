"""Runs of equal neighbours."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def true_runs(mask: NDArray[np.bool_]) -> tuple[Index, Index]:
    """First and one-past-last index of each run of True."""
    edges = np.flatnonzero(np.diff(mask.view(np.int8)))
    first, last = edges[mask[edges + 1]] + 1 if len(edges) else edges, edges[mask[edges]] + 1 if len(edges) else edges
    if len(mask) and mask[0]:
        first = np.concatenate([[0], first])
    if len(mask) and mask[-1]:
        last = np.concatenate([last, [len(mask)]])
    return first.astype(np.intp), last.astype(np.intp)


def held_runs(value: Array, shortest: int) -> tuple[Index, Index]:
    """First and one-past-last index of each stretch of at least ``shortest`` equal values; NaN equals nothing."""
    first, last = true_runs(value[1:] == value[:-1])
    last = last + 1
    keep = last - first >= shortest
    return first[keep], last[keep]
