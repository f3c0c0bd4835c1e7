"""Parts that stand twice in one place: a copy that was pasted and never moved counts its mass twice."""

from collections.abc import Sequence

import numpy as np

from rille.cad.files.assembly import PlacedPart, Prototype

CLOSE = 1e-6  # of the part's size, and relative of its volume: what two exports of one part differ by
MOST = 5  # sentences


def doubles(prototypes: Sequence[Prototype], instances: Sequence[PlacedPart]) -> list[str]:
    """A sentence on each instance that has the volume, the centre and the box of an earlier one."""
    placed = [k for k, one in enumerate(instances) if prototypes[one.prototype].n_solids]
    if not placed:
        return []
    seen = np.array([_measures(prototypes[instances[k].prototype], instances[k]) for k in placed])
    volume, size, rest = seen[:, 0], seen[:, 1], seen[:, 2:]
    found = []
    for row, k in enumerate(placed):
        near = np.abs(rest[:row] - rest[row]).max(axis=1) < CLOSE * size[row]
        alike = np.flatnonzero(near & (np.abs(volume[:row] - volume[row]) < CLOSE * volume[row]))
        if len(alike):
            found.append((instances[k].path, instances[placed[int(alike[0])]].path))
    sentences = [
        f"'{later}' stands where '{first}' stands and is as large: its mass counts twice; if it is a copy, take it out of the file"
        for later, first in found[:MOST]
    ]
    if len(found) > MOST:
        sentences.append(f"{len(found) - MOST} more parts stand twice in one place")
    return sentences


def _measures(prototype: Prototype, instance: PlacedPart) -> list[float]:
    """Volume [m^3], size [m]; centre of mass and corners of the box of its box [m] in the assembly's frame."""
    turn, shift = instance.matrix[:3, :3], instance.matrix[:3, 3]
    low, high = prototype.bounds
    center, reach = turn @ ((low + high) / 2) + shift, np.abs(turn) @ ((high - low) / 2)
    size = float(np.linalg.norm(high - low))
    return [prototype.volume.volume, size, *(turn @ prototype.volume.com + shift), *(center - reach), *(center + reach)]
