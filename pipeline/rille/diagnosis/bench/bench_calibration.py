"""The open numbers of a bench (soil, unknown loads and zeros) from its points, alone or beside hypotheses.

Bounded least squares of residuals in sigmas and of priors, over u = x/spread. The problem has more than one minimum (a stiff soil with a
large exponent, a soft one with a small), so that it is begun from several soils.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from rille.diagnosis.bench.bench_evidence import BenchEvidence
from rille.diagnosis.bench.bench_rig import LOG
from rille.diagnosis.evidence.evidence import ENDED, Array
from rille.model.hypothesis import FreeNumber, Setting, Term

STARTS = 4  # other soils that a calibration begins from,
TRIED = 16  # the best of so many
REACH = 1.5  # [spreads] of the starts about the priors
WEAK = 10.0  # [spreads] 1 sigma of the prior of what a hypothesis adds: the data decide
ARRIVED = 0.05  # chi-squared that an iteration must still gain


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrated:
    """setting : terms with fitted numbers. residual (N,) [sigma]. cost : sum of squares, priors included. where (p,) : numbers/spread.
    jacobian (N, p) : of the residual by ``where``.
    """

    setting: Setting
    residual: Array
    cost: float
    where: Array
    jacobian: Array

    @property
    def chi2(self) -> float:
        """Sum of squares of the residual."""
        return float(self.residual @ self.residual)


class Problem:
    """Residuals of evidence as a function of the free numbers of a setting, in units of their spreads: u (p,).

    open_numbers : terms with priors, about ``absent``. extra : terms that the data decide. low, high, prior, weight (p,) : bounds, and the
    centre and strength of priors. A point that the soil carried before, and a trial does not, costs more than it did: ending never pays.
    """

    def __init__(self, evidence: BenchEvidence, open_numbers: Setting, extra: Setting = ()) -> None:
        self.evidence = evidence
        self.setting = (*open_numbers, *extra)
        numbers = free_numbers(self.setting)
        n_open = len(free_numbers(open_numbers))
        self.scale = np.array([number.spread for number in numbers])
        self.low = np.array([number.lower for number in numbers]) / self.scale
        self.high = np.array([number.upper for number in numbers]) / self.scale
        self.prior = np.array([number.absent if number.amplitude else number.start for number in numbers]) / self.scale
        self.weight = np.where(np.arange(len(numbers)) < n_open, 1.0, 1.0 / WEAK)
        base = evidence.residuals([()])[0]
        self._penalty = np.where(base == ENDED, ENDED, np.maximum(ENDED, 2 * np.abs(base)))

    def place(self, setting: Setting) -> Array:
        """(p,) of a setting of the same terms, within the bounds."""
        values = np.array([value for term in setting for value in term.values])
        return np.clip(values / self.scale, self.low, self.high)

    def at(self, u: Array) -> Setting:
        """The setting at u."""
        return with_numbers(self.setting, (u * self.scale).tolist())

    def residual(self, u: Array) -> Array:
        """(N,) [sigma]."""
        found = self.evidence.residuals([self.at(u)])[0]
        return np.where(found == ENDED, self._penalty, found)

    def cost(self, u: Array, residual: Array) -> float:
        """Sum of squares with the priors'."""
        return float(residual @ residual + np.sum((self.weight * (u - self.prior)) ** 2))

    def jacobian(self, u: Array, residual: Array, step: float = 1e-3) -> Array:
        """(N, p) by differences, to the side where there is room."""
        columns = []
        for k in range(len(u)):
            h = step if u[k] + step <= self.high[k] else -step
            columns.append((self.residual(u + h * np.eye(len(u))[k]) - residual) / h)
        return np.stack(columns, axis=1) if columns else np.empty((len(residual), 0))

    def fit(self, begin: Array, *, most: int = 40) -> Calibrated:
        """Levenberg-Marquardt within bounds, from u = begin; at most so many Jacobians."""
        u = np.clip(begin, self.low, self.high)
        residual = self.residual(u)
        cost, damping = self.cost(u, residual), 1e-2
        jacobian = self.jacobian(u, residual)
        for _ in range(most if len(u) else 0):
            gained, trial, tried = 0.0, u, residual
            for _ in range(6):
                step = bounded_step(jacobian, residual, self.weight, self.prior - u, self.low - u, self.high - u, damping)
                trial = u + step
                tried = self.residual(trial)
                gained = cost - self.cost(trial, tried)
                if gained > 0:
                    damping = max(damping / 5, 1e-6)
                    break
                damping *= 6
            if gained <= 0:
                break
            u, residual, cost = trial, tried, cost - gained
            jacobian = self.jacobian(u, residual)
            if gained < max(ARRIVED, 1e-4 * cost):
                break
        return Calibrated(setting=self.at(u), residual=residual, cost=cost, where=u, jacobian=jacobian)


def bounded_step(jacobian: Array, residual: Array, weight: Array, to_prior: Array, down: Array, up: Array, damping: float = 0.0) -> Array:
    """(p,) least |residual + J step|^2 + |weight (step - to_prior)|^2 within down <= step <= up, damped by the size of each column."""
    size = np.sqrt((jacobian**2).sum(axis=0) + weight**2)
    rows = np.concatenate([jacobian, np.diag(weight), np.diag(np.sqrt(damping) * size)])
    aim = np.concatenate([-residual, weight * to_prior, np.zeros(len(size))])
    free = np.linalg.lstsq(rows, aim, rcond=None)[0]
    if np.any(free < down) or np.any(free > up):
        free = lsq_linear(rows, aim, bounds=(np.minimum(down, 0.0) - 1e-12, np.maximum(up, 0.0) + 1e-12), method="bvls").x
    return np.clip(np.asarray(free, dtype=float), down, up)


def free_numbers(setting: Setting) -> list[FreeNumber]:
    """All free numbers, in their order."""
    return [number for term in setting for number in term.hypothesis.free]


def with_numbers(setting: Setting, values: Sequence[float]) -> Setting:
    """The same terms with other numbers, in the order of terms and of their free numbers."""
    left = list(values)
    made = []
    for term in setting:
        count = len(term.hypothesis.free)
        made.append(Term(hypothesis=term.hypothesis, values=tuple(float(v) for v in left[:count])))
        left = left[count:]
    return tuple(made)


def calibrate(evidence: BenchEvidence, open_numbers: Setting, *, begins: Sequence[Setting] = ()) -> Calibrated:
    """Open numbers alone that fit best: begun where they are, at ``begins``, and from soils that are spread about the priors."""
    problem = Problem(evidence, open_numbers)
    first = problem.place(open_numbers)
    places = [first, *(problem.place(begin) for begin in begins)]
    if len(first):
        places += [np.clip(first + step, problem.low, problem.high) for step in spread_soils(len(first))]
    costs = [problem.cost(place, problem.residual(place)) for place in places]
    order = sorted(range(len(places)), key=lambda k: (k > len(begins), costs[k]))
    return min((problem.fit(places[k]) for k in order[: len(begins) + 1 + STARTS]), key=lambda found: found.cost)


def spread_soils(size: int) -> Array:
    """(TRIED, size) [spreads] steps about a soil, evenly."""
    return qmc.scale(qmc.Sobol(size, rng=1).random(TRIED), -REACH, REACH) if size else np.zeros((1, 0))


def calibrate_shared(evidence: BenchEvidence, open_numbers: Setting) -> Calibrated:
    """Open numbers from all rigs together, begun also from those that each rig alone would have."""
    alone = []
    if len(evidence.rigs) > 1:
        for k in range(len(evidence.rigs)):
            windows = np.unique(np.concatenate([evidence.window[part.place] for part in evidence.parts if part.rig == k]))
            alone.append(calibrate(evidence.subset(windows), open_numbers).setting)
    return calibrate(evidence, open_numbers, begins=alone)


def plain(setting: Setting) -> Setting:
    """Terms of parameters as a model takes them: the number is that of the parameter itself, not the logarithm of a factor."""
    made = []
    for term in setting:
        hypothesis = term.hypothesis
        if not any(number == LOG for number, _, _ in hypothesis.moves):
            made.append(term)
            continue
        (number,), ((_, parameter, value),) = hypothesis.free, hypothesis.moves
        absolute = replace(
            number,
            name=hypothesis.kind,
            unit="SI",
            lower=value * float(np.exp(number.lower)),
            upper=value * float(np.exp(min(number.upper, 50.0))),
            start=value,
            absent=value,
            spread=value * number.spread,
        )
        linear = replace(hypothesis, free=(absolute,), moves=((hypothesis.kind, parameter, 1.0),))
        made.append(Term(hypothesis=linear, values=(value * float(np.exp(term.values[0])),)))
    return tuple(made)
