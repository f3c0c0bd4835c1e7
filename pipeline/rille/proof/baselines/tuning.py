"""Tune everything: all numbers of the model that can be wrong, fitted together by bounded least squares through replays.

Minimises |left(p)|^2 + sum ((p - p0)/spread)^2, the whitened residuals of all windows and how far off numbers usually are, over numbers p
within their bounds, begun at what the model has (trust-region reflective, Branch, Coleman & Li 1999, of scipy). The second term keeps
numbers that the recordings do not tell where they are. The name is that of the number that has moved by most of its standard errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi2_distribution

from rille.proof.baselines.names import BaselineAnswer, Named
from rille.proof.baselines.residuals import gap_closed, root

Array = NDArray[np.float64]
CHANGE = 0.02  # of a spread, for a derivative
LOST = 1e3  # [sigma] of a sample that a run does not reach
SURE = 4.0  # standard errors
CHANCE = 0.01  # of saying that something differs where nothing does


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
    """Numbers (n,) at their best, their standard errors, and what that takes off chi-squared."""

    values: Array
    errors: Array
    drop: float


def tune(numbers: Sequence[TunedNumber], residuals: Tunable, evaluations: int = 40) -> Tuned:
    """All numbers together, with at most ``evaluations`` steps. A trial change that the model refuses has no effect on the fit."""
    value, spread = np.array([n.value for n in numbers]), np.array([n.spread for n in numbers])
    lower, upper = (np.array([getattr(n, word) for n in numbers]) for word in ("lower", "upper"))
    low, high = (lower - value) / spread, np.maximum((upper - value) / spread, (lower - value) / spread + 1e-9)

    def left(x: Array) -> Array:
        found = residuals((value + spread * x)[None])[0]
        return np.r_[np.where(np.isfinite(found), found, LOST), x]

    def slopes(x: Array) -> Array:
        steps = np.where(x + CHANGE <= high, CHANGE, -CHANGE)
        found = residuals(value + spread * np.vstack([x, x + np.diag(steps)]))
        return np.vstack([np.nan_to_num((found[1:] - found[0]) / steps[:, None]).T, np.eye(len(x))])

    start = np.clip(np.zeros(len(numbers)), low + 1e-6, high - 1e-6)
    first = float(np.sum(left(start) ** 2))
    best = least_squares(left, start, cast(Any, slopes), bounds=(low, high), method="trf", x_scale=1.0, max_nfev=evaluations)
    errors = np.sqrt(np.diagonal(np.linalg.inv(best.jac.T @ best.jac)))
    over = np.sqrt(max(1.0, 2 * best.cost / len(best.fun)))
    return Tuned(values=value + spread * best.x, errors=spread * errors * over, drop=first - 2 * best.cost)


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
        differs=tuned.drop > float(chi2_distribution.isf(CHANCE, len(numbers))),
        before=sizes_of[0],
        after=sizes_of[1],
        gap_closed=gap_closed(*sizes_of),
        detail=", ".join(f"{numbers[k].word} {moved[k]:+.3g} {numbers[k].unit} ({sizes[k]:.1f} errors)" for k in order[:4]),
    )
