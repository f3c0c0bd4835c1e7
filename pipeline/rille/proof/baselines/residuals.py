"""What a model does not reproduce, as a table of numbers: what is left of the samples, and how they would answer to a missing force.

A recording is replayed in short windows from start states that are smoothed from it. Of the samples of all windows

    left = C^-1/2 (measured - simulated)/sigma,    C = I + D D^T

is what the unknown start of their window cannot explain (D: derivative of the residual by the standardised start). ``gain`` is the same of
the answer to a unit of each input (an effort at a joint, a force or torque at a body), in each of K equal parts of the window.
A force f that the model lacks leaves left = sum gain f + noise of unit variance, so that any guess of f can be judged on any recording by

    R = sqrt(sum (left - gain f)^2 / degrees),    G = (R0 - R1)/(R0 - 1).

This is the integral form of regression on residual accelerations (Schaeffer & McCalla 2017; Messenger & Bortz 2021): it differentiates no
noisy samples, and weighs each by what it says. Of points of a bench each point is a window of one part, and the inputs are the responses.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
FLOOR = 1.0  # [noise] root mean square of whitened noise


@dataclass(frozen=True, slots=True, kw_only=True)
class Input:
    """Something that can be missing: ``effort`` of a joint [N m or N], ``force`` [N] or ``torque`` [N m] on a body along an axis of W, at
    its centre of mass; of points ``response``: a measured quantity [its unit].
    """

    kind: str
    target: str
    axis: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scope:
    """The machine, as far as names and features need it.

    joints : joint -> body that it carries. drives : joint -> mode of its drive.
    root : free body, '' if the world holds the mechanism. masses : of bodies that matter [kg]. wheels : wheel -> joint.
    radii : of wheels [m]. gravity : in W [m/s^2]. effects : (kind, target) that the model has. soil : name, '' none. channels : response of
    points -> name of the column.
    """

    joints: Mapping[str, str] = field(default_factory=dict)
    drives: Mapping[str, str] = field(default_factory=dict)
    root: str = ""
    masses: Mapping[str, float] = field(default_factory=dict)
    wheels: Mapping[str, str] = field(default_factory=dict)
    radii: Mapping[str, float] = field(default_factory=dict)
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    effects: tuple[tuple[str, str], ...] = ()
    soil: str = ""
    channels: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualTable:
    """Residuals of recordings in W windows, N samples sorted by window, K parts of a window.

    recording (W,) : name. time (W,) [s] : begin. part (W,) : windows that are left out together in cross-validation. window (N,).
    left (N,) : whitened residual. gain (n_inputs, K, N) : whitened answer to one unit of each input in each part of the window.
    degrees (W,) : degrees of freedom of left^2. features : name -> (W, K), the simulated motion in the middle of each part (SI; see
    ``names``). scope : the machine.
    """

    recording: tuple[str, ...]
    time: Array
    part: Whole
    window: Whole
    left: Array
    gain: Array
    degrees: Array
    inputs: tuple[Input, ...]
    features: Mapping[str, Array]
    scope: Scope

    @property
    def shape(self) -> tuple[int, int]:
        """(W, K)."""
        return len(self.time), self.gain.shape[1]

    def answer(self, number: int, force: Array) -> Array:
        """(N,) what input ``number`` adds to the samples if it is ``force`` (W, K) [unit of the input]."""
        return np.einsum("kn,nk->n", self.gain[number], force[self.window])

    def chi2(self, predicted: Array | None = None) -> Array:
        """(W,) chi-squared of what is left after ``predicted`` (N,) is taken off."""
        left = self.left if predicted is None else self.left - predicted
        return np.bincount(self.window, left**2, minlength=len(self.time)).astype(float)

    def size(self, predicted: Array | None = None) -> float:
        """R of what is left [noise]."""
        return root(self.chi2(predicted), self.degrees)


def root(chi2: Array, degrees: Array) -> float:
    """R = sqrt(chi-squared per degree of freedom)."""
    return float(np.sqrt(np.sum(chi2) / max(float(np.sum(degrees)), 1e-9)))


def gap_closed(before: float, after: float) -> float:
    """G = (R0 - R1)/(R0 - 1); an R below that of noise counts as 1. NaN if the base model is at the noise already."""
    first, second = max(before, FLOOR), max(after, FLOOR)
    return (first - second) / (first - FLOOR) if first > FLOOR else float("nan")
