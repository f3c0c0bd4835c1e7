"""Rivals of an answer: the settings that they make of it, and where their fits begin."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

from rille.diagnosis.inference.fit import Fitted, fit_together
from rille.diagnosis.inference.found import Standing
from rille.diagnosis.inference.judge import Judge, Progress
from rille.diagnosis.inference.moments import is_momentary
from rille.model.hypothesis import Hypothesis, Setting, Term

RIVALS, MOST = 6, 12  # of each accepted piece, that are fitted again: as many at least, and at most
CLOSE_BEHIND = 0.95  # share of what the best explains, from which on they all are
TOGETHER = 8  # answers in which two pieces are swapped at once
FACTORS = (1.0, 0.6, 1.6, 0.36, 2.6)  # of amplitudes, where the same law begins elsewhere
EITHER_WAY = (0.3, -0.3)  # of amplitudes, where a law about a moment begins at that of another


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


def without_doubles(terms: Sequence[Term]) -> list[Term]:
    """Of each hypothesis the first term."""
    found: list[Term] = []
    for term in terms:
        if not any(same(term.hypothesis, one.hypothesis) for one in found):
            found.append(term)
    return found


@dataclass(frozen=True, slots=True)
class Rivals:
    """Terms for the place of a piece, best first. count : of the first of them, that are fitted again beside the piece."""

    terms: tuple[Term, ...] = ()
    count: int = RIVALS


def rivals_of(alike: Sequence[Term], tried: Sequence[Fitted], singles: Sequence[Fitted], without: float) -> Rivals:
    """The rivals of a piece, at their values so far.

    Starts of windows are still those of the base, under which what is right may be behind what is not: all that are close behind the best
    are looked at again under the starts of the answer.

    Parameters
    ----------
    alike : what changes the residuals as the piece does. tried : fitted under starts of their own. singles : all that were fitted, the best
        predicting first. without : chi-squared of the base.
    """
    most = without - min((one.chi2 for one in singles), default=without)
    close = sorted((one for one in singles if without - one.chi2 > CLOSE_BEHIND * most), key=lambda one: one.chi2)
    first = without_doubles([*alike, *(one.setting[-1] for one in (*tried, *close))])
    terms = without_doubles([*first, *(one.setting[-1] for one in singles)])
    return Rivals(tuple(terms), min(max(len(first), RIVALS), MOST))


def alternatives(taken: Setting, always: int, rivals: Sequence[Rivals]) -> list[Setting]:
    """The setting itself, and each of its pieces against its rivals and simpler ones of its target, whosever rivals they were."""
    found = [taken]
    for k, own in enumerate(rivals, start=always):
        piece = taken[k].hypothesis
        others = [term for term in own.terms if not same(term.hypothesis, piece)][: own.count]
        others += [
            t for each in rivals for t in each.terms if t.hypothesis.target == piece.target and len(t.hypothesis.free) < len(piece.free)
        ]
        for term in others:
            setting = (*taken[:k], term, *taken[k + 1 :])
            if not any(same(term.hypothesis, t.hypothesis) for t in taken) and not any(same_pieces(setting, one) for one in found):
                found.append(setting)
    return found


def with_displaced(rivals: Sequence[Rivals], before: Setting, after: Setting, always: int) -> list[Rivals]:
    """The rivals of each piece; first among those of one that stands in the place of another is that other."""
    found = []
    for own, old, new in zip(rivals, before[always:], after[always:], strict=True):
        terms = own.terms if same(old.hypothesis, new.hypothesis) else tuple(without_doubles([old, *own.terms]))
        found.append(Rivals(terms, own.count))
    return found


def swapped_together(standing: Standing, taken: Setting, always: int) -> list[Setting]:
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


def fitted_beside(judge: Judge, settings: Sequence[Setting], taken: Setting, on_progress: Progress | None) -> list[Fitted]:
    """Settings at their best. One that has a law of ``taken`` at another target is begun where that says, too: before and behind a gear the
    same law has other numbers, and from usual ones a fit may stop elsewhere. So is one that has a law about a moment in the place of
    another: the moment is the same, whoever did it.
    """
    ways = ((_elsewhere, _like, FACTORS), (_another_at_a_moment, _then, EITHER_WAY))
    begun = [[start for way in ways for start in _beginning(setting, taken, *way)] for setting in settings]
    anew = {i: starts for i, starts in enumerate(begun) if starts}
    fitted = fit_together(judge, [*([setting] for setting in settings), *anew.values()], on_progress=on_progress)
    found = fitted[: len(settings)]
    for i, other in zip(anew, fitted[len(settings) :], strict=True):
        found[i] = min(found[i], other, key=lambda one: one.chi2)
    return found


def _beginning(
    setting: Setting,
    taken: Setting,
    which: Callable[[Term, Term], bool],
    how: Callable[[Term, Term, float], Term],
    factors: Sequence[float],
) -> list[Setting]:
    """A setting with each of its terms begun ``how`` that of ``taken`` in the same place says, where ``which`` holds of the two; once for
    each factor of amplitudes. [] if it holds of none.
    """
    pairs = list(zip(setting, taken, strict=True)) if len(setting) == len(taken) else []
    if not any(which(*pair) for pair in pairs):
        return []
    return [tuple(how(*pair, factor) if which(*pair) else pair[0] for pair in pairs) for factor in factors]


def _elsewhere(one: Term, other: Term) -> bool:
    return elsewhere(one.hypothesis, other.hypothesis)


def _another_at_a_moment(one: Term, other: Term) -> bool:
    return not same(one.hypothesis, other.hypothesis) and is_momentary(one.hypothesis) and is_momentary(other.hypothesis)


def _then(term: Term, when: Term, factor: float) -> Term:
    """A term at the moment of another, and as long; amplitudes times ``factor``."""
    values = dict(term.numbers)
    for number in term.hypothesis.free:
        value = number.absent + factor * (values[number.name] - number.absent) if number.amplitude else when.numbers.get(number.name)
        if value is not None:
            values[number.name] = min(max(value, number.lower), number.upper)
    return term.hypothesis.at(values)


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
