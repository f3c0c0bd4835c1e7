"""What the difference report's figures are drawn from: series, windows, regimes, whiteness; thinned to what a page can hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.comparison import ComparedChannel, Comparison
from rille.model.difference import Difference, WindowDifference
from rille.view.page import packed
from rille.view.thinning import thinned

Array = NDArray[np.float64]

POINTS = 300_000  # of time series in one page
SERIES = (400, 6_000)  # points of one series, least and most
DETAIL = 500  # points that a series keeps in each of the worst windows
WORST = 24  # windows that are kept in detail and shaded
COLUMNS = 1_500  # of the picture of all windows of a recording
REGIME_VALUES = 1_200_000  # numbers of the regime scatters in one page
REGIME_POINTS = (150, 1_500)  # of one scatter
QUANTILES = 161  # of the quantile plot


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """Recordings whose series are in the page, by index into the comparisons, worst first; ``points`` of a series."""

    recordings: tuple[int, ...]
    points: int


def kept_recordings(difference: Difference, comparisons: Sequence[Comparison]) -> Kept:
    """Those with the worst windows first, as many as the page has room for."""
    rank = {comparison.recording: index for index, comparison in enumerate(comparisons)}
    order = dict.fromkeys(rank[window.recording] for window in difference.windows if window.recording in rank)
    order |= dict.fromkeys(range(len(comparisons)))
    kept: list[int] = []
    least = series = 0
    for index in order:
        lengths = [len(channel.time) for channel in comparisons[index].channels]
        least += sum(min(length, SERIES[0] + DETAIL) for length in lengths)
        if kept and least > POINTS:
            break
        kept.append(index)
        series += len(lengths)
    return Kept(recordings=tuple(kept), points=int(np.clip(POINTS // max(series, 1), *SERIES)))


def recording_data(comparison: Comparison, difference: Difference, points: int) -> dict[str, object]:
    """Series and windows of one recording.

    ``series``: channel's index -> t, measured, residual (simulated = measured - residual keeps its digits in 32 bits), window, noise.
    ``windows``: number, start, stop, rank, normalised. ``strip``: edges [s], cells (channels, columns) normalised RMS, the column's window.
    """
    numbers = {channel.name: index for index, channel in enumerate(difference.channels)}
    found = {window.number: window for window in difference.windows if window.recording == comparison.recording}
    worst = [window for window in found.values() if window.rank <= WORST]
    series = {
        str(numbers[channel.channel.name]): _series(channel, worst, points)
        for channel in comparison.channels
        if channel.channel.name in numbers and len(channel.time)
    }
    windows = [
        {
            "number": window.number,
            "start": window.start,
            "stop": window.stop,
            "rank": found[window.number].rank if window.number in found else 0,
            "differs": window.number in found and found[window.number].differs,
            "normalised": _short(found[window.number].normalised) if window.number in found else None,
        }
        for window in comparison.windows
    ]
    return {"name": comparison.recording, "series": series, "windows": windows, "strip": _strip(comparison, difference, found)}


def _series(channel: ComparedChannel, worst: Sequence[WindowDifference], points: int) -> dict[str, object]:
    residual = channel.residual
    kept = [thinned(points, channel.measured, residual)]
    for window in worst:
        inside = np.flatnonzero(channel.window == window.number)
        if len(inside):
            kept.append(inside[thinned(DETAIL, channel.measured[inside], residual[inside])])
    index = np.unique(np.concatenate(kept))
    return {
        "time": packed(channel.time[index], exact=True),
        "measured": packed(channel.measured[index]),
        "residual": packed(residual[index]),
        "window": packed(channel.window[index]),
        "noise": channel.noise,
        "of": len(channel.time),
    }


def _strip(comparison: Comparison, difference: Difference, found: Mapping[int, WindowDifference]) -> dict[str, object]:
    """All windows of all channels; neighbours are joined (the largest stands for them) if there are many, gaps in time stay open."""
    windows = sorted(comparison.windows, key=lambda window: window.start)
    names = [channel.name for channel in difference.channels]
    values = np.array(
        [[found[w.number].channels.get(name, np.nan) if w.number in found else np.nan for name in names] for w in windows]
    ).reshape(len(windows), len(names))
    group = -(-len(windows) // COLUMNS) if windows else 1
    edges: list[float] = []
    columns: list[Array] = []
    shown: list[int] = []
    for first in range(0, len(windows), group):
        members = windows[first : first + group]
        known = values[first : first + group]
        highest = np.where(np.isnan(known).all(axis=0), np.nan, np.nanmax(np.where(np.isnan(known), -1.0, known), axis=0))
        if edges and members[0].start > edges[-1] + 1e-6 * abs(edges[-1]):
            columns.append(np.full(len(names), np.nan))
            shown.append(-1)
            edges.append(members[0].start)
        elif not edges:
            edges.append(members[0].start)
        columns.append(highest)
        shown.append(max(members, key=lambda w: found[w.number].normalised if w.number in found else -1.0).number)
        edges.append(max(members[-1].stop, edges[-1]))
    cells = np.array(columns).reshape(len(columns), len(names)).T
    return {"edges": packed(edges, exact=True), "cells": [packed(row) for row in cells], "window": shown, "joined": group}


def normalised_residual(channel: ComparedChannel) -> Array:
    """Residual over noise (n,) [-]; NaN if the noise is not known."""
    return channel.residual / (channel.noise if channel.noise > 0 else np.nan)


def regime_data(difference: Difference, comparisons: Sequence[Comparison]) -> dict[str, object]:
    """Scatter of normalised residuals against every regime, and the bins of ``Difference.regimes``.

    ``scatter``: channel's index -> residual and regime's name -> value. ``bins``: one entry per channel and regime, strongest first.
    """
    numbers = {channel.name: index for index, channel in enumerate(difference.channels)}
    wanted = list(dict.fromkeys(regime.regime for regime in difference.regimes))
    room = REGIME_VALUES // max(1, len(numbers) * (len(wanted) + 1))
    points = int(np.clip(room, *REGIME_POINTS))
    scatter = {}
    for name, index in numbers.items():
        pairs = [(c, channel) for c in comparisons for channel in c.channels if channel.channel.name == name and len(channel.time)]
        residuals, values = _scatter(pairs, wanted, points)
        if len(residuals):
            scatter[str(index)] = {
                "residual": packed(residuals),
                "values": {regime: packed(v) for regime, v in zip(wanted, values, strict=True) if np.isfinite(v).any()},
            }
    bins = [
        {
            "channel": numbers[r.channel],
            "regime": r.regime,
            "centre": _rounded(r.centre),
            "bias": _rounded(r.bias),
            "biasError": _rounded(r.bias_error),
            "rms": _rounded(r.rms),
            "rmsError": _rounded(r.rms_error),
            "differs": r.differs,
            "explained": _short(r.explained),
        }
        for r in difference.regimes
        if r.channel in numbers
    ]
    return {"names": wanted, "units": {name: regime_unit(name) for name in wanted}, "scatter": scatter, "bins": bins}


def _scatter(pairs: Sequence[tuple[Comparison, ComparedChannel]], wanted: Sequence[str], points: int) -> tuple[Array, list[Array]]:
    """Normalised residuals (P,) with the regimes at their time: a twentieth are the largest, the rest drawn by chance (seeded)."""
    chance = np.random.default_rng(6)
    total = sum(len(channel.time) for _, channel in pairs)
    residuals, values = [], [[] for _ in wanted]
    for comparison, channel in pairs:
        share = max(2, round(points * len(channel.time) / total))
        normalised = normalised_residual(channel)
        known = np.flatnonzero(np.isfinite(normalised))
        if len(known) > share:
            far = known[np.argpartition(-np.abs(normalised[known]), max(1, share // 20))[: max(1, share // 20)]]
            known = np.union1d(far, chance.choice(known, share, replace=False))
        residuals.append(normalised[known])
        for row, found in zip(values, _at(comparison, channel, known, wanted), strict=True):
            row.append(found)
    if not residuals:
        return np.empty(0), []
    return np.concatenate(residuals), [np.concatenate(row) for row in values]


def _at(comparison: Comparison, channel: ComparedChannel, index: NDArray[np.int64], wanted: Sequence[str]) -> list[Array]:
    """Regimes at samples of a channel: the nearest in time, of the same window, else NaN."""
    regimes = comparison.regimes
    if len(regimes.time) == 0:
        return [np.full(len(index), np.nan) for _ in wanted]
    time = channel.time[index]
    right = np.clip(np.searchsorted(regimes.time, time), 1, max(1, len(regimes.time) - 1))
    right = np.minimum(right, len(regimes.time) - 1)
    left = np.maximum(right - 1, 0)
    inside = channel.window[index]
    left_fits, right_fits = regimes.window[left] == inside, regimes.window[right] == inside
    nearer = np.abs(time - regimes.time[left]) <= np.abs(regimes.time[right] - time)
    place = np.where(left_fits & (nearer | ~right_fits), left, right)
    fits = left_fits | right_fits
    return [
        np.where(fits, regimes.values[name][place], np.nan) if name in regimes.values else np.full(len(index), np.nan) for name in wanted
    ]


def regime_unit(name: str) -> str:
    """Unit of a regime, for its axis."""
    known = {"speed": "m/s", "turning_rate": "rad/s", "slope": "rad", "heading": "rad", "x": "m", "y": "m"}
    of_targets = {"slip_ratio": "-", "normal_load": "N", "slip_angle": "rad", "joint_speed": "rad/s or m/s", "effort": "N m or N"}
    return known.get(name) or of_targets.get(name.split("/")[0], "")


def whiteness_data(difference: Difference, comparisons: Sequence[Comparison]) -> dict[str, object]:
    """Per channel's index: autocorrelation with its band, and quantiles of the normalised residual against those of a normal one."""
    from scipy.special import ndtri

    chance = np.random.default_rng(6)
    found = {}
    for index, channel in enumerate(difference.channels):
        pieces = [normalised_residual(c) for comparison in comparisons for c in comparison.channels if c.channel.name == channel.name]
        normalised = np.concatenate(pieces) if pieces else np.empty(0)
        normalised = normalised[np.isfinite(normalised)]
        entry: dict[str, object] = {}
        if len(normalised) >= 8:
            if len(normalised) > 200_000:
                normalised = chance.choice(normalised, 200_000, replace=False)
            count = min(QUANTILES, len(normalised))
            levels = np.concatenate([[0.5 / len(normalised)], (np.arange(count) + 0.5) / count, [1 - 0.5 / len(normalised)]])
            entry |= {"normal": packed(ndtri(levels)), "quantile": packed(np.quantile(normalised, levels))}
        if channel.whiteness is not None:
            white = channel.whiteness
            entry |= {
                "autocorrelation": packed(white.autocorrelation),
                "band": packed(white.band),
                "lags": white.lags,
                "p": _short(white.p),
            }
        found[str(index)] = entry
    return found


def _short(value: float) -> float | None:
    return float(f"{value:.4g}") if np.isfinite(value) else None


def _rounded(values: Array) -> list[float | None]:
    return [_short(float(value)) for value in values]
