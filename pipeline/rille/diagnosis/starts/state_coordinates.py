"""Coordinates of a start state: root and joints, with differentials and gears eliminated, and how a state moves along them.

A state is a row of the simulator: time, root position, quaternion w x y z, velocity, angular velocity, positions and velocities of joints.
Each coordinate has a value and a rate. Rotations are small turns about the axes of W. Joints that a ratio ties together are one coordinate:
position of joint j = factor_j times the coordinate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.quaternion import exponential, product

Array = NDArray[np.float64]
N_ROOT = 14  # numbers of a state before those of joints


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinate:
    """kind : ``position`` or ``turn`` of the root about ``axis`` (0 to 2), or ``joint``. factors : joint's place -> factor."""

    kind: str
    name: str
    axis: int = 0
    factors: Mapping[int, float]


def coordinates_of(root: str, joints: Sequence[str], ratios: Sequence[tuple[str, str, float]]) -> tuple[Coordinate, ...]:
    """Coordinates of a model: six of a free root, then one of each group of joints."""
    found: list[Coordinate] = []
    if root:
        found += [Coordinate(kind="position", name=f"{axis} of {root}", axis=k, factors={}) for k, axis in enumerate("xyz")]
        found += [Coordinate(kind="turn", name=f"turn about {axis} of {root}", axis=k, factors={}) for k, axis in enumerate("xyz")]
    tied: dict[str, list[tuple[str, float]]] = {joint: [] for joint in joints}
    for a, b, ratio in ratios:
        if ratio != 0:
            tied[a].append((b, ratio))
            tied[b].append((a, 1 / ratio))
    reached: set[str] = set()
    for joint in joints:
        if joint in reached:
            continue
        factors, open_ends = {joint: 1.0}, [joint]
        while open_ends:
            here = open_ends.pop()
            for other, ratio in tied[here]:
                if other not in factors:
                    factors[other] = factors[here] * ratio
                    open_ends.append(other)
        reached |= set(factors)
        found.append(Coordinate(kind="joint", name=joint, factors={list(joints).index(name): f for name, f in factors.items()}))
    return tuple(found)


def moved(states: Array, coordinates: Sequence[Coordinate], change: Array) -> Array:
    """States (..., n) moved along coordinates: ``change`` (..., n_coordinates, 2) of value and rate."""
    result = states.copy()
    n_joints = (states.shape[-1] - N_ROOT) // 2
    turn = np.zeros((*states.shape[:-1], 3))
    for k, coordinate in enumerate(coordinates):
        value, rate = change[..., k, 0], change[..., k, 1]
        if coordinate.kind == "position":
            result[..., 1 + coordinate.axis] += value
            result[..., 8 + coordinate.axis] += rate
        elif coordinate.kind == "turn":
            turn[..., coordinate.axis] += value
            result[..., 11 + coordinate.axis] += rate
        for place, factor in coordinate.factors.items():
            result[..., N_ROOT + place] += factor * value
            result[..., N_ROOT + n_joints + place] += factor * rate
    result[..., 4:8] = product(exponential(turn), result[..., 4:8])
    return result
