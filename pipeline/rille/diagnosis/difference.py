"""Does a model differ from recordings beyond their noise, where, and when? Statistics of the residuals of comparisons."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from rille.diagnosis.block_errors import LEAST, adjusted, block_sums, mean_and_error, ratio_interval
from rille.diagnosis.delay_to_model import lag_fit
from rille.diagnosis.pooled import Pooled, pool
from rille.diagnosis.regime_table import regime_table
from rille.diagnosis.whiteness import whiteness
from rille.diagnosis.window_rank import rank_windows
from rille.model import InputRefused
from rille.model.comparison import Comparison
from rille.model.difference import (
    ChannelDifference,
    Difference,
    LagFit,
    RunDifference,
    TargetDifference,
    Verdict,
    Whiteness,
    WindowDifference,
)
from rille.model.recording import QUANTITIES

Array = NDArray[np.float64]
Kind = Literal["joint", "part", "wheel", "drive"]
RATE = 0.05  # false discovery rate
LEAST_SAMPLES = 20
LEAST_SIZE = 0.1  # [noise] a bias or structure below it is called no difference, however sure: interpolation leaves as much
MAJORITY = 0.7  # of what is beyond the noise: a single cause that explains more gives the verdict its name
STRONG = 0.3  # lag-1 correlation that is called coloured even where one window holds it all, so that no test is sure
CUT, UNEVEN = 4.0, 1.25  # [noise]; factor by which the noise of single windows may exceed the usual one
FAR = 5.0  # [noise] samples beyond it are spikes, if they are few and alone
FEW = 0.01  # of the samples


def find_difference(comparisons: Sequence[Comparison]) -> Difference:
    """Statistics over all channels, windows, targets and regimes of comparisons of one model; recordings are pooled.

    A channel differs when q < 5 % (Benjamini-Hochberg over channels) of the smallest of five p values times five (size against the noise,
    in all and in the worst window, whiteness, bias, delay against the simulation), and what it shows is more than ``LEAST_SIZE`` of its
    noise.

    Raises
    ------
    InputRefused : if there are none, or they are of several models or modes.
    """
    if not comparisons:
        raise InputRefused("there is no comparison to make statistics of; name a recording")
    for what, values in (("models", {c.model for c in comparisons}), ("modes", {c.mode for c in comparisons})):
        if len(values) > 1:
            raise InputRefused(f"comparisons of several {what} ({', '.join(sorted(values))}) cannot be pooled; compare them one by one")
    pooled = pool(comparisons)
    rows = [_channel(channel, comparisons) for channel in pooled]
    q = adjusted(np.array([row.p for row in rows]))
    rows = [_judged(row, channel, float(q[k])) for k, (row, channel) in enumerate(zip(rows, pooled, strict=True))]
    used = [channel for channel in pooled if not channel.left_out]
    squares = sum(float(np.nansum(channel.z**2)) for channel in used)
    degrees = sum(float(np.sum(channel.degrees[np.isfinite(channel.z)])) for channel in used)
    windows = rank_windows(comparisons, pooled, RATE)
    targets = _targets(rows, pooled)
    return Difference(
        model=comparisons[0].model,
        recordings=tuple(comparison.recording for comparison in comparisons),
        mode=comparisons[0].mode,
        differs=any(row.differs for row in rows),
        sentence=_sentence(rows, targets, windows),
        chi2_per_degree=squares / degrees if degrees > 0 else float("nan"),
        channels=tuple(rows),
        windows=windows,
        targets=targets,
        regimes=regime_table(comparisons, pooled, RATE),
        runs=_runs(comparisons, pooled),
        notes=_notes(comparisons),
        false_discovery_rate=RATE,
    )


def _notes(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Every note once, with the first recording that has it and the number of the others."""
    where: dict[str, list[str]] = {}
    for comparison in comparisons:
        for note in dict.fromkeys(comparison.notes):
            where.setdefault(note, []).append(comparison.recording)
    if len(comparisons) == 1:
        return tuple(where)
    return tuple(
        f"{names[0]}: {note}{f' (and in {len(names) - 1} more recordings)' if len(names) > 1 else ''}" for note, names in where.items()
    )


def _channel(pooled: Pooled, comparisons: Sequence[Comparison]) -> ChannelDifference:
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
    if n < LEAST_SAMPLES or np.count_nonzero(known) < LEAST_SAMPLES:
        return row
    z, degrees, block = pooled.z[known], pooled.degrees[known], pooled.block[known]
    low, high = np.sqrt(ratio_interval(z**2, degrees, block))
    white = whiteness(pooled)
    timed = comparisons[0].mode != "points"
    lag, p_delay = lag_fit(pooled) if timed else (LagFit(), np.nan)
    p_size = _p_size(z, degrees, block, pooled.allowance)
    p_window = _p_window(z, degrees, pooled.window[known], pooled.allowance)
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
        peak_window=int(pooled.window[peak] - _first_windows(comparisons)[int(pooled.run[peak])]),
    )


def _first_windows(comparisons: Sequence[Comparison]) -> NDArray[np.int64]:
    return np.cumsum([0] + [1 + max((w.number for w in c.windows), default=0) for c in comparisons])


def _p_size(z: Array, degrees: Array, block: NDArray[np.int64], allowance: float) -> float:
    """p of as large a sum of z^2, of any distribution: chi-squared with as many degrees of freedom as samples are worth.

    sum z^2 / sum degrees has the variance (kurtosis - 1) / n of independent samples, 2 / n if they are normal, and more if sizes come in
    stretches of time: what blocks scatter more than samples would. Degrees of freedom are cut by both ratios.
    """
    n, square = len(z), z**2
    freedom, ratio = float(np.sum(degrees)), float(np.sum(square) / np.sum(degrees))
    variance = float(np.var(square))
    worth = freedom * min(1.0, 2 * float(np.mean(square)) ** 2 / max(variance, 1e-300))
    sums = block_sums(square - ratio * degrees, block)
    if len(sums) >= LEAST and variance > 0:
        worth /= max(1.0, float(np.sum(sums**2)) / (n * variance))
    return float(chi2.sf(ratio * worth / allowance**2, worth))


def _p_window(z: Array, degrees: Array, window: NDArray[np.int64], allowance: float) -> float:
    """p of the largest sum of z^2 of one window among all (Bonferroni): what happens once drowns in tests of the whole.

    Samples count as at most ``CUT``, degrees of freedom are cut by the usual kurtosis of the windows as in ``_p_size``, and the noise may
    be larger by ``UNEVEN`` in some: tails and uneven noise are no event.
    """
    z = np.clip(z, -CUT, CUT)
    allowance *= UNEVEN
    count = np.bincount(window)
    some = count >= LEAST_SAMPLES // 2
    if np.count_nonzero(some) < 2:
        return float("nan")
    second, fourth = np.bincount(window, z**2)[some], np.bincount(window, z**4)[some]
    freedom = np.bincount(window, degrees)[some]
    kurtosis = float(np.median(count[some] * fourth / np.maximum(second**2, 1e-300)))
    worth = freedom * min(1.0, 2 / max(kurtosis - 1, 1e-3))
    return float(min(1.0, np.min(chi2.sf(second / freedom * worth / allowance**2, worth)) * len(worth)))


def _structure(white: Whiteness | None, square: float) -> float:
    """Root of the largest autocovariance of z that exceeds 3 standard errors: what varies slowly, in units of the noise."""
    if white is None:
        return float("nan")
    return float(np.sqrt(max(0.0, np.max(np.abs(white.autocorrelation) - 1.5 * white.band)) * square))


def _judged(row: ChannelDifference, pooled: Pooled, q: float) -> ChannelDifference:
    if row.left_out:
        return replace(row, verdict="left out")
    if np.isnan(row.p):
        return replace(row, verdict="no data")
    square = row.normalised**2
    sizes = {
        "bias": abs(row.bias) / row.noise if row.p_bias < RATE else 0.0,
        "structure": np.nan_to_num(row.structure),
        "delay": float(np.sqrt(np.nan_to_num(row.lag_fit.explained_by_delay) * square)) if row.p_delay < RATE else 0.0,
    }
    differs = bool(q < RATE and (max(sizes.values()) > _least(row, pooled) or min(row.p_size, np.nan_to_num(row.p_window, nan=1.0)) < RATE))
    return replace(row, q=q, differs=differs, verdict=_verdict(row, pooled) if differs else "white")


def _least(row: ChannelDifference, pooled: Pooled) -> float:
    """Size [noise] below which nothing is called: ``LEAST_SIZE``, or what rounding to the resolution leaves, white only by chance."""
    return max(LEAST_SIZE, (pooled.channel.resolution or 0.0) / np.sqrt(12) / row.noise)


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


def _targets(rows: Sequence[ChannelDifference], pooled: Sequence[Pooled]) -> tuple[TargetDifference, ...]:
    """Joints, parts, wheels and drives by what of them is beyond the noise."""
    groups: dict[tuple[Kind, str], list[tuple[ChannelDifference, float, float]]] = {}
    for row, channel in zip(rows, pooled, strict=True):
        known = np.isfinite(channel.z)
        if row.left_out or not known.any():
            continue
        key = QUANTITIES[row.quantity].target, row.target
        groups.setdefault(key, []).append((row, float(np.sum(channel.z[known] ** 2)), float(np.sum(channel.degrees[known]))))
    beyond = {key: sum(max(0.0, square - freedom) for _, square, freedom in parts) for key, parts in groups.items()}
    whole = sum(beyond.values())
    found = []
    for (kind, name), parts in groups.items():
        square, freedom = sum(part[1] for part in parts), sum(part[2] for part in parts)
        parts.sort(key=lambda part: part[2] / max(part[1], 1e-300))
        found.append(
            TargetDifference(
                kind=kind,
                name=name,
                channels=tuple(part[0].name for part in parts),
                n=sum(part[0].n for part in parts),
                normalised=float(np.sqrt(square / freedom)),
                excess=float(np.sqrt(max(0.0, square / freedom - 1))),
                share=beyond[kind, name] / whole if whole > 0 else 0.0,
                differs=any(part[0].differs for part in parts),
            )
        )
    return tuple(sorted(found, key=lambda target: (not target.differs, -target.normalised)))


def _runs(comparisons: Sequence[Comparison], pooled: Sequence[Pooled]) -> tuple[RunDifference, ...]:
    found = []
    for channel in pooled:
        edges = np.searchsorted(channel.run, np.arange(len(comparisons) + 1))
        for run, comparison in enumerate(comparisons):
            part = slice(edges[run], edges[run + 1])
            known = np.isfinite(channel.residual[part])
            if not known.any():
                continue
            residual, z, degrees = channel.residual[part][known], channel.z[part][known], channel.degrees[part][known]
            found.append(
                RunDifference(
                    recording=comparison.recording,
                    channel=channel.channel.name,
                    n=len(residual),
                    rms=float(np.sqrt(np.mean(residual**2))),
                    bias=float(np.mean(residual)),
                    normalised=float(np.sqrt(np.sum(z**2) / np.sum(degrees))),
                )
            )
    order = {comparison.recording: k for k, comparison in enumerate(comparisons)}
    return tuple(sorted(found, key=lambda run: order[run.recording]))


def _sentence(rows: Sequence[ChannelDifference], targets: Sequence[TargetDifference], windows: Sequence[WindowDifference]) -> str:
    """The verdict in words."""
    judged = [row for row in rows if row.verdict not in ("left out", "no data")]
    if not judged:
        return "nothing could be judged: no channel has a known noise and enough samples"
    differing = sorted((row for row in judged if row.differs), key=lambda row: -row.normalised)
    if not differing:
        size = np.sqrt(np.mean([row.normalised**2 for row in judged]))
        some = sum(window.differs for window in windows)
        beyond = f"; {some} of {len(windows)} windows exceed it all the same, the worst is number {windows[0].number}" if some else ""
        return f"nothing is missing: the residuals of all {len(judged)} channels are white at the noise (RMS / noise {size:.2f}){beyond}"
    worst = differing[0]
    target = next(target for target in targets if target.differs)
    return (
        f"{len(differing)} of {len(judged)} channels differ beyond the noise; most: {worst.of} ('{worst.name}'), {worst.normalised:.3g} "
        f"times its noise, {worst.verdict}; {target.kind} '{target.name}' differs most and holds {100 * target.share:.0f} % of what is "
        "beyond the noise"
    )
