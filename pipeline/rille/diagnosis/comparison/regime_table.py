"""Under which conditions a channel differs: normalised residuals against slip, load, speed, slope, turning, place."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from rille.diagnosis.comparison.block_errors import adjusted, block_sums, regression, wald
from rille.diagnosis.comparison.pooled import Pooled, first_windows
from rille.model.comparison import Comparison
from rille.model.difference import RegimeDifference

Array = NDArray[np.float64]
BINS, LEAST_IN_BIN, MOST_SAMPLES = 8, 10, 30000
LEAST_TREND = 0.1  # [noise] from the lowest to the highest of a regime: below it nothing is called


def regime_table(comparisons: Sequence[Comparison], pooled: Sequence[Pooled], rate: float) -> tuple[RegimeDifference, ...]:
    """Every channel that takes part against every regime that varies, the strongest first.

    Regimes are interpolated to the channel's samples within each window. Beside means over quantile bins, the normalised residual z and its
    square are regressed on u and u^2 (u: rank of the regime, 0 to 1) with errors robust to correlation within blocks of time; p is the
    smaller of the two, doubled. ``rate`` : false discovery rate over all channels and regimes.
    """
    conditions = _Conditions(comparisons)
    found = []
    for channel in pooled:
        chosen = np.flatnonzero(np.isfinite(channel.z))
        if channel.left_out or len(chosen) < 2 * LEAST_IN_BIN:
            continue
        chosen = chosen[:: -(-len(chosen) // MOST_SAMPLES)]
        for name, value in conditions.at(channel.window[chosen], channel.time[chosen]):
            row = _against(channel, chosen, name, value)
            if row is not None:
                found.append(row)
    q = adjusted(np.array([row.p for row in found]))
    rows = [
        replace(row, q=float(q[k]), differs=bool(q[k] < rate and max(abs(row.trend), abs(row.growth), _swing(row)) > LEAST_TREND))
        for k, row in enumerate(found)
    ]
    return tuple(sorted(rows, key=lambda row: (not row.differs, -row.explained)))


def _swing(row: RegimeDifference) -> float:
    return float(np.ptp(row.bias)) / 2


class _Conditions:
    """Regimes of all comparisons on one time line on which windows lie apart, so that one search serves all of them."""

    def __init__(self, comparisons: Sequence[Comparison]) -> None:
        firsts = first_windows(comparisons)
        self._values = {
            name: np.concatenate([c.regimes.values.get(name, np.full(len(c.regimes.time), np.nan)) for c in comparisons])
            for name in dict.fromkeys(name for comparison in comparisons for name in comparison.regimes.values)
        }
        self._time = time = np.concatenate([comparison.regimes.time for comparison in comparisons])
        self._window = np.concatenate([c.regimes.window + first for c, first in zip(comparisons, firsts, strict=False)]).astype(np.int64)
        self._start = np.full(int(firsts[-1]) + 1, np.inf)
        np.minimum.at(self._start, self._window, time)
        self._apart = 4 * (float(np.max(time - self._start[self._window])) if len(time) else 0.0) + 1.0
        line = self._line(self._window, time)
        self._order = np.argsort(line, kind="stable")
        self._sorted = line[self._order]

    def _line(self, window: NDArray[np.int64], time: Array) -> Array:
        return window * self._apart + np.clip(time - self._start[window], -self._apart / 4, self._apart / 2)

    def at(self, window: NDArray[np.int64], time: Array) -> Iterator[tuple[str, Array]]:
        """Name and (n,) linearly interpolated values of each regime; held beyond a window's ends, NaN where the window has none."""
        known = np.isfinite(self._start[window])
        if not known.any():
            return
        line = np.where(known, self._line(window, np.where(known, time, 0.0)), 0.0)
        right = np.clip(np.searchsorted(self._sorted, line), 0, len(self._sorted) - 1)
        left = np.maximum(right - 1, 0)
        left, right = self._order[left], self._order[right]
        left = np.where(self._window[left] == window, left, right)
        right = np.where(self._window[right] == window, right, left)
        low, high = self._line(self._window[left], self._time[left]), self._line(self._window[right], self._time[right])
        weight = np.clip(np.divide(line - low, high - low, out=np.zeros(len(line)), where=high > low), 0.0, 1.0)
        for name, values in self._values.items():
            value = np.where(
                weight == 0, values[left], np.where(weight == 1, values[right], (1 - weight) * values[left] + weight * values[right])
            )
            yield name, np.where(known, value, np.nan)


def _against(channel: Pooled, chosen: NDArray[np.int64], name: str, value: Array) -> RegimeDifference | None:
    known = np.isfinite(value)
    value, chosen = value[known], chosen[known]
    n = len(value)
    if n < 2 * LEAST_IN_BIN or np.ptp(value) <= 1e-9 * (1e-9 + float(np.max(np.abs(value)))):
        return None
    z, block = channel.z[chosen], channel.block[chosen]
    edges = np.unique(np.quantile(value, np.linspace(0, 1, min(BINS, n // LEAST_IN_BIN) + 1)))
    if len(edges) < 3:
        edges = np.unique([edges[0], float(np.mean(value)), edges[-1]])
    bins = np.clip(np.searchsorted(edges, value, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(bins, minlength=len(edges) - 1)
    full = count > 0
    edges = np.concatenate([edges[:-1][full], edges[-1:]])
    bins = np.cumsum(full)[bins] - 1
    count = count[full]
    bias, square = np.bincount(bins, z) / count, np.bincount(bins, z**2) / count
    bias_error, square_error = (_bin_errors(y, mean, bins, count, block) for y, mean in ((z, bias), (z**2, square)))
    u = (rankdata(value) - 1) / (n - 1) - 0.5
    design = np.stack([np.ones(n), u, u**2 - np.mean(u**2)], axis=1)
    n_blocks = int(np.count_nonzero(np.bincount(block)))
    numbers, ps = [], []
    for y in (z, z**2):
        coefficients, covariance = regression(design, y, block)
        numbers += [float(coefficients[1]), float(np.sqrt(covariance[1, 1]))]
        ps.append(wald(coefficients[1:], covariance[1:, 1:], n_blocks))
    rms = np.sqrt(square)
    return RegimeDifference(
        channel=channel.channel.name,
        regime=name,
        edges=edges,
        centre=np.bincount(bins, value) / count,
        n=count.astype(np.int64),
        rms=rms,
        rms_error=np.divide(square_error, 2 * rms, out=np.zeros_like(rms), where=rms > 0),
        bias=bias,
        bias_error=bias_error,
        trend=numbers[0],
        trend_error=numbers[1],
        growth=numbers[2],
        growth_error=numbers[3],
        explained=float(np.sum(count * bias**2) / max(float(np.sum(z**2)), 1e-300)),
        p=min(1.0, 2 * min(ps)) if np.isfinite(ps).all() else float("nan"),
    )


def _bin_errors(y: Array, mean: Array, bins: NDArray[np.int64], count: NDArray[np.int64], block: NDArray[np.int64]) -> Array:
    """(B,) standard errors of the bins' means by blocks of time; NaN for bins that only one block visits."""
    errors = np.full(len(mean), np.nan)
    for k in range(len(mean)):
        inside = bins == k
        sums = block_sums(y[inside] - mean[k], block[inside])
        if len(sums) > 1:
            errors[k] = np.sqrt(len(sums) / (len(sums) - 1) * np.sum(sums**2)) / count[k]
    return errors
