"""Residuals of one channel over several comparisons, window after window, and the blocks in time that errors are taken over."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.starts.noise_floor import quantisation
from rille.model.comparison import ComparedChannel, Comparison
from rille.model.recording import Channel

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
ALLOWANCE = {"stated": 1.05, "innovations": 1.1, "repeats": 1.1, "differences": 1.2, "resolution": 1.2, "assumed": 2.0}
"""Factor by which a noise of this origin may be understated before a channel counts as noisy: statements are rounded, estimates scatter."""
LARGEST = 1e60  # [noise]: fourth powers stay finite
LEAST_BLOCKS, MOST_BLOCKS = 24, 60  # enough for a standard error; long enough each to outlast correlation between windows


@dataclass(frozen=True, slots=True, kw_only=True)
class Pooled:
    """One channel, samples in the order of recordings and time. All arrays (n,).

    residual [unit] = measured - simulated, NaN where either is missing. sigma [unit] : noise, NaN where not known. z, start [-] : residual
    and start-state uncertainty over noise.
    instants [-] : of ``ComparedChannel.instants`` the root mean square over noise.
    window : index over all comparisons. run : index of the comparison. block : 0, 1, ...: whole windows, or parts of them if they are few.
    noise : root mean square over samples [unit]. noise_degrees : of freedom that it was estimated with.
    left_out : why the channel takes no part anywhere ('' = it does somewhere).
    """

    channel: Channel
    time: Array
    measured: Array
    simulated: Array
    residual: Array
    sigma: Array
    z: Array
    start: Array
    window: Whole
    run: Whole
    block: Whole
    noise: float
    noise_from: tuple[str, ...]
    noise_degrees: float = float("inf")
    left_out: str = ""
    instants: float = 0.0

    @property
    def allowance(self) -> float:
        """Factor by which residuals may exceed the noise: the largest ``ALLOWANCE`` of its origins, and what instants leave open; or what
        a value at rest may be rounded by all the time.
        """
        return max(float(np.hypot(max(ALLOWANCE[word] for word in self.noise_from), self.instants)), float(np.sqrt(3)) * self.rounding)

    @property
    def rounding(self) -> float:
        """Standard deviation of rounding to the channel's resolution [noise]."""
        return quantisation(self.channel) / self.noise if self.noise > 0 else 0.0

    @property
    def finite(self) -> NDArray[np.bool_]:
        """(n,) where there is a residual."""
        return np.isfinite(self.residual)

    @property
    def degrees(self) -> Array:
        """(n,) degrees of freedom of each sample: what the fitted start state has not taken, 1 - start^2, at least 0.05."""
        return np.where(self.finite, np.maximum(1.0 - self.start**2, 0.05), 0.0)

    def neighbours(self, lag: int) -> NDArray[np.bool_]:
        """(n - lag,) whether sample i and i + lag lie in one window."""
        return self.window[lag:] == self.window[: len(self.window) - lag]


def key_of(channel: Channel) -> tuple[str, str, str, str, str]:
    """What makes channels of two recordings the same."""
    return channel.name, channel.quantity, channel.component, channel.target, channel.frame


def first_windows(comparisons: Sequence[Comparison]) -> Whole:
    """(n + 1,) index of the first window of each comparison, where the windows of all are counted through; last, how many they are."""
    return np.cumsum([0] + [1 + max((window.number for window in c.windows), default=0) for c in comparisons])


def pool(comparisons: Sequence[Comparison]) -> list[Pooled]:
    """Channels of all comparisons, those of the same name and meaning as one, in the order of their first appearance.

    A channel that some recordings leave out is pooled over the others.
    """
    found: dict[tuple, list[tuple[int, int, ComparedChannel]]] = {}
    firsts = first_windows(comparisons).tolist()
    for run, comparison in enumerate(comparisons):
        for channel in comparison.channels:
            found.setdefault(key_of(channel.channel), []).append((run, firsts[run], channel))
    return [_pooled(pieces) for pieces in found.values()]


def _pooled(pieces: Sequence[tuple[int, int, ComparedChannel]]) -> Pooled:
    part = [piece for piece in pieces if not piece[2].left_out]
    used = part or pieces
    channels = [channel for _, _, channel in used]
    noise = np.concatenate([np.full(len(channel.time), channel.noise) for channel in channels])
    noise = np.where(noise > 0, noise, np.nan)
    residual = np.concatenate([channel.residual for channel in channels])
    start = np.concatenate([c.start_gain if len(c.start_gain) == len(c.time) else np.zeros(len(c.time)) for c in channels])
    window = np.concatenate([first + channel.window for _, first, channel in used]).astype(np.int64)
    time = np.concatenate([channel.time for channel in channels])
    residual = np.where(np.isfinite(residual), residual, np.nan)
    known = noise[np.isfinite(residual) & np.isfinite(noise)]
    return Pooled(
        channel=channels[0].channel,
        time=time,
        measured=np.concatenate([channel.measured for channel in channels]),
        simulated=np.concatenate([channel.simulated for channel in channels]),
        residual=residual,
        sigma=noise,
        z=np.clip(residual / noise, -LARGEST, LARGEST),
        start=np.nan_to_num(np.minimum(start / noise, 1.0)),
        window=window,
        run=np.concatenate([np.full(len(channel.time), run) for run, _, channel in used]).astype(np.int64),
        block=blocks(window, time, np.isfinite(residual)),
        noise=float(np.sqrt(np.mean(known**2))) if len(known) else float("nan"),
        noise_from=tuple(dict.fromkeys(channel.noise_from for channel in channels)),
        noise_degrees=sum(channel.noise_degrees for channel in channels),
        left_out="" if part else pieces[0][2].left_out,
        instants=root_mean_square(np.array([c.instants / c.noise for c in channels if c.noise > 0])),
    )


def root_mean_square(values: Array) -> float:
    """Of (n,) values; 0 of none."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def blocks(window: Whole, time: Array, finite: NDArray[np.bool_]) -> Whole:
    """Block of each sample: between ``LEAST_BLOCKS`` and ``MOST_BLOCKS`` of about equal size.

    Many windows are joined with their neighbours, few are cut into equal times.
    """
    present, index = np.unique(window, return_inverse=True)
    n = len(present)
    if n == 0:
        return np.empty(0, dtype=np.int64)
    if n >= LEAST_BLOCKS:
        return (index * min(n, MOST_BLOCKS) // n).astype(np.int64)
    parts = int(min(-(-LEAST_BLOCKS // n), max(1, np.count_nonzero(finite) // (4 * n))))
    low = np.full(n, np.inf)
    high = np.full(n, -np.inf)
    np.minimum.at(low, index, time)
    np.maximum.at(high, index, time)
    along = (time - low[index]) / np.maximum(high - low, np.finfo(float).tiny)[index]
    return (index * parts + np.minimum((along * parts).astype(np.int64), parts - 1)).astype(np.int64)
