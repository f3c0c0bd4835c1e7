"""A channel on stretches of time, and its means over short windows: what all comparisons of two channels are made of."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Samples = tuple[Array, Array]  # time (n,) [s], value (n,)
MOST = 40_000  # windows that a comparison takes


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """Samples of one channel on stretches that are laid behind each other on one axis of time.

    time : (n,) [s], increasing. value : (n,), finite. hold : the value holds until the next one (a command) instead of going on linearly.
    integral : (n,) of the value over time. gaps : (n,) number of gaps and ends of stretches up to each sample.
    step : [s] median interval. apart : [s] from the start of one stretch to that of the next.
    """

    time: Array
    value: Array
    hold: bool
    integral: Array
    gaps: Array
    step: float
    apart: float

    def at(self, query: Array) -> Array:
        """Value at (m,) times, linear between samples or held."""
        if self.hold:
            return self.value[self._before(query)]
        return np.interp(query, self.time, self.value)

    def primitive(self, query: Array) -> Array:
        """Integral of the value up to (m,) times, exact for what ``hold`` says of the course between samples."""
        before = self._before(query)
        since = query - self.time[before]
        area = self.integral[before] + self.value[before] * since
        if self.hold:
            return area
        after = np.minimum(before + 1, len(self.time) - 1)
        span = np.maximum(self.time[after] - self.time[before], 1e-300)
        return area + 0.5 * (self.value[after] - self.value[before]) / span * since**2

    def mean(self, query: Array, half: float, order: int) -> Array:
        """Mean over [t - half, t + half] of the value (order 0) or of its derivative (order 1)."""
        of = self.primitive if order == 0 else self.at
        return (of(query + half) - of(query - half)) / (2 * half)

    def whole(self, query: Array, reach: float) -> NDArray[np.bool_]:
        """Whether [t - reach, t + reach] lies within the samples and holds no gap."""
        first, last = query - reach, query + reach
        inside = (first >= self.time[0]) & (last <= self.time[-1])
        below = self.gaps[self._before(first)]
        above = self.gaps[np.minimum(np.searchsorted(self.time, last), len(self.time) - 1)]
        return inside & (below == above)

    def _before(self, query: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.time, query, side="right") - 1, 0, len(self.time) - 1)


def lay(stretches: Sequence[Samples], starts: Sequence[float], apart: float, *, hold: bool = False, delay: float = 0.0) -> Track | None:
    """A track of the samples of each stretch; stretch k, which begins at ``starts[k]``, goes to k x ``apart`` [s].

    Samples that are missing or go backwards are left out. delay : [s] added to all times. None: fewer than eight samples are left, or
    their times tell nothing (all of them far apart, or one and the same but for rounding).
    """
    times, values, ends = [], [], []
    for k, ((time, value), start) in enumerate(zip(stretches, starts, strict=True)):
        good = np.isfinite(time) & np.isfinite(value)
        good[1:] &= time[1:] > np.maximum.accumulate(np.where(np.isfinite(time), time, -np.inf))[:-1]
        if good.sum() < 3:
            continue
        times.append(time[good] - start + delay + k * apart)
        values.append(value[good])
        ends.append(len(times[-1]))
    if not times or sum(ends) < 8:
        return None
    time, value = np.concatenate(times), np.concatenate(values)
    interval = np.diff(time)
    within = interval < apart / 4
    step = float(np.median(interval[within])) if within.any() else 0.0
    if not step > 0:
        return None
    gap = ~within | (interval > max(8 * step, 3 * float(np.quantile(interval[within], 0.95))))
    mean = value[:-1] if hold else 0.5 * (value[:-1] + value[1:])
    integral = np.concatenate([[0.0], np.cumsum(np.where(within, interval, 0.0) * mean)])
    return Track(time=time, value=value, hold=hold, integral=integral, gaps=np.concatenate([[0], np.cumsum(gap)]), step=step, apart=apart)


def windows(tracks: Sequence[Track]) -> tuple[Array, float]:
    """Middles (m,) [s] of windows that are whole in all tracks, half a window apart, and half a window [s].

    That is ten samples of the slowest, a quarter of a stretch at most.
    """
    step = max(track.step for track in tracks)
    number = np.floor(tracks[0].time / tracks[0].apart + 0.25).astype(int)
    length = float(np.median(np.bincount(number)[np.unique(number)])) * tracks[0].step
    half = float(np.clip(10 * step, 2 * step, max(length / 8, 2 * step)))
    query = tracks[0].time[:: max(int(half / (2 * tracks[0].step)), 1)]
    for track in tracks:
        query = query[track.whole(query, half)]
    return query if len(query) <= MOST else query[:: len(query) // MOST + 1], half
