"""Screening: what each hypothesis would do to the residuals, by a few replays, and how much of them that could explain.

The signature of an amplitude a is s = (w(a) - w(0))/a with w the whitened residuals. The size of the trial is adapted until it is felt, yet
is not larger than the residuals themselves: effects that act beyond a threshold only, and units far from the usual, are screened alike.
With w + sum_i a_i s_i in least squares within the bounds follow amplitudes and the expected drop of chi-squared. All that is done on some
windows, those that differ most and others spread over the time. Hypotheses that promise something there are then run in all windows, and
corrected along that direction if they keep less than they promised.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rille.diagnosis.evidence.evidence import Array, Evidence, Whole
from rille.diagnosis.hypotheses.shape_tries import Tries, Values, quadrature, shape_tries
from rille.diagnosis.inference.accept import loud_channels
from rille.diagnosis.inference.bounded_squares import bounded_minimum
from rille.diagnosis.inference.judge import Inquiry, Judge, Progress, Single, ask_together, cosine
from rille.diagnosis.inference.reach import may_show, within_reach
from rille.model.hypothesis import FreeNumber, Hypothesis, Setting

ROUNDS = 7  # of finding the size of a trial
FELT = 1.0  # chi-squared of a change that is felt well
UNFELT = 1e-6  # chi-squared of one that is none
SMALLEST = 1e-4  # of the residuals: a change should be this large at least
LEAP, LEAPS = 25.0, 3  # factor on a step that is not felt at all, and how often that is tried
STUBBORN, MINUTE = 0.5, 0.01  # share of a change that is still there after a smaller step, which is as small against the first one
PROMISING = 0.01  # share of the excess that must be expected for a hypothesis to be run in all windows
LITTLE = 0.05  # of the degrees of freedom, that count as excess at least: the noise may be overstated
BESIDE_THE_BEST = 0.05  # of what the best promises, for the same: what promises less is looked for on top of that
ENOUGH, BESIDE_ENOUGH = 0.95, 0.2  # share of the excess from which on the best leaves nothing for others, and the same then
RUNNERS_UP = 24  # hypotheses that are run in all windows then, at most
LEAST_DROP = 4.0  # of chi-squared, for the same
STEEP = 4.0  # times what a change in proportion to the step would be, that tell a threshold
WORTH_A_SCAN = 0.05  # share of the excess that must be promised for a broken promise to be looked into
KEPT = 0.7  # share of the promise; below, the amplitudes are corrected
CORRECTIONS = 3
PART, FEW_WINDOWS = 8, (2, 24)  # one of so many windows is looked at first, but at least, and at most, so many
FEW_SECONDS = 6.0  # [s] that these windows last together, at least
BEST_SHAPES = 2
RIPPLES = ("order", "phase")  # numbers of what is faster than large steps
BETWEEN, CLOSER = 9, 5  # values between the neighbours of the best one that was tried, and how often, at most, with the first ones
SCANNED, SCANNED_FROM = 6, 0.05  # amplitudes of a scan, and its smallest in terms of the trial
SCANS, CLOSE = 4, 1.002  # scans, each closer about the best; ratio of neighbours below which they are close enough


@dataclass(frozen=True, slots=True, kw_only=True)
class Signature:
    """What one hypothesis does. values : its numbers where it explains most so far. drop : of chi-squared there. direction (N,) : whitened
    change of the residuals from the base to ``values``; zeros if it promised too little to be run in all windows. one_sided : the direction
    may not be turned. linear : share of chi-squared that its signature promises, and where. tries : shapes that were tried. silent : it
    changes nothing within its bounds. roughly : of each amplitude, the change in the windows of the first look per unit of it; {} of a law
    that has other numbers, too, and is another law with each of their values.
    """

    hypothesis: Hypothesis
    values: Values
    drop: float
    direction: Single
    one_sided: bool
    linear: tuple[float, Values] | None
    tries: int
    silent: bool
    roughly: Mapping[str, Single] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Screened:
    """signatures : best first, the silent ones last. tries : shapes of all hypotheses together."""

    judge: Judge
    signatures: tuple[Signature, ...]
    tries: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Proposal:
    """What some windows say of a hypothesis: values for each of the best shapes, with the share of chi-squared that they take away there;
    linear : what the signatures promised, if anything. roughly : as of ``Signature``.
    """

    offers: tuple[tuple[float, Values], ...]
    linear: tuple[float, Values] | None
    tries: int
    silent: bool
    roughly: Mapping[str, Single]


@dataclass(slots=True)
class _Trial:
    """One amplitude at one shape: the step by which it is tried, and the change that makes."""

    number: FreeNumber
    shape: Values
    step: float
    change: Array = field(default_factory=lambda: np.empty(0))
    size: float = 0.0
    weak: float = 0.0  # largest step that was too small
    strong: float = 0.0  # smallest step that was too large
    too_much: Array = field(default_factory=lambda: np.empty(0))  # change that it made
    leaps: int = 0  # times that it was too small
    faint: float = 0.0  # size of the change that the step ``weak`` made
    jumps: bool = False  # the law sets in at once: it does as much however small the step is

    @property
    def values(self) -> Values:
        return self.shape | {self.number.name: self.number.absent + self.step}

    @property
    def drowned(self) -> float:
        """Size of the change that the smallest step that was too large made."""
        return float(self.too_much @ self.too_much)

    def take_too_much_for_nothing(self) -> None:
        """Go back from a step that does nothing to the last one that did too much, if there was one: the law sets in between the two."""
        if self.size <= UNFELT and self.strong:
            self.step = float(np.sign(self.step)) * self.strong
            self.change, self.size = self.too_much, self.drowned

    @property
    def sets_in(self) -> bool:
        """Whether the law acts beyond a threshold: it does far more than in proportion to a smaller step, or as much as a larger one."""
        return self.jumps or (self.weak > 0 and self.size > STEEP * self.faint * (self.step / self.weak) ** 2)


def screen(
    evidence: Evidence,
    hypotheses: Sequence[Hypothesis],
    *,
    on_top: Setting = (),
    tries: Tries | None = None,
    judge: Judge | None = None,
    on_progress: Progress | None = None,
) -> Screened:
    """Signatures of hypotheses on top of a setting.

    tries : by title of a hypothesis, values of its shape numbers to begin with (places, times). judge : of the evidence with ``on_top``,
    if there is one already.
    """
    judge = judge or Judge(evidence, on_top)
    hypotheses = within_reach(judge, hypotheses, least_promise(judge))
    worst = np.argsort(-judge.window_excess, kind="stable")
    times = [float(evidence.starts[w]) for w in worst[:5]]
    shapes = [shape_tries(h, times, (tries or {}).get(h.title, ())) for h in hypotheses]
    roughly = [all(number.search not in RIPPLES for number in h.free) for h in hypotheses]
    few = {rough: _first_look(judge, worst, roughly=rough) for rough in dict.fromkeys(roughly)}
    tell = None if on_progress is None else (lambda share: on_progress("screening", 0.5 * share))
    loud = loud_channels(judge)
    closely = [h.is_local or not len(loud) or may_show(h, evidence.channels, loud) for h in hypotheses]
    each = zip(hypotheses, shapes, closely, roughly, strict=True)
    questions = [_propose(few[rough], h, tried, close) for h, tried, close, rough in each]
    found = {}
    for rough, own in few.items():
        here = [k for k, one in enumerate(roughly) if one == rough]
        found |= dict(zip(here, ask_together(own, [questions[k] for k in here], tell), strict=True))
        most = max((share for k in here for share, _ in found[k].offers), default=0.0) * own.chi2
        tried = [k for k in here if _is_tried(own, hypotheses[k], found[k], closely[k] and len(loud) > 0, most)]
        found |= dict(zip(tried, ask_together(own, [_tried(own, hypotheses[k], found[k]) for k in tried]), strict=True))
    tell = None if on_progress is None else (lambda share: on_progress("screening", 0.5 + 0.5 * share))
    proposals = _beside_the_best(hypotheses, [found[k] for k in range(len(hypotheses))], list(few.values()))
    signatures = ask_together(judge, [_verify(judge, h, p) for h, p in zip(hypotheses, proposals, strict=True)], tell)
    kept = without_doubles(signatures)
    kept.sort(key=lambda s: (s.silent, -s.drop, len(s.hypothesis.free)))
    return Screened(judge=judge, signatures=tuple(kept), tries=max(sum(p.tries for p in proposals), 1))


def _first_look(judge: Judge, worst: Whole, *, roughly: bool) -> Judge:
    """Of some windows: those that differ most, of ``worst`` (W,) numbers, and others spread over the time; of all where they are few."""
    starts, stops = judge.evidence.starts, judge.evidence.stops
    length = float(np.median(stops - starts)) if len(worst) else 1.0
    count = int(np.clip(max(len(worst) // PART, np.ceil(FEW_SECONDS / length)), *FEW_WINDOWS))
    if len(worst) < 2 * count:
        return judge
    spread = np.linspace(0, len(worst) - 1, count - count // 2).astype(np.int64)
    chosen = np.union1d(worst[: count // 2], spread)
    return Judge(judge.evidence.subset(chosen, roughly=roughly), judge.on_top, floor=judge.floor)


def _beside_the_best(hypotheses: Sequence[Hypothesis], proposals: Sequence[_Proposal], few: Sequence[Judge]) -> list[_Proposal]:
    """Without the offers that promise too little beside the best to be run in all windows. few : what they were made by."""
    shares = sorted((max(share for share, _ in p.offers) for p in proposals if p.offers), reverse=True)
    most = shares[0] if shares else 0.0
    enough = all(_is_enough(judge, most * judge.chi2) for judge in few)
    beside = max(BESIDE_ENOUGH * most, 0.999 * shares[RUNNERS_UP - 1] if len(shares) >= RUNNERS_UP else 0.0)
    kept = []
    for h, p in zip(hypotheses, proposals, strict=True):
        least = beside if enough and not h.is_local else BESIDE_THE_BEST * most
        kept.append(replace(p, offers=tuple(offer for offer in p.offers if offer[0] > least)))
    return kept


def _is_enough(judge: Judge, drop: float) -> bool:
    """Whether such a drop of chi-squared leaves nothing for others."""
    return drop > ENOUGH * judge.excess > 0


def least_promise(judge: Judge) -> float:
    """Drop of chi-squared that must be expected of a hypothesis for it to be run in all windows."""
    return max(LEAST_DROP, PROMISING * max(judge.excess, LITTLE * judge.degrees))


def without_doubles(signatures: Sequence[Signature]) -> list[Signature]:
    """Without those of '*' that do just what one target does (a machine with one wheel)."""
    kept = []
    for one in signatures:
        others = [s for s in signatures if s.hypothesis.kind == one.hypothesis.kind and s.hypothesis.target != "*" and np.any(s.direction)]
        size = float(np.linalg.norm(one.direction))
        if one.hypothesis.target == "*" and any(np.linalg.norm(s.direction - one.direction) <= 1e-4 * size for s in others):
            continue
        kept.append(one)
    return kept


def alike(one: Signature, other: Signature) -> tuple[float, Values]:
    """How much of what one changes another does, too (cosine; negative where it does the opposite), and the other's values for that: in all
    windows, or in those of the first look where the other was not run in all, since it promised too little on its own.
    """
    if np.any(other.direction):
        return cosine(other.direction, one.direction), other.values
    numbers = {number.name: number for number in one.hypothesis.free}
    parts = [(one.values[name] - numbers[name].absent) * change for name, change in one.roughly.items()]
    aim = np.sum(parts, axis=0, dtype=float) if parts else np.zeros(1)
    size = float(aim @ aim)
    if not other.roughly or size <= 0 or any(len(change) != len(aim) for change in other.roughly.values()):
        return 0.0, other.values
    columns = np.stack([np.asarray(change, dtype=float) for change in other.roughly.values()])
    own = [number for name in other.roughly for number in other.hypothesis.free if number.name == name]
    bounds = (np.array([min(n.lower - n.absent, 0.0) for n in own]), np.array([max(n.upper - n.absent, 0.0) for n in own]))
    steps, drop = bounded_minimum(columns @ columns.T, -(columns @ aim), *bounds)
    values = other.hypothesis.at().numbers | {n.name: n.absent + float(step) for n, step in zip(own, steps, strict=True)}
    return float(np.sqrt(drop / size)), values


def _propose(judge: Judge, hypothesis: Hypothesis, shapes: Sequence[Values], closely: bool) -> Inquiry[_Proposal]:
    """Values at which the hypothesis explains most of these windows.

    closely : all shapes are tried, and the amplitude is scanned where the linear promise is not kept; else the first shape alone.
    """
    shapes = shapes if closely else shapes[:1]
    trials = yield from _felt_trials(judge, hypothesis, shapes)
    least = least_promise(judge)
    linear = [offer for offer in _offers(judge, hypothesis, trials)[:BEST_SHAPES] if offer[0] > least]
    offers, promised, beyond = linear, linear[0][0] if linear else 0.0, any(trial.sets_in for trial in trials)
    if offers:
        blocks = yield [(*judge.on_top, hypothesis.at(values)) for _, values in offers]
        offers = _as_found(judge, blocks, [values for _, values in offers])
    kept = offers[0][0] if offers else 0.0
    broken = kept < KEPT * promised and promised > WORTH_A_SCAN * judge.excess
    if closely and (broken or (beyond and kept < least)) and sum(number.amplitude for number in hypothesis.free) == 1:
        offers = yield from _scanned(judge, hypothesis, max(trials, key=lambda trial: trial.size), offers, promised)
    linear_share = (promised / judge.chi2, linear[0][1]) if linear else None
    shapeless = all(number.amplitude for number in hypothesis.free)
    roughly = {trial.number.name: (trial.change / trial.step).astype(np.float32) for trial in trials if shapeless}
    return _Proposal(offers=_shares(judge, offers), linear=linear_share, tries=len(shapes), silent=not trials, roughly=roughly)


def _is_tried(judge: Judge, hypothesis: Hypothesis, near: _Proposal, far: bool, most: float) -> bool:
    """Whether the values that numbers name are tried: not of what is far behind one that is enough, nor of what promises nothing near where
    it is absent, unless it may be far from there.

    near : what it promises there. far : whether it may be. most : drop of chi-squared that the best has kept.
    """
    if near.silent or not any(number.tries for number in hypothesis.free):
        return False
    promised = max((share for share, _ in (*near.offers, *([near.linear] if near.linear is not None else []))), default=0.0) * judge.chi2
    if _is_enough(judge, most) and not hypothesis.is_local:
        return promised >= BESIDE_ENOUGH * most
    return promised > 0 or far


def _tried(judge: Judge, hypothesis: Hypothesis, near: _Proposal) -> Inquiry[_Proposal]:
    """A proposal, with better offers among the values that its numbers name, closer and closer about the best as long as that promises
    more: of what is far off, a clock by turns of what moves, nothing near tells.
    """
    offers = [(share * judge.chi2, values) for share, values in near.offers]
    for number in hypothesis.free:
        tried: Sequence[float] = number.tries
        known = sorted(tried)
        for _ in range(CLOSER if tried else 0):
            best = offers[0] if offers else (0.0, hypothesis.at().numbers)
            scanned = [{**best[1], number.name: value} for value in tried]
            blocks = yield [(*judge.on_top, hypothesis.at(values)) for values in scanned]
            more = _as_found(judge, blocks, scanned)
            offers = sorted(offers + more, key=lambda offer: -offer[0])[:BEST_SHAPES]
            if more[0][0] <= best[0]:
                break
            tried = _between(known, more[0][1][number.name])
            known = sorted({*known, *tried})
    return replace(near, offers=_shares(judge, offers))


def _shares(judge: Judge, offers: Sequence[tuple[float, Values]]) -> tuple[tuple[float, Values], ...]:
    """Offers that are worth a run in all windows, with the share of chi-squared that they take away."""
    least = least_promise(judge)
    return tuple((drop / judge.chi2, values) for drop, values in offers if drop > least)


def _between(known: Sequence[float], best: float) -> list[float]:
    """Values between the neighbours of the best of those that are known, in their order."""
    k = known.index(best)
    return [float(v) for v in np.linspace(known[max(k - 1, 0)], known[min(k + 1, len(known) - 1)], BETWEEN) if v != best]


def _as_found(judge: Judge, blocks: Array, points: Sequence[Values]) -> list[tuple[float, Values]]:
    """Offers with the drop of chi-squared that was found there, best first."""
    drops = judge.chi2 - np.sum(blocks**2, axis=1)
    return sorted(((float(drop), values) for drop, values in zip(drops, points, strict=True)), key=lambda offer: -offer[0])


def _scanned(
    judge: Judge, hypothesis: Hypothesis, trial: _Trial, offers: list[tuple[float, Values]], promised: float
) -> Inquiry[list[tuple[float, Values]]]:
    """Offers, and better ones from a scan of the amplitude: between the best and its neighbours ever closer, as long as that promises more.

    To the side to which the first offer points, though the trial may have gone to the other; without one to the trial's. What acts beyond a
    threshold does nothing up to it and drowns everything a little farther on.
    """
    number = trial.number
    aim = offers[0][1][number.name] - number.absent if offers else 0.0
    side = 1.0 if (aim if offers else trial.step) > 0 else -1.0
    shape = {**trial.shape, **{k: v for _, values in offers[:1] for k, v in values.items() if k != number.name}}
    low, high = _scan_range(trial, abs(aim), side)
    known: dict[float, float] = {}
    for _ in range(SCANS):
        sizes = [float(size) for size in np.geomspace(low, max(high, low), SCANNED) if size not in known]
        points = [shape | {number.name: float(np.clip(number.absent + side * size, number.lower, number.upper))} for size in sizes]
        blocks = yield [(*judge.on_top, hypothesis.at(values)) for values in points]
        drops = judge.chi2 - np.sum(blocks**2, axis=1)
        offers = sorted([*offers, *zip(map(float, drops), points, strict=True)], key=lambda offer: -offer[0])[:BEST_SHAPES]
        known |= dict(zip(sizes, map(float, drops), strict=True))
        ordered = sorted(known)
        best = max(range(len(ordered)), key=lambda k: (known[ordered[k]], k))
        low, high = ordered[max(best - 1, 0)], ordered[min(best + 1, len(ordered) - 1)]
        if best == 0 and known[ordered[0]] < -FELT:  # the least of it is felt already, and for the worse
            break
        if known[ordered[best]] > KEPT * max(promised, judge.excess) or high < CLOSE * low:
            break
    return offers


def _scan_range(trial: _Trial, aim: float, side: float) -> tuple[float, float]:
    """Amplitudes from where nothing was felt, or a small part of the trial, to where too much was, or ``aim``; to a side (1 or -1)."""
    number, size = trial.number, abs(trial.step)
    low, high = trial.weak if 0 < trial.weak < size else SCANNED_FROM * size, trial.strong or max(2.0 * size, aim)
    if trial.jumps:
        low, high = 0.1 * abs(_first_step(number)), 10.0 * abs(_first_step(number))
    return low, min(high, number.upper - number.absent if side > 0 else number.absent - number.lower)


def _verify(judge: Judge, hypothesis: Hypothesis, proposal: _Proposal) -> Inquiry[Signature]:
    """The signature of one hypothesis at what it proposes, corrected along that direction in all windows."""
    amplitudes = [number for number in hypothesis.free if number.amplitude]
    values, drop, direction = hypothesis.at().numbers, 0.0, np.zeros(len(judge.base))
    asked = [dict(point) for _, point in proposal.offers]
    promised = max((share for share, _ in proposal.offers), default=0.0) * judge.chi2
    for _ in range(CORRECTIONS if asked else 0):
        blocks = yield [(*judge.on_top, hypothesis.at(point)) for point in asked]
        drops = [judge.chi2 - float(block @ block) for block in blocks]
        best = int(np.argmax(drops))
        change = blocks[best] - judge.base
        if drops[best] > drop or not np.any(direction):
            values, drop, direction = asked[best], max(drops[best], 0.0), change
        factor = float(np.clip(-float(change @ judge.base) / max(float(change @ change), 1e-12), 0.1, 4.0))
        if drops[best] > KEPT * promised or abs(factor - 1.0) < 0.1:
            break
        asked = [_along(amplitudes, asked[best], factor)]
    one_sided = all(n.lower >= n.absent or n.upper <= n.absent for n in amplitudes)
    return Signature(hypothesis=hypothesis, values=dict(values), drop=drop, direction=direction.astype(np.float32), one_sided=one_sided,
                     linear=proposal.linear, tries=proposal.tries, silent=proposal.silent, roughly=proposal.roughly)  # fmt: skip


def _felt_trials(judge: Judge, hypothesis: Hypothesis, shapes: Sequence[Values]) -> Inquiry[list[_Trial]]:
    """Trials of every amplitude at every shape (twice, a quarter turn apart, where the phase is found so) that change something.

    The steps that the first shape needs serve the others, if it does anything.
    """
    phase = quadrature(hypothesis)
    turns = [{}] if phase is None else [{phase.name: 0.0}, {phase.name: 0.5 * np.pi}]
    amplitudes = [number for number in hypothesis.free if number.amplitude and _first_step(number)]
    first = [_Trial(n, dict(shapes[0]) | turn, _first_step(n)) for turn in turns for n in amplitudes]
    yield from _run(judge, hypothesis, first, ROUNDS)
    steps = {t.number.name: t.step for t in first if t.size > UNFELT}
    others = [
        _Trial(n, dict(shape) | turn, steps.get(n.name, _first_step(n))) for shape in shapes[1:] for turn in turns for n in amplitudes
    ]
    yield from _run(judge, hypothesis, others, 1 if steps else ROUNDS)
    return [trial for trial in (*first, *others) if trial.size > UNFELT]


def _run(judge: Judge, hypothesis: Hypothesis, trials: Sequence[_Trial], rounds: int) -> Inquiry[None]:
    """Run trials, with other steps while these are too small or too large."""
    waiting = list(trials)
    for more in reversed(range(rounds)):
        if not waiting:
            break
        blocks = yield [(*judge.on_top, hypothesis.at(trial.values)) for trial in waiting]
        for trial, block in zip(waiting, blocks, strict=True):
            trial.change = block - judge.base
            trial.size = float(trial.change @ trial.change)
        waiting = [trial for trial in waiting if _resized(trial, judge)] if more else []
    for trial in trials:
        trial.take_too_much_for_nothing()


def _first_step(number: FreeNumber) -> float:
    """One spread, to the side where there is room."""
    up, down = number.upper - number.absent, number.absent - number.lower
    step = number.spread if number.spread > 0 else 0.1 * max(up, down)
    return min(step, up) if up >= min(step, down) else -min(step, down)


def _resized(trial: _Trial, judge: Judge) -> bool:
    """Whether the trial must be repeated with another step: it is not felt, or drowns what is to be explained."""
    most = max(judge.chi2, judge.degrees)
    room = trial.number.upper - trial.number.absent if trial.step > 0 else trial.number.absent - trial.number.lower
    size = abs(trial.step)
    if trial.size > most:
        if trial.size > STUBBORN * trial.drowned > 0 and size < MINUTE * abs(_first_step(trial.number)):
            trial.jumps = True
            return False
        trial.strong, trial.too_much = size, trial.change
        less = size * float(np.clip(0.5 * np.sqrt(most / trial.size), 1e-3, 0.5))
        new = max(np.sqrt(trial.weak * size), less) if trial.weak else less
    elif trial.size < max(FELT, SMALLEST * judge.chi2):
        if trial.size < UNFELT and trial.leaps >= LEAPS and not trial.strong:
            return False
        trial.weak, trial.faint, trial.leaps = size, trial.size, trial.leaps + 1
        new = size * (LEAP if trial.size < UNFELT else float(np.clip(np.sqrt(0.1 * most / trial.size), 1.0, LEAP)))
        new = min(new, np.sqrt(size * trial.strong) if trial.strong else np.inf, room)
    else:
        return False
    if abs(new / size - 1.0) < 0.2:
        return False
    trial.step = float(np.sign(trial.step) * new)
    return True


def _offers(judge: Judge, hypothesis: Hypothesis, trials: Sequence[_Trial]) -> list[tuple[float, Values]]:
    """(expected drop of chi-squared, values) per shape, best first, with more than no drop."""
    phase = quadrature(hypothesis)
    by_shape: dict[tuple, list[_Trial]] = {}
    for trial in trials:
        shape = {name: value for name, value in trial.shape.items() if phase is None or name != phase.name}
        by_shape.setdefault(tuple(sorted(shape.items())), []).append(trial)
    offers = []
    for shape, group in by_shape.items():
        columns = np.stack([trial.change / trial.step for trial in group])
        if phase is None:
            lower = np.minimum([trial.number.lower - trial.number.absent for trial in group], 0.0)
            upper = np.maximum([trial.number.upper - trial.number.absent for trial in group], 0.0)
        else:
            upper = np.full(len(group), np.inf)
            lower = -upper
        gram, slope = columns @ columns.T, columns @ judge.base
        steps, drop = bounded_minimum(gram, slope, lower, upper)
        if phase is None and any(trial.number.lower > trial.number.absent for trial in group):  # there or not: not a little of it
            steps = np.clip(steps, [trial.number.lower - trial.number.absent for trial in group], upper)
            drop = float(-2 * slope @ steps - steps @ gram @ steps)
        if drop <= 0:
            continue
        values = dict(shape)
        if phase is None:
            values |= {trial.number.name: trial.number.absent + float(step) for trial, step in zip(group, steps, strict=True)}
        else:
            sine, cosine = (
                sum(float(s) for t, s in zip(group, steps, strict=True) if (t.shape[phase.name] > 0.1) == late) for late in (False, True)
            )
            number = group[0].number
            size = float(np.clip(np.hypot(sine, cosine), 0.0, number.upper - number.absent))
            values |= {number.name: number.absent + size, phase.name: float(np.arctan2(cosine, sine))}
        offers.append((drop, values))
    return sorted(offers, key=lambda offer: -offer[0])


def _along(amplitudes: Sequence[FreeNumber], values: Values, factor: float) -> Values:
    """Amplitudes scaled by a factor within their bounds."""
    scaled = {n.name: float(np.clip(n.absent + factor * (values.get(n.name, n.absent) - n.absent), n.lower, n.upper)) for n in amplitudes}
    return dict(values) | scaled
