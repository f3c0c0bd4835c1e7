"""Something is missing that the catalogue has no name for: which formula behaves like it.

Sparse regression (forward selection with signs, at most three laws at one target) on the signatures of the laws in ``formulas``: each is
run through the solver once with a small number, so that what is fitted is what the channels would show. A law is kept only if it predicts
windows that it was not fitted to better, by more than two standard errors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from rille.diagnosis.evidence.evidence import Evidence, Metric
from rille.diagnosis.hypotheses.formulas import TRIAL, Law, TargetKind, as_setting, in_words, laws_of
from rille.diagnosis.hypotheses.natural import Natural
from rille.model.hypothesis import Setting
from rille.model.machine import Machine

Array = NDArray[np.float64]
Progress = Callable[[int, int, str], None] | None
MOST_TARGETS = 8
FOLDS = 5
NEEDED = 2.0  # [standard errors]
WORTH = 0.05  # share of the gain so far that another law must add
LEAST = 0.1  # share of the excess below which a formula is no description of it
REFITS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknown:
    """A formula that behaves like what is missing.

    setting : its terms, kind ``expression``, for the solver. formula, sentence : in words. target_kind, target : where it acts.
    numbers : how many were free. explained [-] : share of what is beyond the noise that it takes away. gain, gain_error [nats] : on
    windows that it was not fitted to.
    """

    setting: Setting
    formula: str
    sentence: str
    target_kind: str
    target: str
    numbers: int
    explained: float
    gain: float
    gain_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sum:
    """Laws with their numbers."""

    laws: tuple[Law, ...]
    numbers: Array

    @property
    def setting(self) -> Setting:
        return as_setting(self.laws, self.numbers.tolist())

    def moved(self, step: Array) -> "_Sum":
        """Numbers and then places further by ``step``."""
        places = iter(step[len(self.numbers) :])
        laws = tuple(law if law.place is None else law.at(law.place + float(next(places))) for law in self.laws)
        return _Sum(laws=laws, numbers=self.numbers + step[: len(self.numbers)])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Chosen:
    """A sum of laws at one target. gain, gain_error [nats] : on windows that it was not fitted to."""

    guess: _Sum
    gain: float
    gain_error: float


def find_unknown(
    evidence: Evidence,
    machine: Machine,
    scales: Natural,
    *,
    setting: Setting = (),
    targets: Sequence[tuple[TargetKind, str]] = (),
    most: int = 3,
    nameless: bool = False,
    on_progress: Progress = None,
) -> Unknown | None:
    """The formula at one target that explains held-out windows best.

    Parameters
    ----------
    setting : what is accepted already; the formula comes on top. targets : where to look, ("joint", name) ...; () all joints, the root
        body and all wheels together. most : laws in the sum. nameless : only laws that the catalogue does not hold; the best of them, be it
        worth little: to be compared with something else.

    Returns
    -------
    None if no law is worth two standard errors, or all together explain less than a tenth of what is beyond the noise; if ``nameless``, if
    no law changes anything.
    """
    places = list(targets) or _everywhere(machine)
    metric = Metric(evidence.window, evidence.start_gain)
    base = metric.whitened(evidence.residuals([setting]))[0]
    best: _Chosen | None = None
    for number, (kind, target) in enumerate(places):
        if on_progress:
            on_progress(number, len(places), f"formulas for {target}")
        laws = [law for law in laws_of(machine, scales, kind, target) if not (nameless and law.named)]
        chosen = _at_target(evidence, metric, base, laws, setting, most, proven=not nameless)
        if chosen is not None and (best is None or chosen.gain > best.gain):
            best = chosen
    if best is None:
        return None
    fitted, left = _refitted(evidence, metric, best.guess, setting, float(base @ base))
    if left < float(base @ base):  # once more from starts that are fitted with it
        better = evidence.relinearised((*setting, *fitted.setting))
        again = Metric(better.window, better.start_gain)
        row = again.whitened(better.residuals([(*setting, *fitted.setting)]))[0]
        fitted, left = _refitted(better, again, fitted, setting, float(row @ row) * (1 + 1e-9))
    explained = share_explained(float(base @ base), left, float(np.sum(metric.degrees)))
    if explained < LEAST and not nameless:
        return None
    law = fitted.laws[0]
    formula = in_words(fitted.laws, fitted.numbers.tolist())
    where = f"{'all' if law.target == '*' else 'the'} {law.target_kind}s" if law.target == "*" else f"{law.target_kind} '{law.target}'"
    return Unknown(
        setting=fitted.setting,
        formula=formula,
        sentence=f"unknown: behaves like {formula} at {where}; explains {100 * explained:.0f} % of what is beyond the noise",
        target_kind=law.target_kind,
        target=law.target,
        numbers=sum(one.numbers for one in fitted.laws),
        explained=explained,
        gain=best.gain,
        gain_error=best.gain_error,
    )


def _everywhere(machine: Machine) -> list[tuple[TargetKind, str]]:
    places: list[tuple[TargetKind, str]] = []
    if machine.soft_ground and machine.wheels:
        places.append(("wheel", "*"))
    if machine.root:
        places.append(("body", machine.root))
    driven = {d.joint for d in machine.drives}
    joints = [j for j in machine.joints if j.kind in ("hinge", "prismatic")]
    places.extend(("joint", j.name) for j in sorted(joints, key=lambda j: j.name not in driven))
    return places[:MOST_TARGETS]


def share_explained(before: float, left: float, degrees: float) -> float:
    """Share of the chi-squared beyond noise that is taken away, at most 1; 0 if there was none. degrees : of freedom."""
    excess = before - degrees
    return min((before - left) / excess, 1.0) if excess > 0 else 0.0


def _at_target(
    evidence: Evidence, metric: Metric, base: Array, laws: Sequence[Law], setting: Setting, most: int, *, proven: bool
) -> _Chosen | None:
    """Forward selection among the laws of one target."""
    if not laws:
        return None
    trials = [(*setting, *as_setting([law], [TRIAL * law.size])) for law in laws]
    moved = evidence.residuals(trials)
    signatures = (metric.whitened(np.nan_to_num(moved)) - base) / TRIAL  # by the number in units of its usual size
    usable = [k for k in range(len(laws)) if np.isfinite(moved[k]).all() and 1e-6 < float(signatures[k] @ signatures[k]) < 1e18]
    if not usable:
        return None
    degrees = np.maximum(metric.degrees, 1.0)
    grams = metric.gram(np.concatenate([base[None], -signatures[usable]]))  # base is to be explained by minus the signatures
    weighted = grams * (degrees / (degrees + grams[:, 0, 0]))[:, None, None]  # no window counts for more than its samples
    lower = np.array([0.0 if laws[k].loses else -np.inf for k in usable])
    picked: list[int] = []
    gain = np.zeros(len(grams))
    while len(picked) < min(most, len(usable)):
        fits = {k: _fit(weighted.sum(axis=0), [*picked, k], lower) for k in range(len(usable)) if k not in picked}
        drops = {k: _drop(weighted.sum(axis=0), [*picked, k], fit) for k, fit in fits.items()}
        best = max(drops, key=lambda k: drops[k])
        new = _held_out(grams, weighted, degrees, [*picked, best], lower)
        more = new - gain
        error = _error(more)
        if (proven or picked) and not np.sum(more) > max(NEEDED * error, WORTH * np.sum(gain), 0.0):
            break
        picked.append(best)
        gain = new
    if not picked:
        return None
    numbers = _fit(weighted.sum(axis=0), picked, lower)
    return _Chosen(
        guess=_Sum(
            laws=tuple(laws[usable[k]] for k in picked),
            numbers=numbers * np.array([laws[usable[k]].size for k in picked]),
        ),
        gain=float(np.sum(gain)),
        gain_error=_error(gain),
    )


def _fit(gram: Array, chosen: Sequence[int], lower: Array) -> Array:
    """Numbers of the chosen laws that minimise |base - sum|^2 under their signs, from products alone."""
    places = np.asarray(chosen) + 1
    size = np.sqrt(np.maximum(np.diag(gram)[places], 1e-300))
    products = gram[np.ix_(places, places)] / np.outer(size, size)
    root = np.linalg.cholesky(products + 1e-9 * np.eye(len(places)))
    wanted = np.linalg.solve(root, gram[places, 0] / size)
    bounds = (lower[np.asarray(chosen)], np.full(len(places), np.inf))
    return lsq_linear(root.T, wanted, bounds=bounds).x / size


def _drop(gram: Array, chosen: Sequence[int], numbers: Array) -> float:
    """By how much the sum of squares falls."""
    places = np.asarray(chosen) + 1
    return float(2 * numbers @ gram[places, 0] - numbers @ gram[np.ix_(places, places)] @ numbers)


def _held_out(grams: Array, weighted: Array, degrees: Array, chosen: Sequence[int], lower: Array) -> Array:
    """(W,) gain in log-likelihood of each window, by numbers fitted to the other folds; folds are blocks in time.

    The variance of each window is profiled, n/2 log((n + before)/(n + after)): windows where everything has gone astray do not decide.
    """
    fold = np.arange(len(grams)) * FOLDS // len(grams)
    gain = np.zeros(len(grams))
    for k in range(FOLDS):
        inside = fold == k
        if inside.any() and not inside.all():
            numbers = _fit(weighted[~inside].sum(axis=0), chosen, lower)
            before = grams[inside, 0, 0]
            after = np.maximum(before - [_drop(gram, chosen, numbers) for gram in grams[inside]], 0.0)
            gain[inside] = 0.5 * degrees[inside] * np.log((degrees[inside] + before) / (degrees[inside] + after))
    return gain


def _error(gains: Array) -> float:
    """Standard error of the sum of gains of windows."""
    return float(np.std(gains) * np.sqrt(len(gains)))


def _refitted(evidence: Evidence, metric: Metric, guess: _Sum, setting: Setting, before: float) -> tuple[_Sum, float]:
    """Numbers and places after a few Gauss-Newton steps through the solver from ``guess``, and the sum of squares that they leave.

    before : what is left without them; where the guess leaves no less, the numbers are 0.
    """
    placed = [law for law in guess.laws if law.place is not None]
    usual = np.array([*(law.size for law in guess.laws), *(law.scales["a"][0] for law in placed)])
    lower = np.array([*(0.0 if law.loses else -np.inf for law in guess.laws), *(-np.inf for _ in placed)])

    def rows(several: Sequence[_Sum]) -> Array:
        return metric.whitened(evidence.residuals([(*setting, *one.setting) for one in several]))

    best, left = replace(guess, numbers=np.zeros(len(guess.laws))), before
    step = np.r_[guess.numbers, np.zeros(len(placed))]
    for _ in range(REFITS * (1 + len(placed))):
        tried = [best.moved(share * step) for share in (1.0, 0.5, 0.2)]
        sums = np.array([float(row @ row) if np.isfinite(row).all() else np.inf for row in rows(tried)])
        if not np.min(sums) < left:
            break
        best, left = tried[int(np.argmin(sums))], float(np.min(sums))
        at = np.r_[best.numbers, np.zeros(len(placed))]
        small = np.where(np.abs(at) > 1e-3 * usual, 0.05 * at, 1e-2 * usual)
        here = rows([best, *(best.moved(small * (np.arange(len(at)) == k)) for k in range(len(at)))])
        if not np.isfinite(here).all():
            break
        slopes = (here[1:] - here[0]) / (small / usual)[:, None]  # by numbers in units of their usual sizes
        bounds = (np.minimum(lower - at / usual, -1e-12), np.full(len(at), np.inf))
        step = usual * lsq_linear(slopes.T, -here[0], bounds=bounds).x
    return best, left
