"""Short pushes on any machine, in windows: laws of the catalogue that act from a moment on for a while, their number not told.

A push in one window changes nothing in another, which starts anew from the recording. So one replay tries a law in every window at once, at
the same place of each; a few places and lengths tell for each window what it would gain. Windows that gain more than chance, more than
windows of this model usually miss, and most of what they miss are pushes; neighbours that one law explains are one push, fitted with its
own moment, length and size.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rille.diagnosis.evidence import Evidence, Metric
from rille.diagnosis.fit import estimates, fit
from rille.model.diagnosis import Transient
from rille.model.hypothesis import Hypothesis, Setting, Term

Array = NDArray[np.float64]
LENGTHS = ((0.0, 1.0), (0.0, 0.5), (0.5, 0.5), (0.0, 0.25), (0.25, 0.25), (0.5, 0.25), (0.75, 0.25))  # start, length in windows
FALSE_ALARMS = 0.01  # of a whole search
MOST_MISSED = 0.5  # of what a window lacks that a push may leave
MOST = 12
DECLARED = 1.96  # standard errors of an interval


@dataclass(frozen=True, slots=True, kw_only=True)
class _Try:
    """A law with its numbers at one place of every window. gain (W,): chi-squared that each window would win."""

    hypothesis: Hypothesis
    place: tuple[float, float]
    amplitudes: Array
    gain: Array
    numbers: int


def momentary(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is a law of a moment: its time is looked for, and it has a length."""
    searched = [n for n in hypothesis.free if not n.amplitude]
    return hypothesis.cause == "effect" and sum(n.search == "time" for n in searched) == 1 and len(searched) == 2


def find_transients(
    evidence: Evidence,
    hypotheses: Sequence[Hypothesis],
    names: Sequence[str],
    *,
    on_top: Setting = (),
    on_progress: Callable[[int, int, str], None] | None = None,
) -> tuple[Transient, ...]:
    """Pushes in windows of recordings, in their order and that of time.

    Parameters
    ----------
    hypotheses : of them the laws of a moment are tried. names : of the recordings, in the order of ``evidence.run``. on_top : what is
        known to be missing besides.
    """
    laws = [h for h in hypotheses if momentary(h)]
    metric = Metric(evidence.window, evidence.start_gain)
    base = metric.whitened(evidence.residuals([on_top]))[0]
    lacking = np.array([float(g[0, 0]) for g in metric.gram(base[None])])
    usual = max(1.0, float(np.median(lacking / np.maximum(metric.degrees, 1.0))))
    tries: list[_Try] = []
    for k, law in enumerate(laws):
        if on_progress:
            on_progress(k, len(laws), f"pushes: {law.title}")
        tries += [_tried(evidence, metric, base, on_top, law, place) for place in LENGTHS]
    tests = len(tries) * len(lacking)
    found: dict[int, _Try] = {}
    for w in range(len(lacking)):
        excess = lacking[w] - usual * metric.degrees[w]
        best = min(tries, key=lambda t: float(chi2.logsf(t.gain[w] / usual, t.numbers)), default=None)
        if best is None or excess <= 0:
            continue
        chance = chi2.sf(best.gain[w] / usual, best.numbers) * tests
        if chance < FALSE_ALARMS and best.gain[w] > (1 - MOST_MISSED) * excess:
            found[w] = best
    pushes = [_push(evidence, names, on_top, windows, found, lacking, usual) for windows in _runs(evidence, found)[:MOST]]
    return tuple(sorted((p for p in pushes if p is not None), key=lambda p: (list(names).index(p.recording), p.start)))


def _tried(evidence: Evidence, metric: Metric, base: Array, on_top: Setting, law: Hypothesis, place: tuple[float, float]) -> _Try:
    """Linear gain of a law at that place of every window."""
    amplitudes = [n for n in law.free if n.amplitude]
    settings = [(*on_top, *(_term(evidence, law, w, place, {n.name: n.spread}) for w in range(len(evidence.starts)))) for n in amplitudes]
    signatures = base - metric.whitened(evidence.residuals(settings))
    signatures = np.where(np.isfinite(signatures), signatures, 0.0)
    sizes, gains = np.zeros((len(evidence.starts), len(amplitudes))), np.zeros(len(evidence.starts))
    for w, gram in enumerate(metric.gram(np.concatenate([signatures, base[None]]))):
        matrix, along = gram[:-1, :-1], gram[:-1, -1]
        sizes[w] = np.linalg.pinv(matrix, rcond=1e-8, hermitian=True) @ along
        gains[w] = float(along @ sizes[w])
    return _Try(hypothesis=law, place=place, amplitudes=sizes, gain=gains, numbers=len(amplitudes))


def _term(evidence: Evidence, law: Hypothesis, window: int, place: tuple[float, float], values: dict[str, float]) -> Term:
    """The law at a place of one window."""
    length = float(evidence.stops[window] - evidence.starts[window])
    when = next(n.name for n in law.free if n.search == "time" and not n.amplitude)
    lasting = next(n.name for n in law.free if n.search != "time" and not n.amplitude)
    return law.at({when: float(evidence.starts[window]) + place[0] * length, lasting: place[1] * length, **values})


def _runs(evidence: Evidence, found: dict[int, _Try]) -> list[list[int]]:
    """Windows in a row of one recording with one law, strongest first."""
    runs: list[list[int]] = []
    for w in sorted(found):
        last = runs[-1][-1] if runs else -2
        together = w == last + 1 and evidence.run[w] == evidence.run[last]
        if together and found[w].hypothesis is found[last].hypothesis and float(found[w].amplitudes[w] @ found[last].amplitudes[last]) > 0:
            runs[-1].append(w)
        else:
            runs.append([w])
    return sorted(runs, key=lambda run: -sum(float(found[w].gain[w]) for w in run))


def _push(
    evidence: Evidence,
    names: Sequence[str],
    on_top: Setting,
    windows: Sequence[int],
    found: dict[int, _Try],
    lacking: Array,
    usual: float,
) -> Transient | None:
    """One push, fitted over its windows and their neighbours; None if the fit does not keep what the search promised."""
    strongest = max(windows, key=lambda w: float(found[w].gain[w]))
    one, law = found[strongest], found[strongest].hypothesis
    run = evidence.run[strongest]
    near = np.array([w for w in range(windows[0] - 1, windows[-1] + 2) if 0 <= w < len(evidence.run) and evidence.run[w] == run])
    spreads = {n.name: n.spread * float(a) for n, a in zip([n for n in law.free if n.amplitude], one.amplitudes[strongest], strict=True)}
    part = evidence.subset(near)
    here = int(np.searchsorted(near, strongest))
    fitted = fit(part, (*on_top, _term(part, law, here, one.place, spreads)))
    gain = float(lacking[near].sum()) - fitted.chi2
    if gain < (1 - MOST_MISSED) * float(lacking[list(windows)].sum() - usual * fitted.degrees * len(windows) / len(near)):
        return None
    numbers = estimates(fitted, Metric(part.window, part.start_gain).edges)[-1]
    term = fitted.setting[-1]
    free = term.hypothesis.free
    amplitudes = [k for k, n in enumerate(free) if n.amplitude]
    main = max(amplitudes, key=lambda k: abs(term.values[k]) / free[k].spread)
    start = next(v for n, v in zip(free, term.values, strict=True) if n.search == "time" and not n.amplitude)
    lasting = next(v for n, v in zip(free, term.values, strict=True) if n.search != "time" and not n.amplitude)
    return Transient(
        recording=names[int(run)],
        kind=law.kind,
        target=law.target,
        component=free[main].name,
        start=start,
        duration=lasting,
        peak_time=start + lasting / 2,
        amplitude=term.values[main],
        amplitude_error=(numbers[main].high - numbers[main].low) / (2 * DECLARED),
        score=float(np.sqrt(max(gain, 0.0) / usual)),
        probability=1.0 - FALSE_ALARMS,
    )
