"""Free numbers of settings by Gauss-Newton on whitened residuals, within bounds, with weak priors; the starts of windows are marginalised.

Minimises chi2(u)/kappa + sum_k precision_k (u_k - centre_k)^2, kappa = max(1, chi2 per degree): a model that is wrong anyway must not
outweigh what is usual. Derivatives are differences through the simulator; all trial changes of an iteration, and all step lengths, are
asked for together, over all settings that are fitted at once. What begins and ends somewhere has another derivative to either side: a push
that begins later says nothing of the moments before it, where it may be missing. Both are tried, and that which promises more is taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as t_distribution

from rille.diagnosis.evidence.evidence import Array, Evidence, Whole
from rille.diagnosis.inference.bounded_squares import bounded_minimum
from rille.diagnosis.inference.judge import Inquiry, Judge, Progress, Single, ask_together
from rille.diagnosis.inference.unknowns import Unknown, coordinates, setting_at, unknowns_of
from rille.model.diagnosis import Estimate
from rille.model.hypothesis import FreeNumber, Setting

ITERATIONS = 10
# Lengths and dampings (Marquardt 1963) of a step that are tried together, one row after the other until one helps.
TRIALS = (((1.0, 0.4), ()), ((0.12, 0.03), ()), ((), (1.0, 10.0, 100.0)))
CONVERGED = 0.05  # [nats] expected gain below which a fit has arrived
BEHIND = 0.1  # of what it is behind the best of those that are fitted together, for the same
CHANGE = 0.03  # of a number's size, for its derivative at first
LEAST_CHANGE, MOST_CHANGE = 0.003, 0.1  # of an amplitude's size
LEAST_SHAPE, MOST_SHAPE = 0.03, 0.2  # of another number's: solvers resolve times by steps
ERRORS = 2.0  # [standard errors] of a number, for its derivative once they are known
LOUD = 0.3  # of the residuals: a trial change that does more than this tells no derivative
DEAF = 1e-6  # chi-squared of one that does nothing, and is tried larger as long as the fit goes on
AT_BOUND = 1e-6  # [spread] from a bound
OPEN = 10.0  # ratio of the bounds of a number that is looked for over decades, beyond which it is open


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """A setting at its best. residual (N,) whitened; jacobian (k, N) its derivatives by ``unknowns`` at ``where`` (k,) [coordinates].
    chi2, degrees : of all windows. replays : runs that it took.
    """

    setting: Setting
    unknowns: tuple[Unknown, ...]
    where: Array
    residual: Single
    jacobian: Single
    chi2: float
    degrees: float
    replays: int

    @property
    def kappa(self) -> float:
        """Over-dispersion: chi-squared per degree of freedom, at least 1."""
        return max(1.0, self.chi2 / max(self.degrees - len(self.unknowns), 1.0))

    @property
    def count(self) -> int:
        """Numbers that change anything."""
        return int(np.sum(np.any(self.jacobian != 0, axis=1))) if self.unknowns else 0

    @property
    def told(self) -> float:
        """How many numbers the recordings tell: the sum of what they say of each, as a share of that and of what its usual size says
        (MacKay 1992, Neural Computation 4, the number of well-determined parameters). A roll of the ground that a plane pendulum does not
        feel is none.
        """
        if not self.unknowns:
            return 0.0
        said = np.sum(self.jacobian.astype(float) ** 2, axis=1) / self.kappa
        usual = np.array([1.0 / u.number.spread**2 if u.number.amplitude and u.number.spread > 0 else u.precision for u in self.unknowns])
        return float(np.sum(np.divide(said, said + usual, out=np.zeros_like(said), where=said > 0)))

    @property
    def precision(self) -> Array:
        """(k, k) of the prior."""
        return np.diag([u.precision for u in self.unknowns]) if self.unknowns else np.empty((0, 0))

    @property
    def room(self) -> tuple[Array, Array]:
        """(k,) how far down and up each coordinate may still go."""
        bounds = np.array([u.bounds for u in self.unknowns]).reshape(-1, 2)
        return np.minimum(bounds[:, 0] - self.where, 0.0), np.maximum(bounds[:, 1] - self.where, 0.0)


def fit(evidence: Evidence, setting: Setting, *, on_progress: Progress | None = None) -> Fitted:
    """The setting with its free numbers fitted, beginning where they are."""
    return fit_together(Judge(evidence), [[setting]], on_progress=on_progress)[0]


def fit_together(judge: Judge, starts: Sequence[Sequence[Setting]], *, on_progress: Progress | None = None) -> list[Fitted]:
    """Of each entry (the same hypotheses, begun at several places) the best fit."""
    tell = None if on_progress is None else (lambda share: on_progress("fitting", share))
    known: list[float] = []
    return ask_together(judge, [_inquire(judge, several, known) for several in starts], tell)


def _inquire(judge: Judge, several: Sequence[Setting], known: list[float]) -> Inquiry[Fitted]:
    """One fit. known : chi-squared that it and others have come to."""
    blocks = yield list(several)
    best = int(np.argmin(np.sum(blocks**2, axis=1)))
    setting, residual, replays = several[best], blocks[best].copy(), len(several)
    unknowns = unknowns_of(setting)
    where = coordinates(setting, unknowns)
    centre, precision = np.array([u.centre for u in unknowns]), np.array([u.precision for u in unknowns])
    change = np.array([CHANGE * u.size(x) if abs(x - u.number.absent) > 0 or not u.number.amplitude else u.number.spread
                       for u, x in zip(unknowns, where, strict=True)])  # fmt: skip
    edged = [k for k, u in enumerate(unknowns) if not u.number.amplitude and setting[u.term].hypothesis.is_local]
    jacobian = np.empty((0, len(residual)), dtype=np.float32)
    for _ in range(ITERATIONS if unknowns else 0):
        steps = np.array([_signed(u, x, h) for u, x, h in zip(unknowns, where, change, strict=True)])
        units = np.eye(len(unknowns))
        back = np.clip(where - steps, *np.array([u.bounds for u in unknowns]).T) - where
        ways = [*zip(steps, units, strict=True), *((back[k], units[k]) for k in edged)]
        blocks = yield [setting_at(setting, unknowns, where + step * unit) for step, unit in ways]
        replays += len(blocks)
        blocks -= residual
        for k, other in zip(edged, blocks[len(unknowns) :], strict=True):
            if _promise(other, residual) > _promise(blocks[k], residual):
                blocks[k], steps[k] = other, back[k]
        blocks = blocks[: len(unknowns)]
        answers = np.sum(blocks**2, axis=1)
        loud, deaf = answers > LOUD * float(residual @ residual), answers < DEAF
        jacobian = (blocks / np.where(steps == 0, 1.0, steps)[:, None]).astype(np.float32)
        chi2 = float(residual @ residual)
        known.append(chi2)
        kappa = max(1.0, chi2 / max(judge.degrees - len(unknowns), 1.0))
        gram = (jacobian @ jacobian.T).astype(float) / kappa + np.diag(precision)
        slope = (jacobian @ residual.astype(np.float32)).astype(float) / kappa + precision * (where - centre)
        bounds = np.array([u.bounds for u in unknowns])
        stride = np.array([u.stride for u in unknowns])
        down, up = np.maximum(np.minimum(bounds[:, 0] - where, 0.0), -stride), np.minimum(np.maximum(bounds[:, 1] - where, 0.0), stride)
        down[deaf], up[deaf] = 0.0, 0.0  # its derivative is not known yet: what is usual must not pull it away
        step, drop = bounded_minimum(gram, slope, down, up)
        moved = where + step
        sizes = np.array([u.size(x) for u, x in zip(unknowns, moved, strict=True)])
        amplitude = np.array([u.number.amplitude for u in unknowns])
        least, largest = np.where(amplitude, LEAST_CHANGE, LEAST_SHAPE) * sizes, np.where(amplitude, MOST_CHANGE, MOST_SHAPE) * sizes
        change = np.clip(ERRORS / np.sqrt(np.maximum(np.diagonal(gram), 1e-300)), least, largest)
        change = np.where(loud, np.minimum(change, 0.1 * np.abs(steps)), np.where(deaf, 4.0 * np.abs(steps), change))
        if drop < max(2 * CONVERGED, BEHIND * (chi2 - min(known)) / kappa) and not loud.any():
            break
        prior = float(precision @ (where - centre) ** 2)
        better, gained = False, 0.0
        for lengths, dampings in TRIALS:
            points = [where + length * step for length in lengths]
            points += [where + bounded_minimum(gram + damping * np.diag(np.diagonal(gram)), slope, down, up)[0] for damping in dampings]
            blocks = yield [setting_at(setting, unknowns, point) for point in points]
            replays += len(blocks)
            costs = [float(b @ b) / kappa + float(precision @ (p - centre) ** 2) for b, p in zip(blocks, points, strict=True)]
            best = int(np.argmin(costs))
            if costs[best] < chi2 / kappa + prior:
                better = True
                gained = chi2 / kappa + prior - costs[best]
                where, residual = points[best], blocks[best].copy()
                break
        if not better and not loud.any():
            break
        if better and gained < 2 * CONVERGED and drop < 20 * CONVERGED:
            break
    return Fitted(setting=setting_at(setting, unknowns, where), unknowns=unknowns, where=where, residual=residual.astype(np.float32),
                  jacobian=jacobian, chi2=float(residual @ residual), degrees=judge.degrees, replays=replays)  # fmt: skip


def _signed(unknown: Unknown, where: float, change: float) -> float:
    """The trial change, to the side where there is room; away from absence first."""
    lower, upper = unknown.bounds
    up, down = upper - where, where - lower
    outward = where >= unknown.number.absent or not unknown.number.amplitude
    if outward:
        return min(change, up) if up >= min(change, down) else -min(change, down)
    return -min(change, down) if down >= min(change, up) else min(change, up)


def _promise(change: Single, residual: Single) -> float:
    """Chi-squared that a change of residuals takes away if it is made as large as is best, but not the other way round."""
    return min(0.0, float(change @ residual)) ** 2 / max(float(change @ change), 1e-300)


def covariance(fitted: Fitted, edges: Whole) -> Array:
    """(k, k) of the coordinates: A^-1 B A^-1 with A = J J^T + kappa P and B the products of the scores of windows (White 1980), at least
    kappa A^-1. edges (W + 1,) : first samples of the windows.
    """
    jacobian = fitted.jacobian.astype(float)
    inverse = np.linalg.pinv(jacobian @ jacobian.T + fitted.kappa * fitted.precision, hermitian=True)
    scores = np.add.reduceat(jacobian * fitted.residual, edges[:-1], axis=1) if len(fitted.residual) else jacobian
    robust = inverse @ (scores @ scores.T) @ inverse
    plain = fitted.kappa * inverse
    scale = np.sqrt(np.maximum(np.diagonal(robust), np.diagonal(plain)) / np.maximum(np.diagonal(plain), 1e-300))
    return np.asarray(plain * np.outer(scale, scale), dtype=float)


def estimates(fitted: Fitted, edges: Whole) -> tuple[tuple[Estimate, ...], ...]:
    """Numbers of each term with 95 % intervals; whole numbers without an interval."""
    spread = covariance(fitted, edges)
    quantile = float(t_distribution.ppf(0.975, max(len(edges) - 2, 2)))
    jacobian = fitted.jacobian.astype(float)
    gram = jacobian @ jacobian.T
    inverse = np.linalg.pinv(gram, hermitian=True)
    found: list[list[Estimate]] = [[] for _ in fitted.setting]
    places = {(u.term, u.number.name): k for k, u in enumerate(fitted.unknowns)}
    for place, term in enumerate(fitted.setting):
        for number, value in zip(term.hypothesis.free, term.values, strict=True):
            k = places.get((place, number.name))
            if k is None:
                found[place].append(Estimate(name=number.name, unit=number.unit, value=value, low=value, high=value))
                continue
            error = quantile * float(np.sqrt(spread[k, k]))
            centre = fitted.where[k]
            low, high = ((value - error, value + error) if number.search == "phase"
                         else sorted(_limited(fitted.unknowns[k], centre + side * error) for side in (-1, 1)))  # fmt: skip
            near = AT_BOUND * number.spread
            bound = "lower" if value - number.lower <= near else "upper" if number.upper - value <= near else ""
            told = gram[k, k] * inverse[k, k]
            found[place].append(Estimate(name=number.name, unit=number.unit, value=value, low=low, high=high,
                                         at_bound="" if number.search == "phase" else bound,
                                         conditioning=float(np.sqrt(max(0.0, 1.0 - 1.0 / told))) if told > 1 else 0.0))  # fmt: skip
    return tuple(tuple(one) for one in found)


def is_told(number: FreeNumber, estimate: Estimate) -> bool:
    """Whether the recordings tell a number: an amplitude from its absence, one of decades within a factor ``OPEN``, another within what is
    usual.
    """
    low, high = estimate.low, estimate.high
    if number.amplitude:
        return not low <= number.absent <= high
    if number.search == "scale":
        return low > 0 and high < OPEN * low
    return high - low < max(number.spread, 0.0) or number.search == "order"


def _limited(unknown: Unknown, coordinate: float) -> float:
    return unknown.value(float(np.clip(coordinate, *unknown.bounds)))
