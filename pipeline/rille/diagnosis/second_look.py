"""What hides where windows meet: a push there is taken up by the start of the window that follows. Windows with other edges show it.

A second look is worth its time where the first one saw nothing, saw something short that it could not name, or found a moment at an edge,
where windows begin in the middle of what happens and numbers come out wrong.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rille.diagnosis.inference.moments import is_momentary
from rille.model.comparison import Comparison
from rille.model.diagnosis import NAMING, Diagnosis

EDGES = 0.5  # of a window, by which the windows of a second look begin later
LEAST = 3.0  # windows that a recording must last for that
NEAR = 0.02  # of a window, from an edge
SEAM = "found with windows that begin {by:.3g} s later: the first windows met where something short happened"


@dataclass(frozen=True, slots=True)
class Look:
    """What was found with some windows. base : the training part beside the base model, in these. differing : channels that
    differ; None where the comparison says nothing of the model.
    """

    diagnosis: Diagnosis
    base: Sequence[Comparison]
    differing: tuple[str, ...] | None


def may_hide(look: Look) -> bool:
    """Whether other edges may show what these do not."""
    diagnosis = look.diagnosis
    if diagnosis.verdict in NAMING:
        return any(_at_an_edge(first, last, look.base) for first, last in _moments(diagnosis))
    return diagnosis.location.shape in ("nowhere", "transient") or diagnosis.verdict == "cannot_know"


def takes_over(other: Diagnosis, diagnosis: Diagnosis) -> bool:
    """Whether what a second look found stands instead of the first: it has a name, or sees something where nothing was seen."""
    return other.verdict in NAMING or (diagnosis.verdict == "nothing_missing" and other.verdict != "nothing_missing")


def _moments(diagnosis: Diagnosis) -> Iterator[tuple[float, float]]:
    """First and last instant [s] of each piece that is about a moment."""
    for term in diagnosis.setting:
        if is_momentary(term.hypothesis):
            at = next(term.numbers[n.name] for n in term.hypothesis.free if n.search == "time")
            yield at, at + next((term.numbers[n.name] for n in term.hypothesis.free if n.search == "scale"), 0.0)


def _at_an_edge(first: float, last: float, base: Sequence[Comparison]) -> bool:
    """Whether a window begins in a span of time [s], or close to it."""
    return any(
        first - NEAR * (window.stop - window.start) < window.start < last + NEAR * (window.stop - window.start)
        for comparison in base
        for window in comparison.windows[1:]
    )
