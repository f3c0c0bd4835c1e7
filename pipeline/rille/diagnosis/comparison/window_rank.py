"""Which windows differ most, and which channel is to blame in each."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2 as chi2_distribution

from rille.diagnosis.comparison.block_errors import adjusted
from rille.diagnosis.comparison.pooled import Pooled, first_windows
from rille.model.comparison import Comparison
from rille.model.difference import WindowDifference

LEAST_SHARE = 0.2  # of the usual number of samples: windows with fewer are ranked last


def rank_windows(comparisons: Sequence[Comparison], pooled: Sequence[Pooled], rate: float) -> tuple[WindowDifference, ...]:
    """Windows of all comparisons, the worst first.

    chi2 of a window is the sum of z^2 over the channels that take part; for p only, z is divided by the factor by which the noise may be
    understated. ``rate`` : false discovery rate over windows.
    """
    heads = [(run, window) for run, comparison in enumerate(comparisons) for window in comparison.windows]
    offsets = first_windows(comparisons)
    places = np.array([offsets[run] + window.number for run, window in heads], dtype=np.int64)
    size = int(offsets[-1]) + 1
    used = [channel for channel in pooled if not channel.left_out and np.isfinite(channel.z).any()]
    squares, degrees, counts, cautious = (np.zeros((len(used), size)) for _ in range(4))
    for k, channel in enumerate(used):
        known = np.isfinite(channel.z)
        window = channel.window[known]
        squares[k] = np.bincount(window, channel.z[known] ** 2, size)[:size]
        degrees[k] = np.bincount(window, channel.degrees[known], size)[:size]
        counts[k] = np.bincount(window, minlength=size)[:size]
        cautious[k] = squares[k] / channel.allowance**2
    total, freedom, n = squares.sum(axis=0), degrees.sum(axis=0), counts.sum(axis=0)
    normalised = np.sqrt(np.divide(total, freedom, out=np.full(size, np.nan), where=freedom > 0))
    p = np.where(freedom > 0, chi2_distribution.sf(cautious.sum(axis=0), np.maximum(freedom, 1e-9)), np.nan)
    q = np.full(size, np.nan)
    q[places] = adjusted(p[places])
    usual = float(np.median(n[places][n[places] > 0])) if np.any(n[places] > 0) else 0.0
    short = n < LEAST_SHARE * usual
    order = sorted(
        range(len(heads)), key=lambda i: (np.isnan(normalised[places[i]]), short[places[i]], -np.nan_to_num(normalised[places[i]]))
    )
    excess = np.maximum(squares - degrees, 0.0)
    found = []
    for rank, i in enumerate(order, start=1):
        (run, window), at = heads[i], places[i]
        worst = int(np.argmax(excess[:, at])) if len(used) and excess[:, at].any() else -1
        found.append(
            WindowDifference(
                recording=comparisons[run].recording,
                number=window.number,
                rank=rank,
                start=window.start,
                stop=window.stop,
                n=int(n[at]),
                normalised=float(normalised[at]),
                chi2=float(total[at]),
                degrees=float(freedom[at]),
                p=float(p[at]),
                q=float(q[at]),
                differs=bool(q[at] < rate),
                channel=used[worst].channel.name if worst >= 0 else "",
                target=used[worst].channel.target if worst >= 0 else "",
                share=float(excess[worst, at] / excess[:, at].sum()) if worst >= 0 else float("nan"),
                channels={
                    channel.channel.name: float(np.sqrt(squares[k, at] / degrees[k, at]))
                    for k, channel in enumerate(used)
                    if degrees[k, at] > 0
                },
                shift=window.shift,
                ended=window.ended,
            )
        )
    return tuple(found)
