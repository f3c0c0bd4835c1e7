"""Position, velocity and acceleration of one coordinate at given instants, from noisy samples of it and of its rate, without a model.

Around each instant t0 a cubic is fitted by least squares to all samples within a half-width w,

    q(t) = q0 + v0 s + a0 s^2/2 + j0 s^3/6,   s = t - t0,

positions weighted by their noise, samples of the rate by theirs. The half-width is the largest for which the estimates of q0, v0 and a0
still agree with those of all smaller half-widths within their errors (intersection of confidence intervals, Goldenshluger & Nemirovski
1997), so that it adapts to the motion: wide where it is slow, narrow where an effort jumps. Gaps, irregular clocks and several sensors of
one coordinate need no care. The covariance is that of the fit, widened for the part of the bias that the rule cannot see.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AGREE = 1.5  # standard deviations within which estimates of two half-widths agree
WIDEN = 1.25  # of standard deviations, for the bias below that bound; test_smoother.py measures the coverage
GROWTH = 2**0.5  # of the half-width
NEAR = 0.25  # of the widest half-width, within which samples must stand
LEAST = 6  # numbers that a fit of four needs at least
BEYOND = 2.0  # intervals from the nearest sample, to which a fit may be carried
SPARSE = LEAST + BEYOND  # intervals that a fit may always reach: there it has the numbers that it needs, on one side alone


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """Samples of a coordinate (order 0) or of its rate (order 1). time, value : (n,). noise : 1 sigma."""

    order: int
    time: Array
    value: Array
    noise: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalMotion:
    """One coordinate at instants.

    value : (m, 3) position, velocity, acceleration; without samples of the position it is 0. covariance : (m, 3, 3). width : (m,) [s] of
    the fit. seen : (m,) whether there were samples near enough. placed : whether there were samples of the position.
    """

    value: Array
    covariance: Array
    width: Array
    seen: NDArray[np.bool_]
    placed: bool


def reach(widest: float, *times: Array) -> float:
    """How far [s] a fit may reach for samples at ``times``, of all sensors together: ``widest``, or ``SPARSE`` of their intervals."""
    apart = np.diff(np.sort(np.concatenate(times)))
    return max(widest, SPARSE * float(np.median(apart))) if len(apart) else widest


def smooth(instants: Array, series: Sequence[Series], *, widest: float, widths: Array | None = None) -> LocalMotion:
    """Motion at ``instants`` (m,) [s] from ``series``; no fit reaches farther than ``widest`` [s] to either side, or than ``SPARSE``
    intervals of samples that are few (a position of one satellite fix per second).

    widths : (m,) [s] half-widths to use, 0: leave that instant out. None: the rule finds them.
    """
    series = [_clean(s) for s in series]
    placed = any(s.order == 0 for s in series)
    widest = reach(widest, *(s.time for s in series if s.order == 0 or not placed))
    value, covariance = np.zeros((len(instants), 3)), np.zeros((len(instants), 3, 3))
    width, seen = np.zeros(len(instants)), np.zeros(len(instants), dtype=bool)
    for k, instant in enumerate(instants):
        found = _at(instant, series, placed, widest) if widths is None else _with_width(instant, series, placed, float(widths[k]))
        if found is not None:
            value[k], covariance[k], width[k] = found
            seen[k] = True
    return LocalMotion(value=value, covariance=covariance, width=width, seen=seen, placed=placed)


def _clean(series: Series) -> Series:
    seen = np.isfinite(series.value)
    return Series(order=series.order, time=series.time[seen], value=series.value[seen], noise=max(series.noise, 1e-12))


def _at(instant: float, series: Sequence[Series], placed: bool, widest: float) -> tuple[Array, Array, float] | None:
    """Value (3,), covariance (3, 3) and half-width of the fit at one instant; None without enough samples."""
    offsets, rows, values = _near(instant, series, widest)
    x, basis, y = np.abs(np.concatenate(offsets)), np.concatenate(rows), np.concatenate(values)
    first_column = 0 if placed else 1
    order = np.argsort(x, kind="stable")
    x, basis, y = x[order], basis[order, first_column:], y[order]
    if len(x) < LEAST:
        return None
    if not _surrounded(np.concatenate([o for o, s in zip(offsets, series, strict=True) if s.order == 0 or not placed]), widest):
        return None
    lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
    best: tuple[Array, Array, float] | None = None
    half_width = float(x[LEAST - 1])
    while True:
        count = int(np.searchsorted(x, half_width, side="right"))
        fit = _fit(basis[:count], y[:count], half_width, first_column)
        if fit is not None:
            value, covariance = fit
            reach = AGREE * np.sqrt(np.diag(covariance))
            lower, upper = np.maximum(lower, value - reach), np.minimum(upper, value + reach)
            if best is not None and (lower > upper).any():
                break
            best = (value, covariance * WIDEN**2, half_width)
        if count == len(x) or half_width >= widest:
            break
        half_width = max(half_width * GROWTH, float(x[min(count, len(x) - 1)]))
    return best


def _near(instant: float, series: Sequence[Series], widest: float) -> tuple[list[Array], list[Array], list[Array]]:
    """Of each series, samples about the instant: their distances [s], rows of the fit (n, 4) and values, both divided by the noise."""
    offsets, rows, values = [], [], []
    for s in series:
        first, last = np.searchsorted(s.time, (instant - widest, instant + widest))
        x = s.time[first:last] - instant
        offsets.append(x)
        columns = [np.ones_like(x), x, x**2 / 2, x**3 / 6] if s.order == 0 else [np.zeros_like(x), np.ones_like(x), x, x**2 / 2]
        rows.append(np.stack(columns, axis=1) / s.noise)
        values.append(s.value[first:last] / s.noise)
    return offsets, rows, values


def _with_width(instant: float, series: Sequence[Series], placed: bool, half_width: float) -> tuple[Array, Array, float] | None:
    """As ``_at`` with a half-width that is given."""
    if half_width <= 0:
        return None
    _, rows, values = _near(instant, series, half_width * (1 + 1e-9))
    basis, y = np.concatenate(rows), np.concatenate(values)
    if len(y) < LEAST:
        return None
    first_column = 0 if placed else 1
    fit = _fit(basis[:, first_column:], y, half_width, first_column)
    return None if fit is None else (*fit, half_width)


def _surrounded(offsets: Array, widest: float) -> bool:
    """Whether samples stand on both sides, or one so near that nothing is missing in between: beyond them a cubic says nothing."""
    offsets = np.sort(offsets)
    if len(offsets) < 2:
        return False
    left, right = offsets[offsets <= 0], offsets[offsets >= 0]
    if len(left) and len(right) and max(-left[-1], right[0]) <= NEAR * widest:
        return True
    return bool(np.abs(offsets).min() <= BEYOND * np.median(np.diff(offsets)))


def _fit(basis: Array, y: Array, half_width: float, first_column: int) -> tuple[Array, Array] | None:
    """Least squares in scaled time: value (3,) and covariance (3, 3), zeros for a position that was not measured; None if undetermined."""
    scale = half_width ** -np.arange(first_column, 4.0) if half_width > 0 else np.ones(4 - first_column)
    scaled = basis * scale
    normal = scaled.T @ scaled
    size = np.sqrt(np.diag(normal))
    if not (size > 0).all():
        return None
    normal = normal / np.outer(size, size)
    if np.linalg.cond(normal) > 1e12:
        return None
    inverse = np.linalg.inv(normal)
    to_unit = scale / size
    solution = to_unit * (inverse @ ((scaled / size).T @ y))
    left = y - basis @ solution
    lack = float(left @ left) / max(1, len(y) - len(solution))  # above one where even the narrowest fit is too wide
    covariance = inverse * np.outer(to_unit, to_unit) * max(1.0, lack)
    value, wide = np.zeros(4), np.zeros((4, 4))
    value[first_column:] = solution
    wide[first_column:, first_column:] = covariance
    return value[:3], wide[:3, :3]
