"""Statistics of the residuals of one channel over all windows of all recordings, and their p values."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from rille.diagnosis.comparison.block_errors import LEAST, block_sums, mean_and_error, ratio_interval
from rille.diagnosis.comparison.delay_to_model import lag_fit
from rille.diagnosis.comparison.pooled import Pooled, first_windows
from rille.diagnosis.comparison.whiteness import whiteness
from rille.model.comparison import Comparison
from rille.model.difference import ChannelDifference, LagFit, Whiteness

Array = NDArray[np.float64]
LEAST_SAMPLES, LEAST_POINTS = 20, 6  # in time, where neighbours are alike; and of a bench
CUT, UNEVEN = 4.0, 1.25  # [noise]; factor by which the noise of single windows may exceed the usual one


def channel_statistics(pooled: Pooled, comparisons: Sequence[Comparison]) -> ChannelDifference:
    """Statistics of one channel; verdict and q are still open."""
    channel = pooled.channel
    finite = pooled.finite
    n = int(np.count_nonzero(finite))
    row = ChannelDifference(
        name=channel.name,
        quantity=channel.quantity,
        component=channel.component,
        target=channel.target,
        unit=channel.unit,
        n=n,
        windows=len(np.unique(pooled.window[finite])),
        noise=pooled.noise,
        noise_from=", ".join(pooled.noise_from),
        left_out=pooled.left_out,
    )
    if n == 0:
        return row
    residual, block = pooled.residual[finite], pooled.block[finite]
    bias, bias_error, p_bias = mean_and_error(residual, block)
    low, high = np.sqrt(ratio_interval(residual**2, np.ones(n), block))
    row = replace(row, rms=float(np.sqrt(np.mean(residual**2))), rms_low=float(low), rms_high=float(high), bias=bias, bias_error=bias_error)
    known = np.isfinite(pooled.z)
    timed = comparisons[0].mode != "points"
    if np.count_nonzero(known) < (LEAST_SAMPLES if timed else LEAST_POINTS):
        return row
    z, degrees, block = pooled.z[known], pooled.degrees[known], pooled.block[known]
    low, high = np.sqrt(ratio_interval(z**2, degrees, block))
    white = whiteness(pooled)
    lag, p_delay = lag_fit(pooled) if timed else (LagFit(), np.nan)
    p_size = _p_size(z, degrees, block, pooled)
    p_window = _p_window(z, degrees, pooled.window[known], pooled)
    p = np.array([p_size, p_window, white.p if white is not None else np.nan, p_bias, p_delay])
    peak = int(np.argmax(np.abs(np.nan_to_num(pooled.z))))
    left = [] if row.left_out else p[np.isfinite(p)]
    return replace(
        row,
        normalised=float(np.sqrt(np.sum(z**2) / np.sum(degrees))),
        normalised_low=float(low),
        normalised_high=float(high),
        structure=_structure(white, float(np.mean(z**2))),
        whiteness=white,
        lag_fit=lag,
        p_size=p_size,
        p_bias=p_bias,
        p_delay=p_delay,
        p_window=p_window,
        p=float(min(1.0, np.min(left) * len(left))) if len(left) else float("nan"),
        peak=float(abs(pooled.z[peak])),
        peak_time=float(pooled.time[peak]),
        peak_recording=comparisons[int(pooled.run[peak])].recording,
        peak_window=int(pooled.window[peak] - first_windows(comparisons)[int(pooled.run[peak])]),
    )


def _p_size(z: Array, degrees: Array, block: NDArray[np.int64], pooled: Pooled) -> float:
    """p of as large a sum of z^2, of any distribution: chi-squared with as many degrees of freedom as samples are worth.

    sum z^2 / sum degrees has the variance (kurtosis - 1) / n of independent samples, 2 / n if they are normal, and more if sizes come in
    stretches of time: what blocks scatter more than samples would. Degrees of freedom are cut by both ratios. Where the noise is itself an
    estimate with few degrees of freedom, the ratio has an F distribution.
    """
    n, square = len(z), z**2
    freedom, ratio = float(np.sum(degrees)), float(np.sum(square) / np.sum(degrees))
    variance = float(np.var(square))
    worth = freedom * min(1.0, 2 * float(np.mean(square)) ** 2 / max(variance, 1e-300))
    sums = block_sums(square - ratio * degrees, block)
    if len(sums) >= LEAST and variance > 0:
        worth /= max(1.0, float(np.sum(sums**2)) / (n * variance))
    return float(_p_of_ratio(np.array(ratio / pooled.allowance**2), np.array(worth), pooled.noise_degrees))


def _p_of_ratio(ratio: Array, worth: Array, noise_degrees: float) -> Array:
    """p of as large ratios of variances, of ``worth`` degrees of freedom, to that of the noise."""
    return np.asarray(chi2.sf(ratio * worth, worth) if np.isinf(noise_degrees) else f.sf(ratio, worth, noise_degrees), dtype=float)


def _p_window(z: Array, degrees: Array, window: NDArray[np.int64], pooled: Pooled) -> float:
    """p of the largest sum of z^2 of one window among all (Bonferroni): what happens once drowns in tests of the whole.

    Samples count as at most ``CUT``, degrees of freedom are cut by the usual kurtosis of the windows as in ``_p_size``, and the noise may
    be larger by ``UNEVEN`` in some: tails and uneven noise are no event.
    """
    z = np.clip(z, -CUT, CUT)
    allowance = UNEVEN * pooled.allowance
    count = np.bincount(window)
    some = count >= LEAST_SAMPLES // 2
    if np.count_nonzero(some) < 2:
        return float("nan")
    second, fourth = np.bincount(window, z**2)[some], np.bincount(window, z**4)[some]
    freedom = np.bincount(window, degrees)[some]
    kurtosis = float(np.median(count[some] * fourth / np.maximum(second**2, 1e-300)))
    worth = np.asarray(freedom * min(1.0, 2 / max(kurtosis - 1, 1e-3)), dtype=float)
    return float(min(1.0, np.min(_p_of_ratio(second / freedom / allowance**2, worth, pooled.noise_degrees)) * len(worth)))


def _structure(white: Whiteness | None, square: float) -> float:
    """Root of the largest autocovariance of z that exceeds 3 standard errors: what varies slowly, in units of the noise."""
    if white is None:
        return float("nan")
    return float(np.sqrt(max(0.0, np.max(np.abs(white.autocorrelation) - 1.5 * white.band)) * square))
