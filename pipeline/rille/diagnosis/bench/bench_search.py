"""What is missing on a bench: every hypothesis with the open numbers fitted anew beside it, judged by curves that were left out.

A point of a bench is calculated in microseconds and soil numbers bend everything, so that nothing is linearised here: each hypothesis is
fitted jointly with the soil on all points, and again without each part, which then is predicted. Hypotheses are accepted one on top of the
other; where one is not all, those that did well are tried two at a time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.stats import f, norm

from rille.diagnosis.bench.bench_calibration import Calibrated, Problem, bounded_step, free_numbers, spread_soils
from rille.diagnosis.bench.bench_evidence import BenchEvidence
from rille.diagnosis.evidence.evidence import Array
from rille.diagnosis.inference.accept import LEAST_EXCESS, NATS
from rille.diagnosis.inference.confound import TIED, title_of
from rille.diagnosis.inference.rank import standard_errors_that_count
from rille.model.hypothesis import FreeNumber, Hypothesis, Setting, Term

Progress = Callable[[str, float], None]
FITTED = 24  # hypotheses that are fitted, of those that promise something
ITERATIONS = 20
OTHERS = 2  # soils that a fit begins from beside the one that is accepted
SURVIVORS = 8  # that are judged by parts left out, of those that were fitted
SWAPPED = 5  # of each round, that are tried in the place of an accepted piece
PAIRED = 8  # hypotheses that are fitted two at a time
STEPS = 4  # of the fits to all parts but one,
LENGTHS = (1.0, 0.3, 0.1)  # and their lengths
LEAST_DROP = 0.01  # of the excess, for the same
SIGNIFICANT = 4.0  # [standard deviations of a normal] as improbable a chi-squared counts as beyond its degrees
SIZES = (0.5, -0.5)  # [spreads] by which amplitudes are tried
SHAPED = 0.1  # [spreads] by which what gives a law its shape is tried
FARTHEST = 3.0  # [spreads] up to which a first step is believed


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """One answer to the same question. extra : its terms. whole : fitted to all points. held_out (N,) [sigma] : residuals predicted
    for each part by the fit without it.
    """

    extra: Setting
    whole: Calibrated
    held_out: Array

    @property
    def title(self) -> str:
        """In words."""
        return title_of(self.extra)


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """What was tried on top of what had been accepted. base : that. rivals : best prediction first. gain, error (m,) [nats] : of each
    over the base; behind, behind_error (m,) : of the first over each. group : those that cannot be told from the first.
    """

    base: Rival
    rivals: tuple[Rival, ...]
    gain: Array
    error: Array
    behind: Array
    behind_error: Array
    group: tuple[int, ...]
    tries: int


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchFound:
    """rounds : one per accepted piece, and the last that found none. first : without any; best : the final fit. leftover : share of what is
    beyond the noise in the first that is left. differs : whether anything was.
    """

    rounds: tuple[Round, ...]
    first: Rival
    best: Rival
    leftover: float
    differs: bool


def excess(evidence: BenchEvidence, residual: Array, free: int) -> float:
    """Chi-squared beyond the degrees of freedom, 0 where that may be chance, or noise that is not known well: a ratio of variances (F)."""
    degrees = max(len(residual) - free, 1)
    chi2 = float(residual @ residual)
    noise_degrees = min(2 * (len(residual) / max(evidence.noise_error, 1e-9)) ** 2, 1e6)
    return chi2 - degrees if chi2 > degrees * f.isf(norm.sf(SIGNIFICANT), degrees, noise_degrees) else 0.0


def search_bench(
    evidence: BenchEvidence,
    hypotheses: Sequence[Hypothesis],
    calibrated: Calibrated,
    *,
    most: int = 4,
    on_progress: Progress = lambda what, share: None,
) -> BenchFound:
    """Pieces on top of the calibrated open numbers, until the points are explained or nothing predicts better.

    Parameters
    ----------
    calibrated : open numbers alone, ``calibrate_shared``. most : pieces at most.
    """
    open_numbers = calibrated.setting
    free = sum(len(term.hypothesis.free) for term in open_numbers)
    start = excess(evidence, calibrated.residual, free)
    on_progress("leaving out parts", 0.0)
    first = Rival(extra=(), whole=calibrated, held_out=_held_out(evidence, calibrated, ()))
    best, rounds = first, []
    while start > 0 and len(best.extra) < most:
        if excess(evidence, best.whole.residual, free + len(best.extra)) == 0:
            break
        share = len(best.extra) / most
        found = _round(evidence, hypotheses, best, start, lambda part, at=share: on_progress("fitting hypotheses", at + part / most))
        if found is None:
            break
        rounds.append(found)
        if not _accepted(evidence, found, start):
            break
        best = found.rivals[0]
    left = excess(evidence, best.whole.residual, free + len(best.extra)) > 0
    if rounds and best.extra and (left or len(best.extra) > 1) and most > 1:
        pairs = _pairs(evidence, first, rounds, best, start, lambda part: on_progress("fitting pairs", 0.8 + 0.2 * part))
        if pairs is not None and _stands_for(evidence, pairs, best):
            best, rounds = pairs.rivals[0], [replace(rounds[0], group=(0,)), pairs]
    if len(best.extra) > 1:
        last = _swapped(evidence, first, rounds, best, lambda part: on_progress("fitting alternatives to each piece", 0.9 + 0.1 * part))
        best, others = last.rivals[0], rounds[len(best.extra) :]
        rounds = [*(replace(one, group=(0,)) for one in rounds[: len(best.extra) - 1]), last, *others]
    leftover = excess(evidence, best.whole.residual, free + len(best.extra)) / start if start > 0 else 0.0
    return BenchFound(rounds=tuple(rounds), first=first, best=best, leftover=leftover, differs=start > 0)


def _round(
    evidence: BenchEvidence, hypotheses: Sequence[Hypothesis], base: Rival, start: float, tell: Callable[[float], None]
) -> Round | None:
    """All remaining hypotheses beside what is accepted; None if none explains anything."""
    taken = {(t.hypothesis.kind, t.hypothesis.target) for t in base.extra}
    remaining = [h for h in hypotheses if (h.kind, h.target) not in taken]
    promises = []
    for k, hypothesis in enumerate(remaining):
        tell(0.3 * k / len(remaining))
        promises.append(_promise(evidence, base, hypothesis))
    promises = sorted((p for p in promises if len(p[1]) > len(base.whole.setting)), key=lambda p: -p[0])[:FITTED]
    fits = []
    for k, (_, begin) in enumerate(promises):
        tell(0.3 + 0.4 * k / len(promises))
        fits.append(_fitted(evidence, base, begin))
    fits.sort(key=lambda fit: fit.cost)
    kept = [fit for fit in fits if base.whole.chi2 - fit.chi2 > max(LEAST_DROP * start, 2 * NATS)][:SURVIVORS]
    return _judged(evidence, base, kept, 1, len(remaining), lambda part: tell(0.7 + 0.3 * part)) if kept else None


def _pairs(
    evidence: BenchEvidence, first: Rival, rounds: Sequence[Round], best: Rival, start: float, tell: Callable[[float], None]
) -> Round | None:
    """The pieces of the answer and what did well in any round, two at a time: a piece that was accepted alone may have stood for two
    others, and be needless once they are there.
    """
    pool: dict[tuple[str, str], Term] = {}
    for term in (*best.extra, *(rival.extra[-1] for one in rounds for rival in one.rivals)):
        pool.setdefault((term.hypothesis.kind, term.hypothesis.target), term)
    couples = list(combinations(list(pool.values())[:PAIRED], 2))
    fits = []
    for k, (one, other) in enumerate(couples):
        tell(0.7 * k / len(couples))
        fits.append(_fitted(evidence, first, (*first.whole.setting, one, other)))
    fits.sort(key=lambda fit: fit.cost)
    kept = [fit for fit in fits if first.whole.chi2 - fit.chi2 > max(LEAST_DROP * start, 2 * NATS)][:SURVIVORS]
    return _judged(evidence, first, kept, 2, len(couples), lambda part: tell(0.7 + 0.3 * part)) if kept else None


def _swapped(evidence: BenchEvidence, first: Rival, rounds: Sequence[Round], best: Rival, tell: Callable[[float], None]) -> Round:
    """The last round with each piece of the answer against those that did well in its stead: only the last one has been so far, and what
    stood first before the others were there may have stood for something else.
    """
    last, free = rounds[len(best.extra) - 1], len(first.whole.setting)
    taken = {(t.hypothesis.kind, t.hypothesis.target) for t in best.extra}
    known = {frozenset((t.hypothesis.kind, t.hypothesis.target) for t in rival.extra) for rival in last.rivals}
    begins = []
    for k in range(len(best.extra)):
        did_well = [rival.extra[-1] for one in rounds[: k + 1] for rival in one.rivals[:SWAPPED]]
        for term in did_well:
            extra = (*best.extra[:k], term, *best.extra[k + 1 :])
            names = frozenset((t.hypothesis.kind, t.hypothesis.target) for t in extra)
            if (term.hypothesis.kind, term.hypothesis.target) not in taken and names not in known:
                known.add(names)
                begins.append((*best.whole.setting[:free], *extra))
    fits = []
    for k, begin in enumerate(begins):
        tell(0.7 * k / len(begins))
        fits.append(_fitted(evidence, first, begin))
    kept = sorted((*(rival.whole for rival in last.rivals), *fits), key=lambda fit: fit.cost)[:SURVIVORS]
    more = len(best.extra) - len(last.base.extra)
    return _judged(evidence, last.base, kept, more, last.tries + len(fits), lambda part: tell(0.7 + 0.3 * part))


def _stands_for(evidence: BenchEvidence, pairs: Round, best: Rival) -> bool:
    """Whether the best pair takes the place of an answer: of two pieces or more if it predicts as well, of one if clearly better."""
    ahead, error = _ahead(evidence, pairs.rivals[0], best, _independent(evidence, pairs.rivals[0].held_out))
    if len(best.extra) > 1:
        return ahead >= -TIED
    return ahead > max(standard_errors_that_count(len(evidence.labels)) * error, np.log(pairs.tries) + NATS)


def _judged(
    evidence: BenchEvidence, base: Rival, kept: Sequence[Calibrated], more: int, tries: int, tell: Callable[[float], None]
) -> Round:
    """Fits with ``more`` pieces than the base, by the parts that are left out."""
    rivals = []
    count = len(base.extra) + more
    for k, fit in enumerate(kept):
        tell(k / len(kept))
        extra = fit.setting[len(fit.setting) - count :]
        rivals.append(Rival(extra=extra, whole=fit, held_out=_held_out(evidence, fit, extra)))
    rivals.sort(key=lambda r: float(r.held_out @ r.held_out))
    worth = _independent(evidence, rivals[0].held_out)
    first = min((r for r in rivals if _ahead(evidence, rivals[0], r, worth)[0] <= TIED), key=_simplicity)
    rivals = [first, *(r for r in rivals if r is not first)]
    over_base = [_ahead(evidence, r, base, worth) for r in rivals]
    behind = [_ahead(evidence, rivals[0], r, worth) for r in rivals]
    needed = standard_errors_that_count(len(evidence.labels))
    return Round(
        base=base,
        rivals=tuple(rivals),
        gain=np.array([gain for gain, _ in over_base]),
        error=np.array([error for _, error in over_base]),
        behind=np.array([gain for gain, _ in behind]),
        behind_error=np.array([error for _, error in behind]),
        group=tuple(
            k
            for k, (gain, error) in enumerate(behind)
            if k == 0 or (gain <= max(needed * error, TIED) and over_base[k][0] > over_base[k][1])
        ),
        tries=tries,
    )


def _simplicity(rival: Rival) -> tuple[int, bool]:
    """Of those that predict alike the one with the fewest numbers stands first, a number of the model before a law."""
    return len(free_numbers(rival.extra)), any(term.hypothesis.cause != "parameter" for term in rival.extra)


def _promise(evidence: BenchEvidence, base: Rival, hypothesis: Hypothesis) -> tuple[float, Setting]:
    """What a hypothesis may gain [chi-squared] beside the open numbers, linearised where an amplitude has a size, and the setting where."""
    best = (-np.inf, base.whole.setting)
    if not hypothesis.free:
        setting = (*base.whole.setting, hypothesis.at())
        left = evidence.residuals([setting])[0]
        return base.whole.chi2 - float(left @ left), setting
    for number in (n for n in hypothesis.free if n.amplitude):
        for size in SIZES:
            value = float(np.clip(number.absent + size * number.spread, number.lower, number.upper))
            if value != number.absent:
                best = max(best, _promise_near(evidence, base, hypothesis.at({number.name: value}), number), key=lambda found: found[0])
    return best


def _promise_near(evidence: BenchEvidence, base: Rival, term: Term, amplitude: FreeNumber) -> tuple[float, Setting]:
    """The same near a term with one amplitude: open numbers, the amplitude, and what gives the law its shape may change."""
    problem = Problem(evidence, base.whole.setting, (term,))
    place = problem.place(problem.setting)
    there, n = problem.residual(place), base.whole.jacobian.shape[1]
    size = term.numbers[amplitude.name] - amplitude.absent
    shapes = [k for k, number in enumerate(term.hypothesis.free) if not number.amplitude]
    columns = [base.whole.jacobian, ((there - base.whole.residual) / size)[:, None]]
    low, high = [amplitude.lower - amplitude.absent], [amplitude.upper - amplitude.absent]
    for k in shapes:
        number, value = term.hypothesis.free[k], term.values[k]
        move = number.spread * (SHAPED if value + SHAPED * number.spread <= number.upper else -SHAPED)
        moved = problem.place((*problem.setting[:-1], term.hypothesis.at(term.numbers | {number.name: value + move})))
        columns.append(((problem.residual(moved) - there) / move)[:, None])
        low.append(max(number.lower - value, -FARTHEST * number.spread))
        high.append(min(number.upper - value, FARTHEST * number.spread))
    jacobian, more = np.concatenate(columns, axis=1), 1 + len(shapes)
    step = bounded_step(
        jacobian,
        base.whole.residual,
        np.append(problem.weight[:n], np.zeros(more)),
        np.append(problem.prior[:n] - base.whole.where, np.zeros(more)),
        np.append(problem.low[:n] - base.whole.where, low),
        np.append(problem.high[:n] - base.whole.where, high),
        1e-3,
    )
    left = base.whole.residual + jacobian @ step
    # Beyond the size that was tried nothing is known: at most FARTHEST times the spread.
    reached = float(np.clip(step[n], -FARTHEST * amplitude.spread, FARTHEST * amplitude.spread)) or size
    numbers = {term.hypothesis.free[k].name: term.values[k] + float(move) for k, move in zip(shapes, step[n + 1 :], strict=True)}
    begin = term.hypothesis.at({amplitude.name: amplitude.absent + reached, **numbers})
    return base.whole.chi2 - float(left @ left), (*problem.at(place)[:-1], begin)


def _fitted(evidence: BenchEvidence, base: Rival, begin: Setting) -> Calibrated:
    """Accepted terms and a hypothesis with all numbers fitted, begun at a setting and at the best of other soils."""
    n_open = len(base.whole.setting) - len(base.extra)
    problem = Problem(evidence, begin[:n_open], begin[n_open:])
    first = problem.place(begin)
    p = len(free_numbers(begin[:n_open]))
    hypothesis = begin[-1].hypothesis
    others = []
    for size in SIZES:
        values = {n.name: float(np.clip(n.absent + size * n.spread, n.lower, n.upper)) for n in hypothesis.free if n.amplitude}
        if any(values[n.name] != n.absent for n in hypothesis.free if n.amplitude):
            usual = problem.place((*begin[:-1], hypothesis.at(values)))
            others += [np.clip(usual + np.append(step, np.zeros(len(usual) - p)), problem.low, problem.high) for step in spread_soils(p)]
    others.sort(key=lambda place: problem.cost(place, problem.residual(place)))
    fits = [problem.fit(place, most=ITERATIONS) for place in (first, *others[:OTHERS])]
    return min(fits, key=lambda fit: fit.cost)


def _held_out(evidence: BenchEvidence, whole: Calibrated, extra: Setting) -> Array:
    """(N,) residuals of each part under the numbers that all others prefer.

    The derivatives are those of the fit to all, corrected by what each step shows (Broyden 1965), for a part less changes them little.
    """
    problem = Problem(evidence, whole.setting[: len(whole.setting) - len(extra)], extra)
    result = np.empty(len(evidence.window))
    part_of = evidence.run[evidence.window]
    for part in np.unique(evidence.run):
        inside = part_of == part
        u, residual, jacobian = whole.where, whole.residual, whole.jacobian.copy()
        for _ in range(STEPS):
            step = bounded_step(
                jacobian[~inside],
                residual[~inside],
                problem.weight,
                problem.prior - u,
                problem.low - u,
                problem.high - u,
                1e-3,
            )
            cost, better = problem.cost(u, residual[~inside]), False
            for length in LENGTHS:
                trial = problem.residual(u + length * step)
                moved = length * step
                jacobian += np.outer(trial - residual - jacobian @ moved, moved) / max(float(moved @ moved), 1e-12)
                if problem.cost(u + moved, trial[~inside]) < cost:
                    u, residual, better = u + moved, trial, True
                    break
            if not better:
                break
        result[inside] = residual[inside]
    return result


def _independent(evidence: BenchEvidence, residual: Array) -> float:
    """How many independent numbers residuals (N,) are worth: N where they are white, one per channel and window where a law is off there.

    N/(1 + (m - 1) rho) with rho the correlation within a channel and window, m their mean number there.
    """
    cell = evidence.window * len(evidence.channels) + evidence.channel
    count = np.bincount(cell)
    used = count > 1
    if not used.any():
        return float(len(residual))
    total, squares = (np.bincount(cell, weights)[used] for weights in (residual, residual**2))
    pairs = count[used] * (count[used] - 1)
    rho = float(np.clip(np.sum(total**2 - squares) / np.sum(pairs) / max(float(np.mean(residual**2)), 1e-12), 0.0, 1.0))
    size = float(np.sum(count**2) / len(residual))
    return len(residual) / (1 + (size - 1) * rho)


def _ahead(evidence: BenchEvidence, one: Rival, other: Rival, independent: float) -> tuple[float, float]:
    """By how much one predicts better [nats], and its standard error over windows.

    The size of a misfit is not known before, so that its likelihood is that of a normal of unknown variance s^2, which is not below the
    noise: -n/2 (log s^2 + m/s^2), m the mean square, n independent numbers. The error is that of a jackknife over windows. Where the one
    leaves nothing but noise it is what that noise a does: the sum of squares of the other's residual b differs from what is expected by
    2 <a, b - a>, whether the difference shows in all windows or in few.
    """
    n = len(evidence.labels)
    count = np.bincount(evidence.window, minlength=n)
    squares = [np.bincount(evidence.window, rival.held_out**2, n) for rival in (one, other)]
    whole = [part.sum() / count.sum() for part in squares]
    ahead = 0.5 * independent * float(_surprise(whole[1]) - _surprise(whole[0]))
    if excess(evidence, one.whole.residual, len(free_numbers(one.whole.setting))) == 0:
        apart = other.held_out - one.held_out
        slip = np.bincount(evidence.window, one.held_out * apart, n)
        return ahead, independent * float(max(np.linalg.norm(slip), np.linalg.norm(apart))) / (count.sum() * max(float(whole[1]), 1.0))
    left = [(part.sum() - part) / (count.sum() - count) for part in squares]
    each = _surprise(left[1]) - _surprise(left[0])
    return ahead, 0.5 * independent * float(np.sqrt((n - 1) / n * ((each - each.mean()) ** 2).sum()))


def _surprise(mean_square: Array) -> Array:
    """log s^2 + m/s^2 of mean squares m [sigma^2], s^2 = max(m, 1) the likeliest variance."""
    likeliest = np.maximum(mean_square, 1.0)
    return np.log(likeliest) + mean_square / likeliest


def _accepted(evidence: BenchEvidence, found: Round, start: float) -> bool:
    """Whether the best of a round predicts better than what there was: beyond its error, the price of the tries, and a trifle."""
    drop = found.base.whole.chi2 - found.rivals[0].whole.chi2
    needed = standard_errors_that_count(len(evidence.labels))
    return drop > LEAST_EXCESS * start and found.gain[0] > max(needed * found.error[0], np.log(found.tries) + NATS)


def simpler(evidence: BenchEvidence, closed: BenchFound, opened: BenchFound) -> BenchFound:
    """Which answer stands: that on the soil as it is, or that on a soil that was calibrated.

    The former has fewer numbers: it stands if it leaves nothing, or no more than the other, and does not predict worse beyond the error.
    Not if it is several numbers of the soil, and the soil as a whole needs no law.
    """
    if not closed.differs or not closed.best.extra:
        return closed if not closed.differs else opened
    several = len(closed.best.extra) > 1 and all(term.hypothesis.target_kind == "soil" for term in closed.best.extra)
    if several and not opened.best.extra and not opened.differs:
        return opened
    worth = _independent(evidence, closed.best.held_out)
    behind, error = _ahead(evidence, opened.best, closed.best, worth)
    needed = standard_errors_that_count(len(evidence.labels))
    return opened if behind > max(needed * error, TIED) else closed


def without(evidence: BenchEvidence, found: BenchFound, place: int) -> Rival:
    """The answer without one of its pieces, fitted anew."""
    extra = tuple(term for k, term in enumerate(found.best.extra) if k != place)
    open_numbers = found.best.whole.setting[: len(found.best.whole.setting) - len(found.best.extra)]
    problem = Problem(evidence, open_numbers, extra)
    whole = problem.fit(problem.place((*open_numbers, *extra)), most=ITERATIONS)
    kept = whole.setting[len(whole.setting) - len(extra) :] if extra else ()
    return replace(found.best, extra=kept, whole=whole, held_out=_held_out(evidence, whole, kept))
