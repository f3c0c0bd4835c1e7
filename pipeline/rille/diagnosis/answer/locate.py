"""Where a model differs from recordings: targets, spans of time, conditions, and the shape of it all."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model.comparison import Comparison
from rille.model.diagnosis import Location, Span, TargetScore
from rille.model.difference import Difference, RegimeDifference, WindowDifference

Array = NDArray[np.float64]
Shape = Literal["everywhere", "transient", "place", "regime", "nowhere"]
MOST = 0.8  # share of the excess that makes a shape
FEW = 0.2  # share of the windows that may hold it, if it is a matter of some of them
SHORT = 3  # windows in a row that a push may last
APART = 2.0  # a place: windows that differ lie closer to each other than to the rest, by this factor
MOST_SPANS, MOST_REGIMES = 20, 5
EXPLAINED = 0.3  # share of a channel's residual that a condition must explain to be told


def locate(difference: Difference, comparisons: Sequence[Comparison]) -> Location:
    """Targets, spans, regimes and the shape of what ``find_difference`` found.

    Windows that differ (5 % false discovery rate) and lie side by side are one span. The shape is ``transient`` if short spans hold most
    of the excess, ``place`` if it is held by windows that lie together on the map, apart from the others, ``regime`` if a condition
    explains a good part of a channel's residual, else ``everywhere``.
    """
    if not difference.differs:
        return Location(shape="nowhere", sentence="")
    targets = tuple(
        TargetScore(kind=target.kind, name=target.name, share=target.share, size=target.excess, differs=target.differs)
        for target in difference.targets
    )
    runs = _runs(difference.windows)
    spans = tuple(sorted((_span(run) for run in runs), key=lambda span: -span.size))[:MOST_SPANS]
    regimes = [row for row in difference.regimes if row.differs and row.explained > EXPLAINED]
    shape = _shape(difference.windows, runs, comparisons, regimes)
    return Location(
        shape=shape,
        targets=targets,
        spans=spans,
        regimes=tuple(_regime_sentence(row) for row in regimes[:MOST_REGIMES]),
        sentence=_sentence(shape, targets, spans, regimes, len(difference.windows)),
    )


def _excess(window: WindowDifference) -> float:
    return max(0.0, window.chi2 - window.degrees) if np.isfinite(window.chi2) else 0.0


def _runs(windows: Sequence[WindowDifference]) -> list[list[WindowDifference]]:
    """Windows that differ, those side by side together."""
    runs: list[list[WindowDifference]] = []
    for window in sorted((w for w in windows if w.differs), key=lambda w: (w.recording, w.number)):
        last = runs[-1][-1] if runs else None
        if last is not None and last.recording == window.recording and last.number + 1 == window.number:
            runs[-1].append(window)
        else:
            runs.append([window])
    return runs


def _span(run: Sequence[WindowDifference]) -> Span:
    worst = max(run, key=_excess)
    degrees = sum(w.degrees for w in run)
    return Span(
        recording=run[0].recording,
        start=run[0].start,
        stop=run[-1].stop,
        size=float(np.sqrt(sum(_excess(w) for w in run) / max(degrees, 1e-9))),
        target=worst.target,
        channel=worst.channel,
    )


def _shape(
    windows: Sequence[WindowDifference],
    runs: Sequence[Sequence[WindowDifference]],
    comparisons: Sequence[Comparison],
    regimes: Sequence[RegimeDifference],
) -> Shape:
    whole = sum(_excess(w) for w in windows)
    held = sorted((_excess(w) for w in windows), reverse=True)
    concentrated = sum(held[: max(1, int(FEW * len(held)))]) > MOST * whole
    short = sum(_excess(w) for run in runs if len(run) <= SHORT for w in run)
    if concentrated and short > MOST * whole:
        return "transient"
    if _lie_together(windows, comparisons, whole):
        return "place"
    return "regime" if regimes else "everywhere"


def _lie_together(windows: Sequence[WindowDifference], comparisons: Sequence[Comparison], whole: float) -> bool:
    """Whether some windows hold most of the excess and lie on the map apart from the others."""
    places = _places(comparisons)
    known = [(w, places[w.recording, w.number]) for w in windows if (w.recording, w.number) in places]
    if len(known) < 8 or whole <= 0:
        return False
    order = sorted(known, key=lambda pair: -_excess(pair[0]))
    count = int(np.searchsorted(np.cumsum([_excess(w) for w, _ in order]), MOST * whole)) + 1
    if count < 2 or count > len(order) // 2:
        return False
    inside = np.array([place for _, place in order[:count]])
    outside = np.array([place for _, place in order[count:]])
    centre = np.median(inside, axis=0)
    radius = float(np.quantile(np.linalg.norm(inside - centre, axis=1), MOST))
    travelled = float(np.linalg.norm(np.ptp(np.concatenate([inside, outside]), axis=0)))
    strangers = float(np.mean(np.linalg.norm(outside - centre, axis=1) < radius))
    return radius > 0 and travelled > APART * 2 * radius and strangers < 1 - MOST


def _places(comparisons: Sequence[Comparison]) -> Mapping[tuple[str, int], Array]:
    """Where the root was in each window (2,) [m], of machines that move about."""
    found = {}
    for comparison in comparisons:
        values = comparison.regimes.values
        if "x" not in values or "y" not in values:
            continue
        for window in np.unique(comparison.regimes.window).tolist():
            here = comparison.regimes.window == window
            found[comparison.recording, window] = np.array([np.mean(values["x"][here]), np.mean(values["y"][here])])
    return found


def _regime_sentence(row: RegimeDifference) -> str:
    """``the residual of 'effort' follows slip_ratio/wheel: ...``."""
    word = row.regime.replace("_", " ").replace("/", " of ")
    way = "grows" if max(abs(row.growth), abs(row.trend)) == abs(row.growth) and row.growth > 0 else "changes"
    return f"the residual of '{row.channel}' {way} with {word}, which explains {100 * row.explained:.0f} % of it"


def _sentence(
    shape: Shape, targets: Sequence[TargetScore], spans: Sequence[Span], regimes: Sequence[RegimeDifference], n_windows: int
) -> str:
    first = next((t for t in targets if t.differs), None)
    where = f"{100 * first.share:.0f} % of what is beyond the noise is seen at {first.kind} '{first.name}'" if first is not None else ""
    if shape == "transient":
        when = ", ".join(f"{s.start:.2f} to {s.stop:.2f} s of '{s.recording}'" for s in spans[:3])
        more = f" and {len(spans) - 3} more spans" if len(spans) > 3 else ""
        return f"{where}; it is short: {when}{more}"
    if shape == "place" and spans:
        first_pass = f"from {spans[0].start:.1f} to {spans[0].stop:.1f} s of '{spans[0].recording}'"
        return f"{where}; it belongs to one stretch of the ground, passed {first_pass}"
    if shape == "regime":
        return f"{where}; {_regime_sentence(regimes[0])}"
    return f"{where}, in most of the {n_windows} windows"
