"""Noise of a channel, from the channel itself: what differences of high order leave of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
ORDERS = (2, 3, 4)
SMEARED = 0.5  # of the resolution: noise from which on rounding errors of neighbouring samples are independent
# The share of differences that is looked at, and its absolute bound for a normal distribution of unit width. The median would be more
# robust, but half of the differences of a value that its driver repeats are zero.
SHARE, BOUND = 0.8, 1.2815515655446004


def quantisation(channel: Channel) -> float:
    """Standard deviation [unit] of rounding to the channel's resolution: resolution / sqrt(12)."""
    return (channel.resolution or 0.0) / np.sqrt(12)


def steady_rounding(channel: Channel, noise: float) -> float:
    """Standard deviation [unit] of what rounding gives to all samples of a value at rest alike; 0 where the noise smears it over steps.

    noise [unit] : of a sample, rounding included.
    """
    return quantisation(channel) if noise < SMEARED * (channel.resolution or 0.0) else 0.0


def noise_of(channel: Channel) -> tuple[float, str]:
    """1 sigma [unit] of a channel and where it is from: ``stated``, ``differences`` or ``resolution``.

    A stated noise is that before rounding; rounding adds resolution/sqrt(12). A sigma of 0 means that the channel shows no noise at all.
    """
    rounding = quantisation(channel)
    if channel.noise is not None:
        return float(np.hypot(channel.noise, rounding)), "stated"
    found = difference_noise(channel.time, channel.value)
    if found > rounding:
        return found, "differences"
    if rounding > 0:
        return float(rounding), "resolution"
    return lattice_noise(channel.value), "resolution"


def shared_noise(recordings: Sequence[Recording]) -> dict[str, tuple[float, str]]:
    """Noise of observed channels by name, as of ``noise_of``, the median over recordings: one sensor has one noise."""
    found: dict[str, list[tuple[float, str]]] = {}
    for recording in recordings:
        for channel in recording.with_role("observed"):
            found.setdefault(channel.name, []).append(noise_of(channel))
    return {name: sorted(noises)[len(noises) // 2] for name, noises in found.items()}


def difference_noise(time: Array, value: Array) -> float:
    """White noise [unit] of samples (n,) at irregular times (n,) [s]; NaN are left out; 0 if there are fewer than 12.

    A divided difference of order m over m + 1 neighbours cancels polynomials of degree m - 1; with weights of unit length it has the
    variance of the noise. It is taken from the quantile of 80 % of their sizes (motion that is no polynomial makes few of them large) for
    the orders 2 to 4, and the least is the answer: each is the noise plus what is left of the motion.
    """
    seen = np.isfinite(value) & np.isfinite(time)
    time, value = time[seen], value[seen]
    if len(time) < 12:
        return 0.0
    return min(_of_order(time, value, order) for order in ORDERS)


def _of_order(time: Array, value: Array, order: int) -> float:
    count = len(time) - order
    near = np.lib.stride_tricks.sliding_window_view(time, order + 1)
    span = near[:, -1] - near[:, 0]
    usable = (np.diff(near, axis=1) > 0).all(axis=1) & (span <= 3 * np.median(span))  # not across gaps
    if usable.sum() < 8:
        return 0.0
    near = (near[usable] - near[usable, :1]) / span[usable, None]
    weights = np.ones((len(near), order + 1))
    for k in range(order + 1):
        for other in range(order + 1):
            if other != k:
                weights[:, k] /= near[:, k] - near[:, other]
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    values = np.lib.stride_tricks.sliding_window_view(value, order + 1)[:count][usable]
    left = np.einsum("nk,nk->n", weights, values)
    within = float(np.quantile(np.abs(left), SHARE)) / BOUND
    rounding = float(np.finfo(np.float32).eps * np.abs(value).max())  # loggers keep single precision
    return within if within > rounding else float(np.sqrt(np.mean(left**2)))


def lattice_noise(value: Array) -> float:
    """Rounding noise [unit] of values that stand on a lattice: its step (least distance of neighbouring values) / sqrt(12); 0 if all are
    equal.
    """
    levels = np.unique(value[np.isfinite(value)][:100_000])
    return float(np.diff(levels).min() / np.sqrt(12)) if len(levels) > 1 else 0.0
