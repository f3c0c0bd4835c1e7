"""White noise of samples, from the samples themselves: what differences of high order leave of them."""

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel

Array = NDArray[np.float64]
ORDERS = (2, 3, 4)
UNDERSTATED = 2.0  # times a stated noise, from which on what samples plainly show counts instead
BLOCKS, LEAST, MOST = 6, 60, 5000  # parts of a recording, and samples of each: that it must have, and that are looked at
PLAIN = 0.2  # relative: by which the orders 3 and 4 may differ where it is noise that they leave, and no motion
EVEN = 1.5  # times, by which noise may differ between parts
# The share of differences that is looked at, and its absolute bound for a normal distribution of unit width. The median would be more
# robust, but half of the differences of a value that its driver repeats are zero.
SHARE, BOUND = 0.8, 1.2815515655446004


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


def plain_noise(time: Array, value: Array) -> float:
    """White noise [unit] of samples (n,) at times (n,) [s] that nobody can take for motion; 0 where it may be.

    In each of ``BLOCKS`` parts of the recording differences of the orders 3 and 4 leave the same, which they do of no slow motion, and in
    all of them nearly the same, which they do of no motion that comes and goes.
    """
    seen = np.isfinite(value) & np.isfinite(time)
    parts = [part[:MOST] for part in np.array_split(np.flatnonzero(seen), BLOCKS)]
    found = [tuple(_of_order(time[part], value[part], order) for order in (3, 4)) for part in parts if len(part) >= LEAST]
    if len(found) < BLOCKS or any(abs(third - fourth) > PLAIN * max(third, fourth) for third, fourth in found):
        return 0.0
    noise = [min(both) for both in found]
    return float(np.median(noise)) if max(noise) < EVEN * min(noise) else 0.0


def stated_noise(channel: Channel) -> float:
    """1 sigma [unit] of a channel by its statement, which is that before rounding, and of rounding, resolution / sqrt(12); 0 if none is
    stated.
    """
    return 0.0 if channel.noise is None else float(np.hypot(channel.noise, (channel.resolution or 0.0) / np.sqrt(12)))


def beyond_stated(channel: Channel) -> float | None:
    """What the samples of a channel plainly scatter by [unit], if that is more than ``UNDERSTATED`` times its stated noise; else None."""
    if channel.noise is None:
        return None
    seen = plain_noise(channel.time, channel.value)
    return seen if seen > UNDERSTATED * stated_noise(channel) else None


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
