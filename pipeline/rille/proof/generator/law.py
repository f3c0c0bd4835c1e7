"""What a law of joints or bodies is to the generator."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rille.proof.generator.moment import Moment

Array = NDArray[np.float64]
STICK_SPEED = 1e-4  # [rad/s or m/s] at which dry friction has 76 % of its size: a joint that sticks creeps by less than 0.5 mrad in 5 s


class Law:
    """A law at one target. numbers : its parameters by name [SI]. states : how many states of its own it has."""

    states = 0

    def __init__(self, target: str, numbers: Mapping[str, float]) -> None:
        self.target, self.numbers = target, numbers

    def start(self, moment: Moment) -> Array:
        """Its states (states,) at t = 0."""
        return np.zeros(self.states)

    def act(self, moment: Moment, state: Array) -> Array:
        """Add its forces to the moment; returns the rates (states,) of its own states."""
        raise NotImplementedError

    def switches(self) -> tuple[float, ...]:
        """Instants [s] at which it jumps."""
        return ()


def dry(speed: float) -> float:
    """Direction of motion, smooth: tanh(w / 1e-4), instead of a sign (Andersson et al. 2007, Tribology International 40, eq. 10)."""
    return math.tanh(speed / STICK_SPEED)
