"""Where on the map something is that acts in a circle: from what each window alone would ask for.

A law with a place and a size (other soil inside a circle) is tried as if it were everywhere: its signature tells how much of it each window
asks for. Circles along the track are then compared by linear algebra alone, and the best are where the fit begins.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.inference.judge import Judge
from rille.model.comparison import Comparison
from rille.model.hypothesis import FreeNumber, Hypothesis

Array = NDArray[np.float64]
Values = Mapping[str, float]
TRIAL = 0.3  # [spreads] of an amplitude, to see what it does
N_SIZES = 10
LEAST_GAIN = 8.0  # [nats] of a circle
APART = 0.5  # of the larger radius: circles nearer than that, and less than twice as large, are one


def window_places(evidence: Evidence, comparisons: Sequence[Comparison]) -> Array:
    """(W, 2) [m] where the root was in the middle of each window; NaN where that is not known.

    comparisons : of the recordings that ``evidence.run`` counts.
    """
    found = np.full((len(evidence.run), 2), np.nan)
    for run, comparison in enumerate(comparisons):
        regimes = comparison.regimes
        if "x" not in regimes.values or not len(regimes.time):
            continue
        order = np.argsort(regimes.time, kind="stable")
        here = np.flatnonzero(evidence.run == run)
        middle = 0.5 * (evidence.starts[here] + evidence.stops[here])
        for k, name in enumerate("xy"):
            found[here, k] = np.interp(middle, regimes.time[order], regimes.values[name][order])
    return found


def patch_tries(
    evidence: Evidence, hypotheses: Sequence[Hypothesis], places: Array, *, most: int = 3, judge: Judge | None = None
) -> Mapping[str, tuple[Values, ...]]:
    """Where to begin to look for circles, best first, at most ``most`` for each hypothesis (by title) that has a place and a size.

    With the signatures s_i of the amplitudes in window w, G_w = <s_i, s_j> and b_w = <s_i, r>, what a circle C explains is
    1/2 b_C^T (G_C + prior)^-1 b_C with the sums over the windows inside; prior: one spread. Centres are tried at the windows' places
    and half-way between, sizes from their distance to the whole track. Hypotheses that no circle serves better than ``LEAST_GAIN`` are
    left out.

    Parameters
    ----------
    places : (W, 2) [m] of the windows, NaN where there is none. judge : of the evidence, with what is assumed already.
    """
    judge = judge or Judge(evidence)
    known = np.isfinite(places).all(axis=1)
    reach = float(np.max(np.linalg.norm(places[known] - places[known].mean(axis=0), axis=1))) if known.any() else 0.0
    found: dict[str, tuple[Values, ...]] = {}
    if reach <= 0 or known.sum() < 4:
        return found
    for hypothesis in hypotheses:
        center, size = _circle_of(hypothesis)
        amplitudes = [number for number in hypothesis.free if number.amplitude]
        if center is None or size is None or not amplitudes:
            continue
        everywhere = _values(hypothesis, center, size, places[known].mean(axis=0), 2 * reach)
        gram, pull = _asked(judge, hypothesis, amplitudes, everywhere)
        prior = np.diag([1.0 / number.spread**2 for number in amplitudes])
        circles = _circles(gram[known], pull[known], prior, places[known], reach, most)
        if circles:
            found[hypothesis.title] = tuple(_values(hypothesis, center, size, at, radius) for _, at, radius in circles)
    return found


def _circle_of(hypothesis: Hypothesis) -> tuple[tuple[FreeNumber, FreeNumber] | None, FreeNumber | None]:
    """Coordinates and size of a law that acts in a circle on the ground."""
    by_axis = {number.name[-1]: number for number in hypothesis.free if number.search == "place"}
    sizes = [n for n in hypothesis.free if n.search == "scale" and not n.amplitude and n.unit == "m"]
    if set(by_axis) != {"x", "y"} or len(sizes) != 1:
        return None, None
    return (by_axis["x"], by_axis["y"]), sizes[0]


def _values(hypothesis: Hypothesis, center: tuple[FreeNumber, FreeNumber], size: FreeNumber, at: Array, radius: float) -> dict[str, float]:
    usual = {number.name: number.start for number in hypothesis.free if not number.amplitude}
    inside = {number.name: float(min(max(value, number.lower), number.upper)) for number, value in zip(center, at, strict=True)}
    return usual | inside | {size.name: float(min(max(radius, size.lower), size.upper))}


def _asked(judge: Judge, hypothesis: Hypothesis, amplitudes: Sequence[FreeNumber], everywhere: Values) -> tuple[Array, Array]:
    """(W, k, k) products of the signatures and (W, k) products with the residual, from small trials to both sides where bounds allow."""
    settings, steps = [], []
    for number in amplitudes:
        sides = [s for s in (1.0, -1.0) if number.lower <= number.absent + s * TRIAL * number.spread <= number.upper]
        steps.append([s * TRIAL * number.spread for s in sides])
        settings += [(*judge.on_top, hypothesis.at({**everywhere, number.name: number.absent + step})) for step in steps[-1]]
    rows = iter(judge.whitened(settings))
    signatures = []
    for of_number in steps:
        changes = [(judge.base - next(rows)) / step for step in of_number]
        signatures.append(np.mean(changes, axis=0) if changes else np.zeros_like(judge.base))
    edges = judge.metric.edges
    blocks = np.stack([*signatures, judge.base])
    gram = np.stack([blocks[:, a:b] @ blocks[:, a:b].T for a, b in pairwise(edges)])
    return gram[:, :-1, :-1], gram[:, :-1, -1]


def _circles(gram: Array, pull: Array, prior: Array, places: Array, reach: float, most: int) -> list[tuple[float, Array, float]]:
    """Gain [nats], centre and radius [m] of the best circles, those that are nearly the same once."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    least = max(float(np.median(steps[steps > 0])) if (steps > 0).any() else reach / 10, reach / 100)
    centers = np.unique(np.round(np.concatenate([places, 0.5 * (places[1:] + places[:-1])]), 6), axis=0)
    away = np.linalg.norm(places[None] - centers[:, None], axis=2)
    candidates = []
    for radius in np.geomspace(0.6 * least, reach, N_SIZES):
        inside = (away <= radius).astype(float)
        matrix, vector = np.einsum("cw,wij->cij", inside, gram) + prior, inside @ pull
        gains = 0.5 * np.sum(vector * np.linalg.solve(matrix, vector[..., None])[..., 0], axis=1)
        candidates += [(float(gain), center, float(radius)) for gain, center in zip(gains, centers, strict=True) if gain > LEAST_GAIN]
    chosen: list[tuple[float, Array, float]] = []
    for gain, center, radius in sorted(candidates, key=lambda row: -row[0]):
        alike = any(np.linalg.norm(center - c) < APART * max(radius, r) and 0.5 < radius / r < 2.0 for _, c, r in chosen)
        if not alike:
            chosen.append((gain, center, radius))
        if len(chosen) == most:
            break
    return chosen
