"""The search for what is missing: screen, fit, rank, accept, look again on top of it, and say what could not be told apart.

Greedy over pieces, with two safeguards: pairs that promise more than any single piece are fitted jointly from the start, and after each
piece all alternatives (each accepted piece against its rivals, or left out) are fitted again with the starts of the windows taken under the
new model. A piece stays only if it predicts windows that it was not fitted to, by more than two standard errors and the price of having
looked at many (``accept.py``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rille.diagnosis.accept import LEAST_EXCESS, differs, is_accepted
from rille.diagnosis.confound import groups
from rille.diagnosis.evidence import Evidence
from rille.diagnosis.fit import Fitted, estimates, fit_together
from rille.diagnosis.found import Found, Standing, leftover_share, named_terms, ranked, verdict_of
from rille.diagnosis.judge import Judge, Progress
from rille.diagnosis.pairs import promising_pairs
from rille.diagnosis.rank import rank
from rille.diagnosis.screen import Screened, screen
from rille.diagnosis.shape_tries import Tries
from rille.model.diagnosis import Verdict
from rille.model.effect import EffectKind
from rille.model.hypothesis import Hypothesis, Setting, Term

LEAST_WINDOWS = 4
LEAST_DEGREES = 20.0
SURVIVORS = 12  # of the screen, that are fitted
WORTH = 0.3  # of the best's drop of chi-squared, that a survivor promises at least
LITTLE = 0.02  # share of the excess that is left by a law of few numbers, below which no more costly hypotheses are tried
FEW_NUMBERS = 2
PAIRS = 4  # that are fitted jointly
BETTER = 1.1  # drop that a pair must promise, over that of the best piece alone
RIVALS = 6  # of each accepted piece, that are fitted again
SETTLINGS = 3  # rounds of taking starts anew and of changing one's mind
WORSE = 1.2  # chi-squared per degree under newly taken starts, over that under the old ones, beyond which the old ones are kept
UNDECIDED = 0.5  # share of the excess that a hypothesis leaves, that was not accepted but may be right


@dataclass(slots=True)
class _State:
    """How far the search is. rivals : of each accepted piece the other terms for its place, best first."""

    always: Setting
    judge: Judge  # of what is accepted so far
    pieces: list[Term] = field(default_factory=list)
    rivals: list[list[Term]] = field(default_factory=list)
    standing: Standing | None = None
    replays: int = 0
    notes: list[str] = field(default_factory=list)

    @property
    def setting(self) -> Setting:
        return (*self.always, *self.pieces)


def search(
    evidence: Evidence,
    hypotheses: Sequence[Hypothesis],
    *,
    always: Setting = (),
    kinds: Mapping[str, EffectKind] | None = None,
    most: int = 4,
    tries: Tries | None = None,
    floor: float = 1.0,
    on_progress: Progress | None = None,
) -> Found:
    """What explains the evidence.

    always : terms that are no part of the question, their free numbers are fitted along (soil parameters of a bench). kinds : the
    catalogue, for equations and sources. most : pieces at most. tries : by title, values of shape numbers to begin with. floor :
    chi-squared per degree that noise alone gives. on_progress : called with what is being done and the share of it that is done.
    """
    judge = Judge(evidence, always, floor=floor)
    if judge.metric.n_windows < LEAST_WINDOWS or judge.degrees < LEAST_DEGREES:
        note = f"{judge.metric.n_windows} windows with {judge.degrees:.0f} degrees of freedom are too few to hold any out; record longer"
        return _answer(_State(always=always, judge=judge, notes=[note]), judge, kinds or {}, "cannot_know")
    if any(number for term in always for number in term.hypothesis.free):
        always = fit_together(judge, [[always]], on_progress=on_progress)[0].setting
        judge = Judge(evidence, always, floor=floor)
    state = _State(always=always, judge=judge)
    while len(state.pieces) < most and differs(state.judge) and state.judge.excess > LEAST_EXCESS * judge.excess:
        if not _look(state, evidence, hypotheses, judge, most - len(state.pieces), tries, on_progress):
            break
    return _answer(state, judge, kinds or {}, _verdict(state, judge))


def _look(state: _State, evidence: Evidence, hypotheses: Sequence[Hypothesis], first: Judge, most: int,
          tries: Tries | None, on_progress: Progress | None) -> bool:  # fmt: skip
    """One more piece (or two) on top of what is accepted; whether any was."""
    judge = state.judge
    remaining = [h for h in hypotheses if not any(_same(h, piece.hypothesis) for piece in state.pieces)]
    screened, singles = _fitted_singles(judge, remaining, tries, on_progress)
    if not singles:
        state.notes.append("no hypothesis changes the recordings towards what was measured")
        return False
    pairs = _fitted_pairs(screened, judge.chi2 - min(one.chi2 for one in singles), on_progress) if most > 1 else []
    scores = rank(judge.evidence, [*singles, *pairs], judge=judge)
    if not state.pieces:
        alone = rank(judge.evidence, singles, judge=judge)
        state.standing = Standing(judge=judge, fitted=tuple(singles), scores=alone, confounded=groups(alone, singles, judge.metric.edges))
    order = sorted(range(1, len(singles) + 1), key=lambda i: -scores.gain[i])
    single = order[0]
    pair = max(range(len(singles) + 1, len(singles) + len(pairs) + 1), key=lambda i: scores.gain[i], default=None)
    n = screened.tries
    taken = singles[single - 1].setting if is_accepted(scores, single, 0, judge, tries=n, excess=first.excess) else None
    if pair is not None and all(is_accepted(scores, pair, other, judge, tries=n * n, excess=first.excess) for other in (single, 0)):
        taken = pairs[pair - len(singles) - 1].setting
    if taken is None:
        return False
    rivals = [singles[i - 1].setting[-1] for i in order]
    new = len(taken) - len(judge.on_top)
    return _settle(state, evidence, taken, [*state.rivals, *[rivals] * new], first, n, on_progress)


def _fitted_singles(judge: Judge, hypotheses: Sequence[Hypothesis], tries: Tries | None,
                    on_progress: Progress | None) -> tuple[Screened, list[Fitted]]:  # fmt: skip
    """All hypotheses screened, and the best fitted. Those with whole numbers, which take many trials, only if others leave something."""
    cheap = [h for h in hypotheses if all(n.search != "order" for n in h.free)]
    screened, singles, done = Screened(judge=judge, signatures=(), tries=0), [], []
    for part in (cheap, [h for h in hypotheses if h not in cheap]):
        simple = min((one.chi2 for one in singles if one.count <= FEW_NUMBERS), default=judge.chi2)
        if not part or simple - judge.floor * judge.degrees < LITTLE * judge.excess:
            continue
        more = screen(judge.evidence, part, tries=tries, judge=judge, on_progress=on_progress)
        signatures = sorted((*screened.signatures, *more.signatures), key=lambda s: (s.silent, -s.drop, len(s.hypothesis.free)))
        screened = Screened(judge=judge, signatures=tuple(signatures), tries=screened.tries + more.tries)
        loud = [s for s in signatures if not s.silent and s.drop > 0]
        chosen = [s for s in loud if s.drop > WORTH * loud[0].drop and s.hypothesis not in done][:SURVIVORS]
        done += [s.hypothesis for s in chosen]
        singles += fit_together(judge, [[(*judge.on_top, s.hypothesis.at(s.values))] for s in chosen], on_progress=on_progress)
    return screened, singles


def _fitted_pairs(screened: Screened, best_drop: float, on_progress: Progress | None) -> list[Fitted]:
    """Joint fits of the pairs that promise more than the best piece alone."""
    judge = screened.judge
    starts = []
    for one, other, drop in promising_pairs(screened, PAIRS):
        if drop > BETTER * best_drop:
            starts.append([(*judge.on_top, one.hypothesis.at(one.values), other.hypothesis.at(other.values))])
    return fit_together(judge, starts, on_progress=on_progress) if starts else []


def _settle(
    state: _State, evidence: Evidence, taken: Setting, rivals: list[list[Term]], first: Judge, tries: int, on_progress: Progress | None
) -> bool:
    """Take the starts anew under the new setting, fit it and its alternatives again, and keep what stands; whether that is anything new."""
    always = len(state.always)
    standing = None
    for _ in range(SETTLINGS):
        linear = _relinearised(state, evidence, taken, on_progress)
        base = Judge(linear, taken[:always], floor=first.floor)
        full = _alternatives(taken, always, rivals)
        less = [taken[:k] + taken[k + 1 :] for k in range(always, len(taken))] if len(taken) - always > 1 else []
        fitted = fit_together(base, [[setting] for setting in (*full, *less)], on_progress=on_progress)
        kept, shorter = fitted[: len(full)], fitted[len(full) :]
        scores = rank(linear, kept, judge=base)
        standing = Standing(judge=base, fitted=tuple(kept), scores=scores, confounded=groups(scores, kept, base.metric.edges))
        state.replays += base.replays
        winner = kept[standing.confounded.order[0] - 1]
        if shorter:
            against = rank(linear, [winner, *shorter], judge=base)
            needless = [k for k in range(len(shorter)) if not is_accepted(against, 1, 2 + k, base, tries=tries, excess=first.excess)]
            if needless:
                k = min(needless, key=lambda k: against.ahead[1, 2 + k])
                taken, rivals = shorter[k].setting, rivals[:k] + rivals[k + 1 :]
                if _same_pieces(taken, state.setting):
                    return False
                continue
        settled = _same_pieces(winner.setting, taken)
        taken = winner.setting
        if settled:
            break
    if standing is None or _same_pieces(taken, state.setting):
        return False
    state.pieces, state.rivals, state.standing = list(taken[always:]), rivals, standing
    state.replays += state.judge.replays
    state.judge = Judge(standing.judge.evidence, taken, floor=first.floor)
    return True


def _relinearised(state: _State, evidence: Evidence, taken: Setting, on_progress: Progress | None) -> Evidence:
    """The evidence with starts fitted under a setting; as it was, if that explains less."""
    if on_progress is not None:
        on_progress("fitting the starts of windows again", 0.0)
    before, linear = state.judge.evidence, evidence.relinearised(taken)
    old, new = (Judge(one, taken, floor=state.judge.floor) for one in (before, linear))
    state.replays += 2
    if new.chi2 / new.degrees > WORSE * old.chi2 / old.degrees:
        state.notes.append("starts fitted under the new model explain less than those before; the latter are kept")
        return before
    return linear


def _alternatives(taken: Setting, always: int, rivals: Sequence[Sequence[Term]]) -> list[Setting]:
    """The setting itself, and each of its pieces against its rivals; also against simpler ones of its target, whosever rivals they were."""
    found = [taken]
    most = RIVALS if len(rivals) == 1 else RIVALS // 2
    for k, own in enumerate(rivals, start=always):
        piece = taken[k].hypothesis
        others = [term for term in own if not _same(term.hypothesis, piece)][:most]
        others += [t for each in rivals for t in each if t.hypothesis.target == piece.target and len(t.hypothesis.free) < len(piece.free)]
        for term in others:
            setting = (*taken[:k], term, *taken[k + 1 :])
            if not any(_same(term.hypothesis, t.hypothesis) for t in taken) and not any(_same_pieces(setting, one) for one in found):
                found.append(setting)
    return found


def _same(one: Hypothesis, other: Hypothesis) -> bool:
    return (one.cause, one.kind, one.target) == (other.cause, other.kind, other.target)


def _same_pieces(one: Setting, other: Setting) -> bool:
    return {(t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target) for t in one} == {
        (t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target) for t in other
    }


def _verdict(state: _State, first: Judge) -> Verdict:
    """Of the whole search."""
    if state.pieces and state.standing is not None:
        return verdict_of(state.standing, tuple(state.pieces), leftover_share(first, state.judge))
    if not differs(first):
        return "nothing_missing"
    undecided = (
        state.standing is not None
        and min(one.chi2 for one in state.standing.fitted) - first.floor * first.degrees < UNDECIDED * first.excess
    )
    if undecided:
        state.notes.append(
            "some hypotheses would explain the difference, but none predicts windows that it was not fitted to clearly better"
        )
    return "cannot_know" if undecided else "unknown"


def _answer(state: _State, first: Judge, kinds: Mapping[str, EffectKind], verdict: Verdict) -> Found:
    leftover = leftover_share(first, state.judge)
    always = len(state.always)
    rows, grouped, none = ranked(state.standing, always, leftover, kinds) if state.standing else ((), (), 1.0)
    best = state.standing.fitted[state.standing.confounded.order[0] - 1] if state.standing and state.pieces else None
    numbers = estimates(best, state.judge.metric.edges)[always:] if best else ()
    return Found(
        verdict=verdict,
        setting=state.setting,
        terms=named_terms(numbers, tuple(state.pieces), kinds),
        ranked=rows,
        groups=grouped,
        leftover=leftover,
        chi2_before=first.chi2,
        chi2_after=state.judge.chi2,
        degrees=first.degrees,
        degrees_after=state.judge.degrees,
        kappa=max(1.0, state.judge.chi2 / max(state.judge.degrees, 1.0)),
        nothing=none,
        evidence=state.judge.evidence,
        replays=state.replays + state.judge.replays,
        notes=tuple(dict.fromkeys(state.notes)),
    )
