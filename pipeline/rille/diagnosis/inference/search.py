"""The search for what is missing: screen, fit, rank, accept, look again on top of it, and say what could not be told apart.

Greedy over pieces, with two safeguards: pairs that promise more than any single piece are fitted jointly from the start, and after each
piece all alternatives (each accepted piece against its rivals, or left out) are fitted again with the starts of the windows taken under the
new model. A piece stays only if it predicts windows that it was not fitted to, by more than two standard errors and the price of having
looked at many (``accept.py``).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.hypotheses.shape_tries import Tries
from rille.diagnosis.inference.accept import LEAST_OF_IT, LEAST_SHARE, differs, is_accepted, is_trifle, loud_channels, noise_of
from rille.diagnosis.inference.doubt import DOUBTED, brief, doubt, vague
from rille.diagnosis.inference.fit import Fitted, estimates, fit_together
from rille.diagnosis.inference.found import Found, leftover_share, named_terms, ranked, stand, verdict_of, with_doubt
from rille.diagnosis.inference.judge import Judge, Progress
from rille.diagnosis.inference.moments import busy_spans, is_momentary, moment_tries, shared_moment
from rille.diagnosis.inference.pairs import promising_pairs
from rille.diagnosis.inference.rank import GROSS, rank
from rille.diagnosis.inference.reach import may_show
from rille.diagnosis.inference.rivals import elsewhere, rivals_of, same
from rille.diagnosis.inference.screen import Screened, alike, screen
from rille.diagnosis.inference.settle import State, exchange, own_fit, own_fit_in_the_end, settle
from rille.model.diagnosis import NAMING, Verdict
from rille.model.effect import EffectKind
from rille.model.hypothesis import Hypothesis, Setting, Term

LEAST_WINDOWS = 4
LEAST_DEGREES = 20.0
SURVIVORS = 12  # of the screen, that are fitted
WORTH, WORTH_OF_A_PLACE = 0.3, 0.1  # of the best's drop of chi-squared, that a survivor promises at least; where few places were tried
LITTLE = 0.02  # share of the excess that is left by a law of few numbers, below which no more costly hypotheses are tried
FEW_NUMBERS = 2
MOMENTARY = 2  # hypotheses that are looked for all over the time, if something short happened
PAIRS = 4  # that are fitted jointly
BETTER = 1.1  # drop that a pair must promise, over that of the best piece alone
ALIKE, STAND_INS = 0.8, 4  # correlation of what two hypotheses change, from which one may stand in the other's place; so many at most
CHANCES = 3  # hypotheses that do not keep what they promise, that are tried under starts of their own
BROKEN = 1.5  # promise over what they keep, for that
BEST = 2  # hypotheses that explain most, for the same, where none is accepted; and that are fitted so to the end
OUT_OF_REACH = 4.0  # times what the best so far leaves, that one leaves under starts of its own which is not fitted to the end
NOTHING_FITS = 0.1  # share of chi-squared that the best so far leaves, from which on faults that are there or not are tried
MOST_ASTRAY, NEARLY_ALL = 0.25, 0.9  # share of the windows that went astray, at most, and of the excess that they hold, at least
WHOLE_FAULTS = 6  # channels that are tried turned round where nothing fits
TOLD = 0.01  # relative width of the bounds of an amplitude that is told beforehand
UNDECIDED = 0.5  # share of the excess that a hypothesis leaves, that was not accepted but may be right


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
        found = f"{judge.metric.n_windows} windows with {judge.degrees:.0f} degrees of freedom"
        note = f"{found} are too few to hold any out; record longer, or take shorter windows"
        return _answer(State(always=always, first=judge, judge=judge, notes=[note]), kinds or {}, "cannot_know")
    if any(number for term in always for number in term.hypothesis.free):
        always = fit_together(judge, [[always]], on_progress=on_progress)[0].setting
        judge = Judge(evidence, always, floor=floor)
    state = State(always=always, first=judge, judge=judge)
    _begin_beside_what_went_astray(state, evidence, hypotheses, most, tries, on_progress)
    while True:
        _look_as_long_as_it_pays(state, evidence, hypotheses, most, tries, on_progress)
        verdict = _verdict(state)
        if verdict not in NAMING or state.standing is None:
            return _answer(state, kinds or {}, verdict)
        group = [i for i in state.standing.confounded.order if state.standing.confounded.number[i] == 0]
        open_ones = {t.hypothesis.title for i in group for t in state.standing.fitted[i - 1].setting}
        taken_away = state.first.chi2 - state.judge.chi2
        against, other = doubt(state.judge, hypotheses, open_ones, taken_away, on_progress)
        answer = _answer(state, kinds or {}, verdict)
        against = against or vague(answer.terms) or brief(state.judge, tuple(state.pieces), taken_away)
        if not against:
            return answer
        # Where noise is overstated, chi-squared as a whole hides another piece: what speaks against the answer may be a part of it.
        if len(state.pieces) < most and _look(state, evidence, hypotheses, most - len(state.pieces), tries, on_progress):
            continue
        if other is not None and _in_its_place(state, evidence, other, len(hypotheses), on_progress):
            continue
        state.notes.append(against)
        return with_doubt(_answer(state, kinds or {}, "unknown"), DOUBTED)


def _begin_beside_what_went_astray(
    state: State, evidence: Evidence, hypotheses: Sequence[Hypothesis], most: int, tries: Tries | None, on_progress: Progress | None
) -> None:
    """Settle on what explains the other windows, where a few that went astray hold nearly all of the misfit and the others differ, too.

    Where motion is unstable, a pendulum that passes its top, one such window drowns all others; from the starts of the base nothing brings
    it back, and whatever throws it elsewhere by chance seems to explain all. What is found beside it has starts of its own there, too, and
    the search goes on with all windows.
    """
    judge = state.judge
    beyond = judge.window_excess
    astray = beyond > GROSS * judge.floor * judge.window_degrees
    few = 0 < np.count_nonzero(astray) <= MOST_ASTRAY * len(astray) and np.count_nonzero(~astray) >= LEAST_WINDOWS
    if not few or np.sum(beyond[astray]) < NEARLY_ALL * judge.excess:
        return
    some = evidence.subset(np.flatnonzero(~astray))
    others = Judge(some, state.always, floor=judge.floor)
    if not differs(others):
        return
    begun = State(always=state.always, first=others, judge=others)
    _look_as_long_as_it_pays(begun, some, hypotheses, most, tries, on_progress)
    state.replays += begun.replays + begun.judge.replays
    if begun.pieces:
        own, linear = own_fit_in_the_end(evidence, begun.setting, state)
        settle(state, evidence, own, begun.rivals, len(hypotheses), on_progress, under=linear)


def _in_its_place(state: State, evidence: Evidence, other: Term, tries: int, on_progress: Progress | None) -> bool:
    """Whether a law that would take more away on top of the answer stands in the place of a piece at its target with fewer numbers: a wider
    one, such as friction that falls with speed, where friction was found.
    """
    law = other.hypothesis
    for number, piece in enumerate(state.pieces):
        narrow = piece.hypothesis
        if narrow.target == law.target and len(narrow.free) < len(law.free):
            return exchange(state, evidence, number, other, tries, on_progress)
    return False


def _look_as_long_as_it_pays(
    state: State, evidence: Evidence, hypotheses: Sequence[Hypothesis], most: int, tries: Tries | None, on_progress: Progress | None
) -> None:
    """Piece after piece, up to ``most``, until nothing that is left is worth it or none is accepted."""
    while len(state.pieces) < most and _worth_looking(state):
        if not _look(state, evidence, hypotheses, most - len(state.pieces), tries, on_progress):
            return


def _worth_looking(state: State) -> bool:
    """Whether enough is left that another piece could be accepted. The first look is always worth it: noise may be overstated."""
    return not state.pieces or (differs(state.judge) and not is_trifle(state.judge, state.first))


def _look(
    state: State, evidence: Evidence, hypotheses: Sequence[Hypothesis], most: int, tries: Tries | None, on_progress: Progress | None
) -> bool:
    """One more piece (or two) on top of what is accepted; whether any was."""
    judge = state.judge
    remaining = [h for h in hypotheses if not any(same(h, piece.hypothesis) for piece in state.pieces)]
    screened, singles = _fitted_singles(judge, remaining, tries, on_progress)
    pairs = _fitted_pairs(screened, judge.chi2 - min(one.chi2 for one in singles), on_progress) if singles and most > 1 else []
    n, first = screened.tries, state.first
    scores = rank(judge.evidence, [*singles, *pairs], judge=judge)
    if not state.pieces and singles:
        state.standing = stand(judge, judge.evidence, singles)
    order = sorted(range(1, len(singles) + 1), key=lambda i: -scores.gain[i])
    taken = singles[order[0] - 1] if order and is_accepted(scores, order[0], 0, judge, tries=n, first=first) else None
    pair = max(range(len(singles) + 1, len(singles) + len(pairs) + 1), key=lambda i: scores.gain[i], default=None)
    if pair is not None and all(is_accepted(scores, pair, other, judge, tries=n * n, first=first) for other in (order[0], 0)):
        taken = pairs[pair - len(singles) - 1]
    chances = _second_chances(state, evidence, screened, singles, taken, on_progress)
    under = judge.evidence
    if chances and (taken is None or chances[0][0].chi2 < taken.chi2) and state.accepts(chances[0][0], None, n):
        taken, under = chances[0]
    if taken is None:
        if not singles:
            state.notes.append("no hypothesis changes the recordings towards what was measured")
        return False
    tried, fitted = [one for one, _ in chances], [singles[i - 1] for i in order]
    rivals = [rivals_of(_alike(screened, piece.hypothesis), tried, fitted, judge.chi2) for piece in taken.setting[len(judge.on_top) :]]
    return settle(state, evidence, taken, [*state.rivals, *rivals], n, on_progress, under=under)


def _alike(screened: Screened, hypothesis: Hypothesis) -> list[Term]:
    """The hypotheses that change the residuals most as a given one does: who could stand in its place, whatever they explain alone. The
    same law elsewhere comes first: before and behind a gear it does the same.
    """
    own = next((s for s in screened.signatures if same(s.hypothesis, hypothesis)), None)
    if own is None or not np.any(own.direction):
        return []
    found = []
    for s in (one for one in screened.signatures if one is not own):
        likeness, values = alike(own, s)
        if likeness > ALIKE or (likeness < -ALIKE and not s.one_sided):
            found.append((elsewhere(s.hypothesis, hypothesis), abs(likeness), s.hypothesis.at(values)))
    return [term for *_, term in sorted(found, key=lambda one: one[:2], reverse=True)[:STAND_INS]]


def _second_chances(
    state: State,
    evidence: Evidence,
    screened: Screened,
    singles: Sequence[Fitted],
    taken: Fitted | None,
    on_progress: Progress | None,
) -> list[tuple[Fitted, Evidence]]:
    """Hypotheses whose signatures promise far more than they keep, and more than the best so far keeps: fitted under starts of their own,
    best first, and the evidence with these.

    A wheel that should stand deeper bounces in every window that begins at the depth of the base model. Faults that are there or not, as of
    a sensor that is turned round, put all starts elsewhere: where nothing fits they have their chance, too. So have the best where
    they explain much and none can be accepted: a flywheel that a ripple catches leaves so much in one window, from the starts of the base,
    that all others count for nothing.
    """
    judge = state.judge
    kept = judge.chi2 - taken.chi2 if taken is not None else 0.0
    promising = sorted((s for s in screened.signatures if s.linear is not None), key=lambda s: -(s.linear or (0.0, {}))[0])
    terms = []
    for s in promising[:CHANCES]:
        share, values = s.linear or (0.0, {})
        if share * judge.chi2 > max(kept, BROKEN * max(s.drop, LEAST_SHARE * judge.degrees)):
            terms.append(s.hypothesis.at(values))
    left = judge.chi2 - kept
    terms += _whole_faults(screened, gross=left > max(GROSS * judge.degrees, NOTHING_FITS * judge.chi2))
    if taken is None:
        much = max(LEAST_OF_IT * judge.excess, LEAST_SHARE * judge.degrees)
        terms += [one.setting[-1] for one in sorted(singles, key=lambda one: one.chi2)[:BEST] if judge.chi2 - one.chi2 > much]
    found = []
    for k, term in enumerate(terms):
        if on_progress is not None:
            on_progress("trying other starts", k / len(terms))
        found.append(own_fit(evidence, (*judge.on_top, term), state))
    found.sort(key=lambda one: one[0].chi2)
    near = [one for one in found[:BEST] if taken is None or one[0].chi2 < OUT_OF_REACH * left]
    best = [own_fit_in_the_end(evidence, one.setting, state) for one, _ in near]  # what one turn leaves may still be much
    return sorted([*best, *found[len(near) :]], key=lambda one: one[0].chi2)


def _whole_faults(screened: Screened, *, gross: bool) -> list[Term]:
    """Hypotheses whose amplitude is far from absent or absent, of the channels that differ most: all of them where the misfit is gross,
    else those whose amplitude the recording itself tells (the end of a range, where samples stop).
    """
    judge = screened.judge
    beyond = judge.per_channel(judge.base**2)
    worst = [judge.evidence.channels[k].name for k in np.argsort(-beyond, kind="stable")[:WHOLE_FAULTS]]
    found = []
    for h in (s.hypothesis for s in screened.signatures if s.hypothesis.target in worst):
        amplitudes = [n for n in h.free if n.amplitude]
        told = any(n.lower > max(n.absent, (1 - TOLD) * n.upper) for n in amplitudes)
        if told or (gross and any(n.lower > n.absent for n in amplitudes)):
            found.append(h.at({n.name: n.start if told else n.upper for n in amplitudes}))
    return found


def _fitted_singles(judge: Judge, hypotheses: Sequence[Hypothesis], tries: Tries | None,
                    on_progress: Progress | None) -> tuple[Screened, list[Fitted]]:  # fmt: skip
    """All hypotheses screened, and the best fitted. Those with whole numbers, which take many trials, only if others leave something."""
    cheap = [h for h in hypotheses if all(n.search != "order" for n in h.free)]
    audible = loud_channels(judge)
    costly = [h for h in hypotheses if h not in cheap and may_show(h, judge.evidence.channels, audible)]
    screened, singles, done = Screened(judge=judge, signatures=(), tries=0), [], []
    for part in (cheap, costly):
        simple = min((one.chi2 for one in singles if one.count <= FEW_NUMBERS), default=judge.chi2)
        noise = noise_of(judge, simple, judge.degrees) * judge.degrees
        if not part or (singles and simple - noise < LITTLE * (judge.chi2 - noise)):
            continue
        more = screen(judge.evidence, part, tries=tries, judge=judge, on_progress=on_progress)
        signatures = sorted((*screened.signatures, *more.signatures), key=lambda s: (s.silent, -s.drop, len(s.hypothesis.free)))
        screened = Screened(judge=judge, signatures=tuple(signatures), tries=screened.tries + more.tries)
        loud = [s for s in signatures if not s.silent and s.drop > 0]
        chosen = [s for s in loud if s.drop > _worth(s.hypothesis) * loud[0].drop and s.hypothesis not in done][:SURVIVORS]
        done += [s.hypothesis for s in chosen]
        singles += fit_together(judge, [[(*judge.on_top, s.hypothesis.at(s.values))] for s in chosen], on_progress=on_progress)
    return screened, _at_the_moment(judge, screened, singles, hypotheses, on_progress)


def _worth(hypothesis: Hypothesis) -> float:
    """Share of the best's drop that it must promise to be fitted."""
    return WORTH_OF_A_PLACE if any(number.search == "place" for number in hypothesis.free) else WORTH


def _at_the_moment(
    judge: Judge, screened: Screened, singles: list[Fitted], hypotheses: Sequence[Hypothesis], on_progress: Progress | None
) -> list[Fitted]:
    """The fits; those about a moment begun anew, where that is better: all over the time in which something short must have happened,
    and at the moment that the best of them found. Not where a law that lasts explains everything.
    """
    best = min(singles, key=lambda one: one.chi2, default=None)
    chi2 = best.chi2 if best is not None else judge.chi2
    noise = noise_of(judge, chi2, judge.degrees) * judge.degrees
    explained = chi2 - noise <= LITTLE * (judge.chi2 - noise)
    if best is not None and explained and not is_momentary(best.setting[-1].hypothesis):
        return singles
    found = singles
    short = [s.hypothesis for s in screened.signatures if not s.silent and is_momentary(s.hypothesis)][:MOMENTARY]
    spans = busy_spans(judge) if short and not explained else ()
    if spans:
        found = _begun_anew(judge, found, short, {h.title: moment_tries(h, spans) for h in short}, on_progress)
    moment = shared_moment(found, hypotheses, base=judge.chi2, worth=WORTH)
    others = [h for h in hypotheses if h.title in moment]
    return _begun_anew(judge, found, others, moment, on_progress) if moment else found


def _begun_anew(
    judge: Judge, singles: Sequence[Fitted], hypotheses: Sequence[Hypothesis], tries: Tries, on_progress: Progress | None
) -> list[Fitted]:
    """The fits, and those of some hypotheses begun at other shapes, where these are better."""
    screened = screen(judge.evidence, hypotheses, tries=tries, judge=judge, on_progress=on_progress)
    best_drop = judge.chi2 - min((one.chi2 for one in singles), default=judge.chi2)
    loud = [s for s in screened.signatures if s.drop > WORTH * best_drop]
    anew = fit_together(judge, [[(*judge.on_top, s.hypothesis.at(s.values))] for s in loud], on_progress=on_progress)
    best: dict[str, Fitted] = {}
    for one in (*singles, *anew):
        title = one.setting[-1].hypothesis.title
        if title not in best or one.chi2 < best[title].chi2:
            best[title] = one
    return list(best.values())


def _fitted_pairs(screened: Screened, best_drop: float, on_progress: Progress | None) -> list[Fitted]:
    """Joint fits of the pairs that promise more than the best piece alone."""
    judge = screened.judge
    starts = []
    for one, other, drop in promising_pairs(screened, PAIRS):
        if drop > BETTER * best_drop:
            starts.append([(*judge.on_top, one.hypothesis.at(one.values), other.hypothesis.at(other.values))])
    return fit_together(judge, starts, on_progress=on_progress) if starts else []


def _verdict(state: State) -> Verdict:
    """Of the whole search."""
    first = state.first
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


def _answer(state: State, kinds: Mapping[str, EffectKind], verdict: Verdict) -> Found:
    first, always = state.first, len(state.always)
    leftover = leftover_share(first, state.judge)
    rows, grouped, none = ranked(state.standing, always, leftover, kinds) if state.standing else ((), (), 1.0)
    best = state.standing.fitted[state.standing.confounded.order[0] - 1] if state.standing and state.pieces else None
    numbers = estimates(best, first.metric.edges)[always:] if best else ()
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
