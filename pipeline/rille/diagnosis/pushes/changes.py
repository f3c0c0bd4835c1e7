"""When did the ground change? Instants at which the relation between what a machine does and what it costs becomes another one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
PRIOR_SAMPLES = 60.0  # that what is known of a segment before it is seen is worth
LITTLE = 0.02  # of that prior, for the level that is told: only what was not excited is as usual
FEW_DEGREES = 3.0  # of the prior of the variance
PRICE = 15.0  # [nats] of a change, beside the logarithm of the number of instants where it could have been
WITHIN = 2.0  # [nats] that an instant may be less likely and still be in the interval
FAR = 4.0  # standard deviations beyond which a response is cut
MOST_BLOCKS = 1500


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """An instant between two stretches.

    time, low, high [s] : most likely one and 95 % interval. gain [nats] : log-evidence of two relations over one, less its price.
    before, after : mean of each response on either side, where the conditions are the usual ones [its unit].
    """

    time: float
    low: float
    high: float
    gain: float
    before: tuple[float, ...]
    after: tuple[float, ...]


def find_changes(
    time: Array, responses: Array, conditions: Array, *, block: float = 4.0, shortest: float = 40.0, price: float = PRICE
) -> tuple[Change, ...]:  # fmt: skip
    """Change points of regressions of several responses on common conditions.

    In a stretch between changes each response is linear in the conditions, with coefficients and a variance of its own. Their prior is the
    relation over the whole record, worth ``PRIOR_SAMPLES`` samples, so that what a stretch does not excite tells nothing, and a machine
    that does something else is no other ground as long as one relation covers both. The evidence of a stretch is closed
    (normal-inverse-gamma regression), that of correlated samples is divided by their correlation time; the best division is found exactly
    (optimal partitioning, Jackson et al. 2005, IEEE Signal Process. Lett. 12).

    Parameters
    ----------
    time : (n,) [s], ascending. responses : (n, q), what the ground may change: currents, vibration. conditions : (n, p), what the machine
        does; a constant is added. NaN: the sample is left out. block [s] : changes lie between blocks; shortest [s] : that a stretch may
        be. price [nats] : of a change.

    Returns
    -------
    In the order of time; empty where nothing changes, or too little was recorded.
    """
    known = np.isfinite(responses).all(axis=1) & np.isfinite(conditions).all(axis=1)
    time, y, x = time[known], responses[known], conditions[known]
    if len(time) < 20 or time[-1] - time[0] < 4 * block:
        return ()
    edges = _edges(time, max(block, (time[-1] - time[0]) / MOST_BLOCKS))
    varies = x.std(axis=0) > 1e-9 * (1e-12 + np.abs(x).max(axis=0))
    x = np.column_stack([np.ones(len(x)), (x[:, varies] - x[:, varies].mean(axis=0)) / x[:, varies].std(axis=0)])
    segments = [_Segments(column, x, edges) for column in y.T]
    n_blocks = len(edges) - 1
    cost = price + np.log(n_blocks)
    last = _partition([_all_from(segments, j) for j in range(1, n_blocks + 1)], cost, max(1, round(shortest / block)))
    bounds = [n_blocks]
    while bounds[-1] > 0:
        bounds.append(int(last[bounds[-1]]))
    bounds = bounds[::-1]
    found = []
    for a, b, c in zip(bounds[:-2], bounds[1:-1], bounds[2:], strict=True):
        profile = np.array([sum(s.evidence(a, k) + s.evidence(k, c) for s in segments) for k in range(a + 1, c)])
        near = a + 1 + np.flatnonzero(profile > profile.max() - WITHIN)
        gain = profile[b - a - 1] - sum(s.evidence(a, c) for s in segments) - cost
        at = [float(time[min(edges[k], len(time) - 1)]) for k in (b, max(near[0] - 1, a), min(near[-1] + 1, c))]
        found.append(
            Change(
                time=at[0],
                low=at[1],
                high=at[2],
                gain=float(gain),
                before=tuple(s.level(a, b) for s in segments),
                after=tuple(s.level(b, c) for s in segments),
            )
        )
    return tuple(found)


def _edges(time: Array, block: float) -> Whole:
    """First sample of each block of ``block`` [s], and the number of samples; empty blocks are left out."""
    number = ((time - time[0]) / block).astype(np.int64)
    return np.append(np.flatnonzero(np.diff(number, prepend=-1) > 0), len(time))


def _partition(evidence: Sequence[Array], cost: float, shortest: int) -> Whole:
    """(B + 1,) beginning of the last stretch of the best division of the first j blocks. evidence : of j the (j,) from each i < j."""
    best, last = np.zeros(len(evidence) + 1), np.zeros(len(evidence) + 1, dtype=np.int64)
    for j, row in enumerate(evidence, start=1):
        value = best[:j] + row - cost * (np.arange(j) > 0)
        value[max(1, j - shortest + 1) :] = -np.inf
        value[1 : min(shortest, j)] = -np.inf
        last[j] = int(np.argmax(value))
        best[j] = value[last[j]]
    return last


def _all_from(segments: Sequence["_Segments"], stop: int) -> Array:
    """(stop,) log-evidence of the stretches from each earlier block to ``stop``."""
    return np.sum([s.evidences(np.arange(stop), np.full(stop, stop)) for s in segments], axis=0)


class _Segments:
    """Evidence of stretches of one response."""

    def __init__(self, y: Array, x: Array, edges: Whole) -> None:
        n, p = x.shape
        center, spread = float(np.median(y)), float(1.4826 * np.median(np.abs(y - np.median(y)))) or float(np.std(y)) or 1.0
        self.scale = spread
        y = np.clip((y - center) / spread, -FAR, FAR)
        self.center = center
        gram = x.T @ x / n
        self.usual = np.linalg.lstsq(x, y, rcond=None)[0]
        rest = y - x @ self.usual
        self.variance = float(max(np.mean(rest**2), 1e-6))
        self.share = 1.0 / _correlation_time(rest, edges)
        self.prior = PRIOR_SAMPLES * (gram + 1e-3 * np.eye(p))
        self.log_prior = np.linalg.slogdet(self.prior)[1]
        outer = np.einsum("ni,nj->nij", x, x)
        self.xx, self.xr, self.rr, self.n = (
            np.concatenate([np.zeros((1, *v.shape[1:])), np.cumsum(v, axis=0)])[edges] * self.share
            for v in (outer, x * rest[:, None], rest**2, np.ones(n))
        )  # fmt: skip

    def evidences(self, first: Whole, stop: Whole) -> Array:
        """Log-evidence of stretches of blocks, per effective sample; constant terms that a division does not change are left out."""
        xx, xr, rr, n = (v[stop] - v[first] for v in (self.xx, self.xr, self.rr, self.n))
        precision = self.prior + xx
        solved = np.linalg.solve(precision, xr[..., None])[..., 0]
        a = 0.5 * FEW_DEGREES
        b = a * self.variance
        scatter = b + 0.5 * np.maximum(rr - np.sum(xr * solved, axis=-1), 0.0)
        return (
            0.5 * (self.log_prior - np.linalg.slogdet(precision)[1])
            + a * np.log(b)
            - (a + 0.5 * n) * np.log(scatter)
            + gammaln(a + 0.5 * n)
            - gammaln(a)
        )

    def evidence(self, first: int, stop: int) -> float:
        """Of one stretch."""
        return float(self.evidences(np.array([first]), np.array([stop]))[0])

    def level(self, first: int, stop: int) -> float:
        """Response of a stretch at the mean conditions of the whole record [unit]."""
        xx, xr = self.xx[stop] - self.xx[first], self.xr[stop] - self.xr[first]
        coefficients = self.usual + np.linalg.solve(LITTLE * self.prior + xx, xr)
        return self.center + self.scale * float(coefficients[0])


def _correlation_time(rest: Array, edges: Whole) -> float:
    """[samples] integrated autocorrelation time of residuals about the means of stretches of four blocks, by Sokal's window."""
    rest = rest.copy()
    for first, stop in zip(edges[:-1:4], [*edges[4:-1:4], edges[-1]], strict=False):
        rest[first:stop] -= rest[first:stop].mean()
    n, size = len(rest), float(np.mean(rest**2))
    if size <= 0:
        return 1.0
    total = 1.0
    for lag in range(1, n // 10):
        total += 2 * float(np.mean(rest[lag:] * rest[:-lag])) / size
        if lag >= 5 * total:
            break
    return max(total, 1.0)
