"""Delay and gain of a measured channel against the simulated one."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as t_distribution

from rille.diagnosis.comparison.block_errors import LEAST, regression
from rille.diagnosis.comparison.pooled import Pooled
from rille.model.difference import LagFit

Array = NDArray[np.float64]
ITERATIONS = 20
LEAST_SAMPLES = 20
LARGEST_ERROR = 0.5  # of a gain: the noise alone must allow a smaller one
LONGEST, LONGEST_TIME = 0.25, 1.0  # of a window, and [s]: the largest delay that is tried
TELLABLE = 1e7  # condition of the columns of a fit, above which their coefficients are rounding


def lag_fit(pooled: Pooled) -> tuple[LagFit, float]:
    """Fit of measured(t) = g simulated(t - tau) + b over all windows, and the p of tau = 0.

    Gauss-Newton on the normalised residual r(t) = measured(t) - simulated(t - tau): columns 1, simulated and -simulated'(t - tau), the
    simulated channel interpolated linearly within its window; samples that a shift takes out of their window are left out. The errors are
    robust to correlation within blocks. NaN where the simulated channel moves too little to show a delay (or gain) above its noise, there
    are too few samples, or no delay within ``LONGEST`` fits.
    """
    chosen = pooled.finite & np.isfinite(pooled.z) & np.isfinite(pooled.simulated)
    if np.count_nonzero(chosen) < LEAST_SAMPLES:
        return LagFit(), np.nan
    signal = _Signal(pooled, chosen)
    if not signal.shows_delay:
        return LagFit(), np.nan
    power = float(np.mean(signal.residual(0.0)[1] ** 2))
    if power == 0:
        return LagFit(delay=0.0, gain=1.0, explained_by_delay=0.0, explained_by_gain=0.0), np.nan
    at_rest = signal.at(0.0)
    gain_alone = float(at_rest @ signal.residual(0.0)[1]) ** 2 / max(float(at_rest @ at_rest), 1e-300) / len(at_rest) / power
    alone, _, _ = signal.solve(gain=False)
    inside, rest = signal.residual(alone if np.isfinite(alone) else 0.0)
    before = float(np.mean(signal.residual(0.0)[1][inside] ** 2))
    delay, coefficients, covariance = signal.solve(gain=True)
    error, gain_error = (float(np.sqrt(max(covariance[k, k], 0.0))) for k in (2, 1))
    known = 0 < error < signal.longest  # a steady ramp does not tell delay and offset apart
    gain_known = signal.shows_gain and 0 < gain_error < LARGEST_ERROR
    return LagFit(
        delay=delay if known else np.nan,
        delay_error=error if known else np.nan,
        gain=float(coefficients[1]) if gain_known else np.nan,
        gain_error=gain_error if gain_known else np.nan,
        explained_by_delay=float(max(0.0, 1.0 - np.mean(rest[inside] ** 2) / before)) if before > 0 else 0.0,
        explained_by_gain=min(gain_alone, 1.0),
    ), float(2 * t_distribution.sf(abs(delay) / error, signal.n_blocks - 1)) if known and signal.n_blocks >= LEAST else np.nan


class _Signal:
    """Samples of one channel on a time line on which windows lie apart, so that one interpolation serves all."""

    def __init__(self, pooled: Pooled, chosen: NDArray[np.bool_]) -> None:
        time = pooled.time[chosen]
        window, index = np.unique(pooled.window[chosen], return_inverse=True)
        first = np.full(len(window), np.inf)
        last = np.full(len(window), -np.inf)
        np.minimum.at(first, index, time)
        np.maximum.at(last, index, time)
        length = last - first
        apart = float(np.max(length)) * 2 + 1.0
        self._low, self._high = (index * apart), (index * apart + length[index])
        self._time = time - first[index] + index * apart
        order = np.argsort(self._time, kind="stable")
        self._time, self._low, self._high = self._time[order], self._low[order], self._high[order]
        self._simulated, self._noise = pooled.simulated[chosen][order], pooled.sigma[chosen][order]
        self._wrapped = pooled.channel.component in ("roll", "pitch", "yaw")
        if self._wrapped:
            self._simulated = np.unwrap(self._simulated)
        self._measured = self._simulated + pooled.z[chosen][order] * self._noise
        self._block = pooled.block[chosen][order]
        self._rate = _slope(self._time, self._simulated, index[order])
        self.n_blocks = int(np.count_nonzero(np.bincount(self._block)))
        self.longest = min(LONGEST * float(np.median(length)), LONGEST_TIME)
        change = self._simulated - np.mean(self._simulated)
        self.shows_delay = float(np.sum((self._rate / self._noise) ** 2)) * self.longest**2 > 1
        self.shows_gain = float(np.sum((change / self._noise) ** 2)) > 1 / LARGEST_ERROR**2

    def at(self, delay: float) -> Array:
        """(n,) simulated(t - delay) over noise."""
        return np.interp(self._time - delay, self._time, self._simulated) / self._noise

    def residual(self, delay: float) -> tuple[NDArray[np.bool_], Array]:
        """Which samples keep within their window, and the normalised residual of all (n,)."""
        shifted = self._time - delay
        difference = self._measured - np.interp(shifted, self._time, self._simulated)
        if self._wrapped:
            difference = (difference + np.pi) % (2 * np.pi) - np.pi
        return (shifted >= self._low) & (shifted <= self._high), difference / self._noise

    def solve(self, *, gain: bool) -> tuple[float, Array, Array]:
        """Delay [s], coefficients (offset, gain, delay) and covariance; without gain and offset their columns are left out."""
        unknown = np.nan, np.full(3, np.nan), np.full((3, 3), np.nan)
        delay, (_, coefficients, covariance) = 0.0, unknown
        for _ in range(ITERATIONS):
            inside, difference = self.residual(delay)
            rate = np.interp(self._time - delay, self._time, self._rate)[inside] / self._noise[inside]
            columns = [1 / self._noise[inside], self.at(delay)[inside], -rate] if gain else [-rate]
            design = np.stack(columns, axis=1)
            if np.count_nonzero(inside) < LEAST_SAMPLES or not np.any(rate):
                return unknown
            length = np.linalg.norm(design, axis=0)
            if gain and (not length.all() or np.linalg.cond(design / length) > TELLABLE):  # a ramp: what follows would be rounding
                return unknown
            coefficients, covariance = regression(design, difference[inside], self._block[inside])
            scale = 1 + coefficients[1] if gain else 1.0
            step = float(coefficients[-1] / scale) if abs(scale) > 0.1 else 0.0
            if abs(step) < 1e-3 * max(float(np.sqrt(max(covariance[-1, -1], 0.0))), 1e-9) or not np.isfinite(step):
                break
            delay += step
            if abs(delay) > self.longest:
                return unknown
        if gain and abs(coefficients[1] + 1) > 0.1:  # the last column's coefficient is gain times change of the delay
            covariance[-1] /= coefficients[1] + 1
            covariance[:, -1] /= coefficients[1] + 1
        return delay, (coefficients + np.array([0.0, 1.0, 0.0]) if gain else coefficients), covariance


def _slope(time: Array, value: Array, window: NDArray[np.int64]) -> Array:
    """(n,) time derivative by differences to both neighbours within the window (one at its ends, 0 for a window of one sample)."""
    n = len(time)
    same = np.concatenate([[False], window[1:] == window[:-1], [False]])
    before = np.where(same[:-1], np.arange(n) - 1, np.arange(n))
    after = np.where(same[1:], np.arange(n) + 1, np.arange(n))
    span = time[after] - time[before]
    return np.divide(value[after] - value[before], span, out=np.zeros(n), where=span > 0)
