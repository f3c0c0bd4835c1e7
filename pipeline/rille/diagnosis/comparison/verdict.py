"""Does a channel differ, and in which word: the one cause that explains most of what is beyond the noise."""

from dataclasses import replace

import numpy as np
from scipy.stats import norm

from rille.diagnosis.comparison.pooled import Pooled
from rille.model.difference import ChannelDifference, Verdict

RATE = 0.05  # false discovery rate
LEAST_SIZE = 0.1  # [noise] a bias or structure below it is called no difference, however sure: interpolation leaves as much
INSTANTS = 2.0  # times what instants leave open, as a standard deviation
SLOW = 1.5  # times the stated slow noise: a short recording holds few of its swings
MAJORITY = 0.7  # of what is beyond the noise: a single cause that explains more gives the verdict its name
STRONG = 0.3  # lag-1 correlation that is called coloured even where one window holds it all, so that no test is sure
FAR = 5.0  # [noise] samples beyond it are spikes, if they are few and alone
FEW = 0.01  # of the samples


def judged(row: ChannelDifference, pooled: Pooled, q: float, rate: float) -> ChannelDifference:
    """The row with its verdict. q : of its p among all channels. rate : p below which its size alone is called a difference."""
    if row.left_out:
        return replace(row, verdict="left out")
    if np.isnan(row.p):
        return replace(row, verdict="no data")
    square = row.normalised**2
    sizes = {
        "bias": abs(row.bias) / row.noise if row.p_bias < RATE else 0.0,
        "structure": 0.0 if _of_unknown_noise(row, pooled) else np.nan_to_num(row.structure),
        "delay": float(np.sqrt(np.nan_to_num(row.lag_fit.explained_by_delay) * square)) if row.p_delay < RATE else 0.0,
    }
    differs = bool(q < RATE and (max(sizes.values()) > _least(row, pooled) or min(row.p_size, np.nan_to_num(row.p_window, nan=1.0)) < rate))
    return replace(row, q=q, differs=differs, verdict=_verdict(row, pooled) if differs else "white")


def _of_unknown_noise(row: ChannelDifference, pooled: Pooled) -> bool:
    """Whether the residual is no larger than a noise that nobody stated: that it is not white is then the noise's own business."""
    return pooled.noise_from != ("stated",) and row.normalised <= pooled.allowance


def _least(row: ChannelDifference, pooled: Pooled) -> float:
    """Size [noise] below which nothing is called: ``LEAST_SIZE``, what rounding to the resolution leaves, white only by chance, what is
    stated of the sensor's own slow noise, or what instants leave open.
    """
    return max(LEAST_SIZE, pooled.rounding, SLOW * (pooled.channel.slow_noise or 0.0) / row.noise, INSTANTS * pooled.instants)


def _verdict(row: ChannelDifference, pooled: Pooled) -> Verdict:
    """The word for a channel that differs: the one cause that explains most of what is beyond the noise, else how the rest looks."""
    z = pooled.z[np.isfinite(pooled.z)]
    square = float(np.mean(z**2))
    excess = max(square - float(np.mean(pooled.degrees[np.isfinite(pooled.z)])), row.structure**2 if row.structure > 0 else 0.0, 1e-12)
    white = row.whiteness
    coloured = white is not None and (white.lag1 > STRONG or (white.p < RATE and row.structure > _least(row, pooled)))
    if square > pooled.allowance**2 and not coloured and _spiky(pooled):
        return "spiky"
    causes: dict[Verdict, float] = {
        "biased": float(np.mean(z) ** 2) if row.p_bias < RATE else 0.0,
        "delayed": np.nan_to_num(row.lag_fit.explained_by_delay) * square if row.p_delay < RATE else 0.0,
    }
    if abs(row.lag_fit.gain - 1) > 3 * row.lag_fit.gain_error and row.quantity != "part.orientation":
        causes["scaled"] = row.lag_fit.explained_by_gain * square * 0.98  # a bias far from zero looks like a gain: bias has precedence
    name = max(causes, key=lambda word: causes[word])
    if causes[name] > MAJORITY * excess:
        return name
    return "coloured" if coloured else "noisy"


def _spiky(pooled: Pooled) -> bool:
    """Whether few far samples, each alone, make up the excess: the rest, cut at 1 %, has the mean square of a cut normal distribution."""
    z = np.abs(pooled.z[np.isfinite(pooled.z)])
    far = z > FAR
    if not 0 < np.count_nonzero(far) <= FEW * len(z) or np.count_nonzero(far[1:] & far[:-1]) > 0.5 * np.count_nonzero(far):
        return False
    cut = float(norm.isf(FEW / 2))
    expected = 1 - 2 * cut * float(norm.pdf(cut)) / (1 - FEW)
    return float(np.mean(z[z <= np.quantile(z, 1 - FEW)] ** 2)) < pooled.allowance**2 * expected
