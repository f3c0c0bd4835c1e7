"""Whether an answer that reaches the noise is the truth, or only does alike: a law that is right leaves nothing for any other.

A law that is not in the catalogue is often followed closely by one that is, so closely that chi-squared as a whole shows nothing. But what
it leaves has a shape, and some other hypothesis of the catalogue would take a part of that away. On top of the right answer the largest
drop of chi-squared that any hypothesis of k numbers promises is that of chance: chi-squared of k degrees, the largest of all tries.

Where so little is left that it is near the noise, though surely more, and nothing explains it, the law is not quite that one either. Where
far more is left other things are missing, too, as in every real machine: that says nothing of what was found, unless one law alone would
take most of it away.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from rille.diagnosis.inference.accept import SIGNIFICANT, differs
from rille.diagnosis.inference.fit import is_told
from rille.diagnosis.inference.judge import Judge, Progress
from rille.diagnosis.inference.moments import is_momentary
from rille.diagnosis.inference.screen import screen
from rille.model.diagnosis import Estimate, NamedTerm
from rille.model.hypothesis import Hypothesis, Setting, Term

LEAST_OF_FOUND, LEAST_OF_NOISE = 5e-3, 0.01  # of what was found and of the noise (a tenth of its RMS): closer to a machine no model is
CHANCE = 1e-2  # probability of a doubt of a right answer
TOO_MANY = ("order", "place", "time")  # numbers whose search takes many trials: what has them takes most away by chance, too
SURE = 0.1  # excess per degree, in terms of the noise, that is no matter of steps and of samples beside jumps
NEAR_NOISE = 0.3  # excess per degree, in terms of the noise, up to which an answer is near it
MOST_OF_REST = 0.5  # of the excess: what takes more away on top, of what is far from the noise, is one thing and not many
OTHER = (
    "on top of what was found, {other} would take more away than chance does (chi-squared {drop:.3g}): it only acts like what is missing, "
    "or not alone"
)
LEFT = "what was found leaves little, but more than noise, that nothing explains: it only acts like what is missing, or not alone"
VAGUE = "no number of {title} is told by these recordings ({numbers}): it only acts like what is missing"
BRIEF = (
    "{title} is about a moment, and at all other times more is left than it takes away, if noise is what it is taken for: it may be a "
    "piece of something that lasts; state the noise of the sensors"
)
DOUBTED = 0.75  # probability of none of the catalogue, at least, where there is doubt


def doubt(
    judge: Judge, hypotheses: Sequence[Hypothesis], known: Collection[str], found: float = 0.0, on_progress: Progress | None = None
) -> tuple[str, Term | None]:
    """What speaks against the base of a judge, which should be right, in words; '' if nothing does. And the law that does, if one does.

    known : titles of hypotheses that the answer leaves open. found : chi-squared that the answer takes away; what is little
    beside that, and beside the noise, raises no doubt.
    """
    sure = max(SIGNIFICANT * float(np.sqrt(2.0 * judge.degrees)), SURE * judge.degrees) * judge.floor
    near = NEAR_NOISE * judge.floor * judge.degrees
    if differs(judge) and sure < judge.excess < near:
        return LEFT, None
    others = [h for h in hypotheses if h.title not in known and all(n.search not in TOO_MANY for n in h.free)]
    screened = screen(judge.evidence, others, judge=judge, on_progress=on_progress)
    against, by = "", None
    least, trifle = CHANCE / max(screened.tries, 1), min(LEAST_OF_FOUND * found, LEAST_OF_NOISE * judge.floor * judge.degrees)
    if judge.excess >= near:
        trifle = max(trifle, MOST_OF_REST * judge.excess)
    for s in screened.signatures:
        chance = float(chi2.sf(s.drop / judge.floor, len(s.hypothesis.free)))
        if not s.silent and chance < least and s.drop > trifle:
            against, by, least = OTHER.format(other=s.hypothesis.title, drop=s.drop), s.hypothesis.at(s.values), chance
    return against, by


def vague(terms: Sequence[NamedTerm]) -> str:
    """Which term has no amplitude that differs from none by its interval, though the term is needed, in words; '' if all have one.

    A law with many numbers, all of them open, bends to many shapes: a cable that might be anywhere pulls as any spring does. One of several
    amplitudes and nothing else does not: an offset of a centre of mass, whose three parts are told only together, is told.
    """
    for one in terms:
        pairs = list(zip(one.term.hypothesis.free, one.estimates, strict=True))
        shapeless = len(pairs) > 1 and all(n.amplitude for n, _ in pairs)
        if any(n.amplitude for n, _ in pairs) and not any(
            is_told(n, _given_others(e) if shapeless else e) for n, e in pairs if n.amplitude
        ):
            numbers = ", ".join(f"{e.name} {e.low:.3g} to {e.high:.3g} {e.unit}" for n, e in pairs if n.amplitude)
            return VAGUE.format(title=one.term.hypothesis.title, numbers=numbers)
    return ""


def _given_others(estimate: Estimate) -> Estimate:
    """A number with the interval that it had if all others were known."""
    share = float(np.sqrt(max(0.0, 1.0 - estimate.conditioning**2)))
    low, high = (estimate.value + share * (end - estimate.value) for end in (estimate.low, estimate.high))
    return replace(estimate, low=low, high=high)


def brief(judge: Judge, pieces: Setting, found: float) -> str:
    """What speaks against an answer that is all about moments, in words; '' if nothing does.

    Noise that is not stated may be understated, so that much may be left of it (``Judge.floor``). Beside laws that last that is no matter;
    but a push in one place of what is too loud everywhere has a moment of its own where that is loudest.

    judge : under the answer. pieces : of the answer. found : chi-squared that it takes away.
    """
    if all(is_momentary(piece.hypothesis) for piece in pieces) and judge.chi2 - judge.degrees > found:
        return BRIEF.format(title=" + ".join(piece.hypothesis.title for piece in pieces))
    return ""
