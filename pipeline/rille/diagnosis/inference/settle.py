"""A new answer is settled: starts of the windows are fitted under it, it and its rivals are fitted again, needless pieces are dropped.

Where the new starts explain clearly more than the old ones do (starts that bend, as of wheels that stand deeper in softer soil), rivals
within reach get starts of their own, too; the base always keeps its own. So nobody is judged by the starts of another. Two pieces give
way to one law that says as much alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.inference.accept import LEAST_SHARE, NATS, is_accepted
from rille.diagnosis.inference.fit import Fitted, fit_together
from rille.diagnosis.inference.found import Standing, stand
from rille.diagnosis.inference.judge import Judge, Progress
from rille.diagnosis.inference.rank import rank
from rille.diagnosis.inference.rivals import (
    RIVALS,
    Rivals,
    alternatives,
    fitted_beside,
    same,
    same_pieces,
    swapped_together,
    with_displaced,
    without_doubles,
)
from rille.model.hypothesis import Setting, Term

OWN = 3  # rivals that get starts of their own
WITHIN_REACH = 0.5  # of the drop of chi-squared of the best, for that
CLOSE = 15.0  # [nats] behind the best, within which one that is not told from it gets starts of its own
NEARLY = 0.4  # of what the best gains, that one may be behind at most to get them though it seems told
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
    rivals: list[Rivals] = field(default_factory=list)
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
        return is_accepted(scores, 1, len(fitted) - 1 if old is None else 2, self.judge, tries=tries, first=self.first)


def own_fit(evidence: Evidence, setting: Setting, state: State) -> tuple[Fitted, Evidence]:
    """A setting fitted under starts of its own, and the evidence with these."""
    linear = evidence.relinearised(setting)
    judge = Judge(linear, setting, floor=state.first.floor)
    (fitted,) = fit_together(judge, [[setting]])
    state.replays += judge.replays
    return fitted, linear


def own_fit_in_the_end(evidence: Evidence, setting: Setting, state: State) -> tuple[Fitted, Evidence]:
    """``own_fit`` again and again, as long as it explains clearly more: where starts take up most of a law, each is a step of the way."""
    best = own_fit(evidence, setting, state)
    for _ in range(ROUNDS - 1):
        after = own_fit(evidence, best[0].setting, state)
        gained = best[0].chi2 - after[0].chi2
        best = after if gained > 0 else best
        if gained < NATS * best[0].kappa:
            break
    return best


def settle(
    state: State,
    evidence: Evidence,
    taken: Fitted,
    rivals: list[Rivals],
    tries: int,
    on_progress: Progress | None = None,
    *,
    under: Evidence,
    rounds: int = ROUNDS,
) -> bool:
    """Settle on ``taken`` (or on a rival of one of its pieces, or on less) and write it into the state; False if nothing new is left of it.

    evidence : under the starts of the base. rivals : of each piece of ``taken``. under : the evidence that ``taken`` was fitted to.
    rounds : how often, at most, it is settled anew because starts of its own have made the answer much better.
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
        full = alternatives(taken.setting, always, rivals)
        less = [taken.setting[:k] + taken.setting[k + 1 :] for k in range(always, len(taken.setting))]
        less = less if len(less) > 1 else []
        fitted = fitted_beside(here, [*full, *less], taken.setting, on_progress)
        state.replays += here.replays
        if bent:
            fitted = _under_own_starts(state, evidence, fitted, len(full))
        kept, shorter = fitted[: len(full)], fitted[len(full) :]
        standing = stand(state.first, linear, kept)
        winner = kept[standing.confounded.order[0] - 1]
        needless = [k for k, one in enumerate(shorter) if not state.accepts(winner, one, tries)]
        if shorter and not needless and not bent and same_pieces(winner.setting, taken.setting):  # under starts of another it may miss
            shorter = _best_of_each(shorter, [own_fit_in_the_end(evidence, one.setting, state)[0] for one in shorter])
            needless = [k for k, one in enumerate(shorter) if not state.accepts(winner, one, tries)]
        if needless:
            k = min(needless, key=lambda k: shorter[k].chi2)
            taken, rivals = shorter[k], rivals[:k] + rivals[k + 1 :]
            if same_pieces(taken.setting, state.setting):
                return False
            continue
        settled = same_pieces(winner.setting, taken.setting) and not (bent and winner.chi2 < here.chi2 - trifle)
        rivals = with_displaced(rivals, taken.setting, winner.setting, always)
        taken = winner
        if settled:
            break
    if standing is None or not same_pieces(standing.fitted[standing.confounded.order[0] - 1].setting, taken.setting):
        return False
    if same_pieces(taken.setting, state.setting) or not state.accepts(taken, None, tries):
        return False
    for one, its_rivals, its_evidence in _one_for_two(state, evidence, taken, rivals, on_progress):
        if settle(state, evidence, one, its_rivals, tries, on_progress, under=its_evidence):
            two = " + ".join(t.hypothesis.title for t in taken.setting[always:])
            state.notes.append(f"{two} would explain as much; one law that does it alone is believed before")
            return True
    before = taken.chi2
    taken, linear, standing = _to_the_end(state, evidence, taken, linear, standing)
    if not bent or taken.chi2 < before:
        taken, linear, standing = _among_the_close(state, evidence, taken, linear, standing)
    much_better = taken.chi2 < before - LEAST_SHARE * state.first.degrees  # under such starts others may explain as much
    if rounds > 1 and much_better and settle(state, evidence, taken, rivals, tries, on_progress, under=linear, rounds=rounds - 1):
        return True
    state.replays += state.judge.replays
    state.judge = Judge(linear, taken.setting, floor=state.first.floor)
    both = swapped_together(standing, taken.setting, always)
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
    rivals = with_displaced(state.rivals, state.setting, own.setting, len(state.always))
    fitted = fit_together(here, [[setting] for setting in alternatives(own.setting, len(state.always), rivals)], on_progress=on_progress)
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


def _one_for_two(
    state: State, evidence: Evidence, taken: Fitted, rivals: list[Rivals], on_progress: Progress | None
) -> list[tuple[Fitted, list[Rivals], Evidence]]:
    """Settings with one law in the place of the newest piece and another that says as much with no more numbers, under starts of its own;
    best first, with the rivals of its pieces and the evidence under those starts. Under starts of the base, or of two sensors that are late
    alike, a command that is late explains a part only.
    """
    always, found = len(state.always), []
    drop = state.judge.chi2 - taken.chi2
    *before, newest = taken.setting
    for k in range(always, len(before)):
        others = without_doubles([t for pair in zip_longest(rivals[k - always].terms, rivals[-1].terms) for t in pair if t is not None])
        most = len(before[k].hypothesis.free) + len(newest.hypothesis.free)
        instead = [t for t in others if len(t.hypothesis.free) <= most and not any(same(t.hypothesis, p.hypothesis) for p in taken.setting)]
        rough = fit_together(state.judge, [[(*before[:k], t, *before[k + 1 :])] for t in instead[:RIVALS]], on_progress=on_progress)
        within = [one for one in sorted(rough, key=lambda one: one.chi2) if state.judge.chi2 - one.chi2 > WITHIN_REACH * drop]
        for one in within[:OWN]:
            own, linear = own_fit_in_the_end(evidence, one.setting, state)
            if rank(evidence, [taken, own], judge=state.judge).ahead[1, 2] < NATS:
                found.append((own, [*rivals[: k - always], Rivals(tuple(others)), *rivals[k - always + 1 : -1]], linear))
    return sorted(found, key=lambda one: one[0].chi2)


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
    for i in reach:
        (found[i],) = _best_of_each([fitted[i]], [own_fit(evidence, fitted[i].setting, state)[0]])
    for i in range(count, len(fitted)):
        (found[i],) = _best_of_each([fitted[i]], [own_fit_in_the_end(evidence, fitted[i].setting, state)[0]])
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
    own = {i: own_fit_in_the_end(evidence, standing.fitted[i - 1].setting, state) for i in close}
    better = {i: (fitted, under) for i, (fitted, under) in own.items() if fitted.chi2 < standing.fitted[i - 1].chi2}
    if not better:
        return taken, linear, standing
    kept = [better[i][0] if i in better else one for i, one in enumerate(standing.fitted, start=1)]
    standing = stand(state.first, linear, kept)
    first = standing.confounded.order[0]
    return (*better[first], standing) if first in better else (kept[first - 1], linear, standing)


def _to_the_end(state: State, evidence: Evidence, taken: Fitted, linear: Evidence, standing: Standing) -> tuple[Fitted, Evidence, Standing]:
    """The answer with starts and numbers fitted in turns until nothing is gained, the evidence under these starts, and its alternatives.

    Where starts take up most of a law (the drift of an angle that nothing else shows) each turn is a step of the way: numbers that stopped
    short are off by more than their errors, and what they leave looks like another piece. Far from the noise a turn is to gain more.
    """
    own, under = own_fit_in_the_end(evidence, taken.setting, state)
    if not own.chi2 < taken.chi2 - NATS * taken.kappa:
        return taken, linear, standing
    best = standing.confounded.order[0]
    wider = stand(state.first, under, [own if i == best else one for i, one in enumerate(standing.fitted, start=1)])
    return (own, under, wider) if wider.confounded.order[0] == best else (taken, linear, standing)


def _best_of_each(some: Sequence[Fitted], others: Sequence[Fitted]) -> list[Fitted]:
    """Of each pair the fit that explains more."""
    return [one if one.chi2 <= other.chi2 else other for one, other in zip(some, others, strict=True)]
