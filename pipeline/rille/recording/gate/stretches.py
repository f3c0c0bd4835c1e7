"""Which stretches of time comparisons look at: all of it, or in long recordings those where most moves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST = 60_000  # samples of a channel, over all recordings
STRETCHES = 24
BINS = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Time from ``first`` to ``last`` [s] of recording ``recording`` (its number)."""

    recording: int
    first: float
    last: float


def activity(time: Array, value: Array, first: float, last: float) -> Array:
    """(BINS,) spread of a channel in equal parts of [first, last], in that of all of it."""
    edges = np.searchsorted(time, np.linspace(first, last, BINS + 1)[:-1])
    edges = np.minimum(edges, max(len(time) - 1, 0))
    good = np.where(np.isfinite(value), value, 0.0)
    spread = np.maximum.reduceat(good, edges) - np.minimum.reduceat(good, edges) if len(good) else np.zeros(BINS)
    largest = float(spread.max(initial=0.0))
    return spread / largest if largest > 0 else np.zeros(BINS)


def choose(recording: int, first: float, last: float, samples: int, share: int, active: Array | None) -> list[Stretch]:
    """Stretches of one recording of ``samples`` samples between two times [s], which together hold about ``share`` samples.

    Two thirds of them lie where most channels move (``active``, a sum over channels), one third evenly, so that drift is seen.
    """
    if samples <= share or last <= first:
        return [Stretch(recording=recording, first=first, last=last)]
    count = min(STRETCHES, max(share // 500, 1))
    length = (last - first) * share / samples / count
    evenly = np.linspace(first + length / 2, last - length / 2, max(count // 3, 1))
    centres = list(evenly)
    if active is not None:
        middles = first + (np.arange(BINS) + 0.5) * (last - first) / BINS
        for k in np.argsort(-active, kind="stable"):
            if len(centres) >= count:
                break
            middle = float(np.clip(middles[k], first + length / 2, last - length / 2))
            if all(abs(middle - centre) >= length for centre in centres):
                centres.append(middle)
    return [Stretch(recording=recording, first=c - length / 2, last=c + length / 2) for c in sorted(centres)]
