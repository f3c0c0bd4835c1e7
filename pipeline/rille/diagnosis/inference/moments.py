"""Something short happened: when. The moment is looked for all over the stretches that differ most, and it is the same for all who may have
done it: who found it tells the others.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from rille.diagnosis.hypotheses.shape_tries import Values
from rille.diagnosis.inference.fit import Fitted
from rille.diagnosis.inference.judge import Judge
from rille.model.hypothesis import Hypothesis

SPANS, FEW = 2, 0.35  # stretches that are looked at, and the share of all windows that they may be
CONCENTRATED = 0.7  # share of all that is beyond the noise that they hold, if it was something short
EVERY, LASTING = 8, (0.25, 0.1)  # moments in each, and how long it may last, in terms of the stretch


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


def busy_spans(judge: Judge) -> tuple[tuple[float, float], ...]:
    """Stretches of time [s] of the windows that differ most; () if the difference is not concentrated there."""
    beyond = np.maximum(judge.window_excess, 0.0)
    starts, stops = judge.evidence.starts, judge.evidence.stops
    spans: list[tuple[float, float]] = []
    inside = np.zeros(len(beyond), dtype=bool)
    for w in np.argsort(-beyond, kind="stable"):
        if not inside[w]:
            spans.append((float(starts[w]), float(stops[w])))
            inside |= (starts < stops[w] - 1e-9) & (stops > starts[w] + 1e-9)
        if len(spans) > SPANS or np.mean(inside) > FEW:
            return ()
        if float(np.sum(beyond[inside])) > CONCENTRATED * float(np.sum(beyond)):
            return tuple(spans)
    return ()


def moment_tries(hypothesis: Hypothesis, spans: Sequence[tuple[float, float]]) -> tuple[Values, ...]:
    """Shape numbers of a hypothesis about a moment: moments all over the stretches, short and long ones."""
    shape = [number for number in hypothesis.free if not number.amplitude]
    tries = []
    for first, last in spans:
        for k in range(EVERY):
            at = first + (last - first) * k / EVERY
            for share in LASTING:
                wanted = {"time": at, "scale": share * (last - first)}
                tries.append({n.name: float(np.clip(wanted.get(n.search, n.start), n.lower, n.upper)) for n in shape})
    return tuple(tries)


def is_momentary(hypothesis: Hypothesis) -> bool:
    """Whether it is about a moment."""
    return any(number.search == "time" for number in hypothesis.free)
