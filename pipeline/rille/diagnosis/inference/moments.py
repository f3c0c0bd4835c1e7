"""When something short happened is the same for all who may have done it: who found the moment tells the others."""

from collections.abc import Mapping, Sequence

from rille.diagnosis.hypotheses.shape_tries import Values
from rille.diagnosis.inference.fit import Fitted
from rille.model.hypothesis import Hypothesis


def shared_moment(fitted: Sequence[Fitted], hypotheses: Sequence[Hypothesis], *, base: float, worth: float) -> Mapping[str, tuple[Values]]:
    """By title the shape numbers of the other hypotheses about a moment, with the moment that the best of ``fitted`` has found.

    base : chi-squared without any of them. worth : what the moment must take away of it, as a share of what the best takes away; else {}.
    """
    momentary = [one for one in fitted if is_momentary(one.setting[-1].hypothesis)]
    best = min(momentary, key=lambda one: one.chi2, default=None)
    if best is None or base - best.chi2 <= worth * (base - min(one.chi2 for one in fitted)):
        return {}
    term = best.setting[-1]
    return {
        h.title: ({n.name: term.numbers.get(n.name, n.start) for n in h.free if not n.amplitude},)
        for h in hypotheses
        if is_momentary(h) and h.title != term.hypothesis.title
    }


def is_momentary(hypothesis: Hypothesis) -> bool:
    """Whether it is about a moment."""
    return any(number.search == "time" for number in hypothesis.free)
