"""Tune everything: all numbers of the model that can be wrong, fitted together by bounded least squares through replays.

Minimises |left(p)|^2, the whitened residuals of all windows, over numbers p within their bounds, begun at what the model has
(trust-region reflective, Branch, Coleman & Li 1999, of scipy). Standard errors are those of the least squares in the directions that the
recordings tell; the name is that of the number that has moved by most of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rille.proof.baselines.names import BaselineAnswer, Named
from rille.proof.baselines.residuals import gap_closed, root

Array = NDArray[np.float64]
EVALUATIONS = 12  # of residuals and derivatives each
CHANGE = 0.02  # of a spread, for a derivative
TOLD = 1.0  # [sigma] that a change by one spread makes in a direction, below which the recordings do not tell it
SURE = 4.0  # standard errors


@dataclass(frozen=True, slots=True, kw_only=True)
class TunedNumber:
    """A number that is tuned. name : what it means if it is wrong. value : of the model. spread : 1 sigma of how far off it usually is."""

    name: Named
    word: str
    unit: str
    value: float
    lower: float
    upper: float
    spread: float


class Tunable(Protocol):
    """Recordings beside the model with other numbers."""

    def __call__(self, values: Array) -> Array:
        """(k, N) whitened residuals of k sets of numbers (k, n); what a run did not reach counts as much as the caller says."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuned:
    """Numbers (n,) at their best, and their standard errors (inf: the recordings do not tell them)."""

    values: Array
    errors: Array


def tune(numbers: Sequence[TunedNumber], residuals: Tunable) -> Tuned:
    """All numbers together. A trial change that the model refuses has no effect on the fit."""
    value, spread = np.array([n.value for n in numbers]), np.array([n.spread for n in numbers])
    lower, upper = (np.array([getattr(n, word) for n in numbers]) for word in ("lower", "upper"))
    low, high = (lower - value) / spread, np.maximum((upper - value) / spread, (lower - value) / spread + 1e-9)

    def left(x: Array) -> Array:
        found = residuals((value + spread * x)[None])[0]
        return np.where(np.isfinite(found), found, 1e3)

    def slopes(x: Array) -> Array:
        steps = np.where(x + CHANGE <= high, CHANGE, -CHANGE)
        found = residuals(value + spread * np.vstack([x, x + np.diag(steps)]))
        return np.nan_to_num((found[1:] - found[0]) / steps[:, None]).T

    start = np.clip(np.zeros(len(numbers)), low + 1e-6, high - 1e-6)
    best = least_squares(left, start, slopes, bounds=(low, high), method="trf", x_scale=1.0, max_nfev=EVALUATIONS)
    _, size, right = np.linalg.svd(best.jac, full_matrices=False)
    told = size > TOLD
    squares = np.sum((right[told] / size[told, None]) ** 2, axis=0)
    share = np.sum(right[told] ** 2, axis=0)
    errors = np.where(share > 0.5, np.sqrt(squares), np.inf)
    over = np.sqrt(max(1.0, 2 * best.cost / max(len(best.fun) - int(told.sum()), 1)))
    return Tuned(values=value + spread * best.x, errors=spread * errors * over)


def named(numbers: Sequence[TunedNumber], tuned: Tuned, before: tuple[Array, Array], after: tuple[Array, Array]) -> BaselineAnswer:
    """The number that moved most in its standard errors; none if no number moved by more than ``SURE``.

    before, after : chi-squared and degrees (W,) of what was held out, of the model and of the tuned one.
    """
    moved = np.array([(v - n.value) for n, v in zip(numbers, tuned.values, strict=True)])
    sizes = np.abs(moved) / tuned.errors
    order = np.argsort(-sizes)
    sure = [k for k in order if sizes[k] > SURE]
    first = numbers[sure[0]] if sure else None
    sizes_of = root(*before), root(*after)
    return BaselineAnswer(
        baseline="tuning",
        name=first.name if first else None,
        number=float(moved[sure[0]]) if sure else 0.0,
        differs=bool(sure),
        before=sizes_of[0],
        after=sizes_of[1],
        gap_closed=gap_closed(*sizes_of),
        detail=", ".join(f"{numbers[k].word} {moved[k]:+.3g} {numbers[k].unit} ({sizes[k]:.1f} errors)" for k in order[:4]),
    )
