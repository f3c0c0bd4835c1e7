"""A new answer is settled: starts of the windows are fitted under it, it and its rivals are fitted again, needless pieces are dropped.

Where the new starts explain clearly more than the old ones do (starts that bend, as of wheels that stand deeper in softer soil), rivals
within reach get starts of their own, too; the base always keeps its own. So nobody is judged by the starts of another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.inference.accept import LEAST_SHARE, NATS, is_accepted
from rille.diagnosis.inference.fit import Fitted, fit_together
from rille.diagnosis.inference.found import Standing, stand
from rille.diagnosis.inference.judge import Judge, Progress
from rille.diagnosis.inference.rank import rank
from rille.model.hypothesis import Hypothesis, Setting, Term

RIVALS = 6  # of each accepted piece, that are fitted again
OWN = 3  # rivals that get starts of their own
WITHIN_REACH = 0.5  # of the drop of chi-squared of the best, for that
TOGETHER = 8  # answers in which two pieces are swapped at once
CLOSE = 15.0  # [nats] behind the best, within which one that is not told from it gets starts of its own
NEARLY = 0.4  # of what the best gains, that one may be behind at most to get them though it seems told
FACTORS = (1.0, 0.6, 1.6, 0.36, 2.6)  # of amplitudes, where the same law begins elsewhere
ROUNDS = 4  # of taking starts anew and of changing one's mind


@dataclass(slots=True)
class State:
    """How far the search is. first : judge of the base. judge : of what is accepted so far, under its own starts. rivals : of each accepted
    piece the other terms for its place, best first. standing : the accepted ones among their alternatives.
    """

    always: Setting
    first: Judge
    judge: Judge
    pieces: list[Term] = field(default_factory=list)
    rivals: list[list[Term]] = field(default_factory=list)
    standing: Standing | None = None
    replays: int = 0
    notes: list[str] = field(default_factory=list)

    @property
    def setting(self) -> Setting:
        """All that is assumed."""
        return (*self.always, *self.pieces)

    def accepts(self, new: Fitted, old: Fitted | None, tries: int) -> bool:
        """Whether one setting says more than another, or than the accepted one (None)."""
        fitted = [new] if old is None else [new, old]
        scores = rank(self.judge.evidence, fitted, judge=self.judge)
        return is_accepted(scores, 1, len(fitted) - 1 if old is None else 2, self.judge, tries=tries, excess=self.first.excess)


def same(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses are about the same thing."""
    return (one.cause, one.kind, one.target) == (other.cause, other.kind, other.target)


def elsewhere(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether one is the same law as another, at another target."""
    same_law = (one.cause, one.kind, one.target_kind) == (other.cause, other.kind, other.target_kind)
    return same_law and one.target != other.target and [n.name for n in one.free] == [n.name for n in other.free]


def same_pieces(one: Setting, other: Setting) -> bool:
    """Whether two settings have the same pieces."""
    return {(t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target) for t in one} == {
        (t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target) for t in other
    }


def own_fit(evidence: Evidence, setting: Setting, state: State) -> tuple[Fitted, Evidence]:
    """A setting fitted under starts of its own, and the evidence with these."""
    linear = evidence.relinearised(setting)
    judge = Judge(linear, setting, floor=state.first.floor)
    (fitted,) = fit_together(judge, [[setting]])
    state.replays += judge.replays
    return fitted, linear


def settle(
    state: State,
    evidence: Evidence,
    taken: Fitted,
    rivals: list[list[Term]],
    tries: int,
    on_progress: Progress | None = None,
    *,
    under: Evidence,
) -> bool:
    """Settle on ``taken`` (or on a rival of one of its pieces, or on less) and write it into the state; False if nothing new is left of it.

    evidence : under the starts of the base. rivals : of each piece of ``taken``. under : the evidence that ``taken`` was fitted to.
    """
    always, standing, linear, bent = len(state.always), None, under, False
    for _ in range(ROUNDS):
        if on_progress is not None:
            on_progress("fitting the starts of windows again", 0.0)
        anew = evidence.relinearised(taken.setting)
        here = Judge(anew, taken.setting, floor=state.first.floor)
        trifle = LEAST_SHARE * here.degrees
        bent = here.chi2 < taken.chi2 - trifle
        if here.chi2 > taken.chi2 + trifle:  # numbers may have made up for what the step does, and it is other under the new model
            (again,) = fit_together(here, [[taken.setting]])
            state.replays += here.replays
            here = Judge(anew, again.setting, floor=state.first.floor)
            taken = again if not _is_worse(here, taken, trifle) else taken
        if _is_worse(here, taken, trifle):
            state.notes.append("starts fitted under the new model explain less than those before; the latter are kept")
            here = Judge(linear, taken.setting, floor=state.first.floor)
        linear = here.evidence
        full = _alternatives(taken.setting, always, rivals)
        less = [taken.setting[:k] + taken.setting[k + 1 :] for k in range(always, len(taken.setting))]
        less = less if len(less) > 1 else []
        fitted = _fitted(here, [*full, *less], taken.setting, on_progress)
        state.replays += here.replays
        if bent:
            fitted = _under_own_starts(state, evidence, fitted, len(full))
        kept, shorter = fitted[: len(full)], fitted[len(full) :]
        standing = stand(state.first, linear, kept)
        winner = kept[standing.confounded.order[0] - 1]
        needless = [k for k, one in enumerate(shorter) if not state.accepts(winner, one, tries)]
        if shorter and not needless and not bent and same_pieces(winner.setting, taken.setting):  # under starts of another it may miss
            shorter = _best_of_each(shorter, [own_fit(evidence, one.setting, state)[0] for one in shorter])
            needless = [k for k, one in enumerate(shorter) if not state.accepts(winner, one, tries)]
        if needless:
            k = min(needless, key=lambda k: shorter[k].chi2)
            taken, rivals = shorter[k], rivals[:k] + rivals[k + 1 :]
            if same_pieces(taken.setting, state.setting):
                return False
            continue
        settled = same_pieces(winner.setting, taken.setting) and not (bent and winner.chi2 < here.chi2 - trifle)
        taken = winner
        if settled:
            break
    if standing is None or not same_pieces(standing.fitted[standing.confounded.order[0] - 1].setting, taken.setting):
        return False
    if same_pieces(taken.setting, state.setting) or not state.accepts(taken, None, tries):
        return False
    if not bent:
        taken, linear, standing = _among_the_close(state, evidence, taken, linear, standing)
    state.replays += state.judge.replays
    state.judge = Judge(linear, taken.setting, floor=state.first.floor)
    both = _swapped_together(standing, taken.setting, always)
    if both:
        kept = [*standing.fitted, *fit_together(state.judge, [[setting] for setting in both], on_progress=on_progress)]
        wider = stand(state.first, linear, kept)
        if same_pieces(wider.fitted[wider.confounded.order[0] - 1].setting, taken.setting):
            standing = wider
    state.pieces, state.rivals, state.standing = list(taken.setting[always:]), rivals, standing
    return True


def exchange(state: State, evidence: Evidence, number: int, term: Term, tries: int, on_progress: Progress | None = None) -> bool:
    """Put a term in the place of an accepted piece, if it predicts clearly better than that, and write it into the state; whether it did.

    evidence : under the starts of the base. number : of the piece.
    """
    place = len(state.always) + number
    begun = [(*state.setting[:place], each, *state.setting[place + 1 :]) for each in _taking_over(term, state.pieces[number])]
    rough = min(fit_together(state.judge, [[setting] for setting in begun], on_progress=on_progress), key=lambda one: one.chi2)
    own, linear = own_fit(evidence, rough.setting, state)
    here = Judge(linear, own.setting, floor=state.first.floor)
    rivals = [[state.pieces[k], *each] if k == number else each for k, each in enumerate(state.rivals)]
    fitted = fit_together(here, [[setting] for setting in _alternatives(own.setting, len(state.always), rivals)], on_progress=on_progress)
    state.replays += here.replays
    standing = stand(state.first, linear, fitted)
    before = [i for i, one in enumerate(fitted, start=1) if same_pieces(one.setting, state.setting)]
    best = standing.confounded.order[0]
    winner = fitted[best - 1].setting
    if not same_pieces(winner, own.setting) or not all(
        standing.scores.clearly_ahead(best, i, np.log(max(tries, 1)) + NATS) for i in before
    ):
        return False
    state.judge = Judge(linear, winner, floor=state.first.floor)
    state.pieces, state.rivals, state.standing = list(winner[len(state.always) :]), rivals, standing
    return True


def _taking_over(term: Term, piece: Term) -> list[Term]:
    """The term as it is, and with what a piece does on top in each amplitude that could mean the same: where it is the wider law."""
    numbers = piece.numbers
    sizes = {n.unit: numbers[n.name] for n in piece.hypothesis.free if n.amplitude}
    own = {n.name: value for n, value in zip(term.hypothesis.free, term.values, strict=True)}
    like = [n for n in term.hypothesis.free if n.amplitude and n.unit in sizes]
    return [term, *(term.hypothesis.at({**own, n.name: min(max(own[n.name] + sizes[n.unit], n.lower), n.upper)}) for n in like)]


def _fitted(judge: Judge, settings: Sequence[Setting], taken: Setting, on_progress: Progress | None) -> list[Fitted]:
    """Settings at their best. One that has a law of ``taken`` at another target is begun where that says, too: before and behind a gear the
    same law has other numbers, and from usual ones a fit may stop elsewhere.
    """
    anew = {i: starts for i, setting in enumerate(settings) if (starts := _in_proportion(setting, taken))}
    fitted = fit_together(judge, [*([setting] for setting in settings), *anew.values()], on_progress=on_progress)
    found = fitted[: len(settings)]
    for i, other in zip(anew, fitted[len(settings) :], strict=True):
        (found[i],) = _best_of_each([found[i]], [other])
    return found


def _in_proportion(setting: Setting, taken: Setting) -> list[Setting]:
    """A setting with the numbers of ``taken`` for a law that is at another target there, with several sizes; [] if no law is."""
    pairs = list(zip(setting, taken, strict=True)) if len(setting) == len(taken) else []
    if not any(elsewhere(one.hypothesis, other.hypothesis) for one, other in pairs):
        return []
    return [
        tuple(_like(one, other, factor) if elsewhere(one.hypothesis, other.hypothesis) else one for one, other in pairs)
        for factor in FACTORS
    ]


def _like(term: Term, like: Term, factor: float) -> Term:
    """The numbers of a like term in proportion to what is usual here, amplitudes times ``factor``. Places, moments and phases stay."""
    values = {}
    numbers = zip(term.hypothesis.free, term.values, like.hypothesis.free, like.values, strict=True)
    for here, own, there, value in numbers:
        usual = (here.spread, there.spread) if here.amplitude else (here.start, there.start)
        values[here.name] = own
        if here.amplitude and min(usual) > 0:
            values[here.name] = here.absent + factor * (value - there.absent) * usual[0] / usual[1]
        elif here.search == "scale" and min(usual) > 0:
            values[here.name] = value * usual[0] / usual[1]
        values[here.name] = min(max(values[here.name], here.lower), here.upper)
    return term.hypothesis.at(values)


def _swapped_together(standing: Standing, taken: Setting, always: int) -> list[Setting]:
    """Where each of two pieces could be another without being told from the answer, both could be at once."""
    confounded = standing.confounded
    swaps: list[tuple[int, Term]] = []
    for i in (i for i in confounded.order if confounded.number[i] == 0):
        setting = standing.fitted[i - 1].setting
        others = [
            k for k in range(always, len(taken)) if len(setting) == len(taken) and not same(setting[k].hypothesis, taken[k].hypothesis)
        ]
        if len(others) == 1:
            swaps.append((others[0], setting[others[0]]))
    found = []
    for (k, one), (m, other) in combinations(swaps, 2):
        if k != m and not same(one.hypothesis, other.hypothesis):
            new = {k: one, m: other}
            found.append(tuple(new.get(n, term) for n, term in enumerate(taken)))
    return found[:TOGETHER]


def _is_worse(here: Judge, taken: Fitted, trifle: float) -> bool:
    """Whether new starts explain less. Those that explain the data to their noise do not: there the old ones fit noise, far from where
    their derivatives were taken.
    """
    return here.chi2 > max(taken.chi2 + trifle, here.floor * here.degrees)


def _under_own_starts(state: State, evidence: Evidence, fitted: list[Fitted], count: int) -> list[Fitted]:
    """The fits; those of rivals within reach (of the first ``count``, the best leading) and of shorter settings under own starts."""
    drop = state.first.chi2 - fitted[0].chi2
    order = sorted(range(1, count), key=lambda i: fitted[i].chi2)
    reach = [i for i in order if state.first.chi2 - fitted[i].chi2 > WITHIN_REACH * drop][:OWN]
    found = list(fitted)
    for i in (*reach, *range(count, len(fitted))):
        (found[i],) = _best_of_each([fitted[i]], [own_fit(evidence, fitted[i].setting, state)[0]])
    return found


def _among_the_close(
    state: State, evidence: Evidence, taken: Fitted, linear: Evidence, standing: Standing
) -> tuple[Fitted, Evidence, Standing]:
    """The answer, the evidence under its starts, and its alternatives, once those that are close behind have starts of their own, too:
    not told from it and within ``CLOSE``, or behind by less than ``NEARLY`` of what it gains. What does the very same (a tilt, and a sensor
    that is off by as much) would else be behind by what starts are worth. One that comes out ahead takes its place.
    """
    scores, confounded = standing.scores, standing.confounded
    best = confounded.order[0]
    nearly = NEARLY * scores.ahead[best, 0]
    close = [
        i
        for i in confounded.order[1:]
        if scores.ahead[best, i] < nearly or (confounded.number[i] == confounded.number[best] and scores.ahead[best, i] < CLOSE)
    ][:OWN]
    own = {i: own_fit(evidence, standing.fitted[i - 1].setting, state) for i in close}
    better = {i: (fitted, under) for i, (fitted, under) in own.items() if fitted.chi2 < standing.fitted[i - 1].chi2}
    if not better:
        return taken, linear, standing
    kept = [better[i][0] if i in better else one for i, one in enumerate(standing.fitted, start=1)]
    standing = stand(state.first, linear, kept)
    first = standing.confounded.order[0]
    return (*better[first], standing) if first in better else (kept[first - 1], linear, standing)


def _best_of_each(some: Sequence[Fitted], others: Sequence[Fitted]) -> list[Fitted]:
    """Of each pair the fit that explains more."""
    return [one if one.chi2 <= other.chi2 else other for one, other in zip(some, others, strict=True)]


def _alternatives(taken: Setting, always: int, rivals: Sequence[Sequence[Term]]) -> list[Setting]:
    """The setting itself, and each of its pieces against its rivals and simpler ones of its target, whosever rivals they were."""
    found = [taken]
    for k, own in enumerate(rivals, start=always):
        piece = taken[k].hypothesis
        others = [term for term in own if not same(term.hypothesis, piece)][:RIVALS]
        others += [t for each in rivals for t in each if t.hypothesis.target == piece.target and len(t.hypothesis.free) < len(piece.free)]
        for term in others:
            setting = (*taken[:k], term, *taken[k + 1 :])
            if not any(same(term.hypothesis, t.hypothesis) for t in taken) and not any(same_pieces(setting, one) for one in found):
                found.append(setting)
    return found
