"""Diameters drawn from a law by its inverse distribution."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KNOTS = 1025  # diameters at which a law is tabulated; between them it is a power law


@dataclass(frozen=True, slots=True)
class Sizes:
    """A law over the diameters of a population. knots (k,) [m]; number (k,): N(>= D) less that of the largest [1/m^2]."""

    knots: Array
    number: Array

    def draw(self, u: Array, weight: Array) -> Array:
        """Diameters by the inverse distribution; dN weighted between knots by ``weight`` (k - 1,), log-linear inside."""
        total = np.concatenate([[0.0], np.cumsum((self.number[:-1] - self.number[1:]) * weight)])
        k = np.clip(np.searchsorted(total, u * total[-1], side="right") - 1, 0, len(weight) - 1)
        share = (u * total[-1] - total[k]) / (total[k + 1] - total[k])
        low, high = self.knots[k], self.knots[k + 1]
        slope = self._slope[k]  # dN ~ D^(-slope - 1) inside: invert it exactly
        return np.clip((low**-slope + share * (high**-slope - low**-slope)) ** (-1.0 / slope), low, high)

    @property
    def _slope(self) -> Array:
        """Exponent of the cumulative law's increments between knots."""
        steps = self.number[:-1] - self.number[1:]
        log = np.log(np.maximum(steps, 1e-300)) / (np.log(self.knots[0]) - np.log(self.knots[1]))
        return np.maximum(np.gradient(log), 0.05)
