"""Random disturbances of samples at given instants: coloured noise, random walk, lapses."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def coloured_noise(rng: np.random.Generator, times: Array, sigma: float, time_constant: float) -> Array:
    """Ornstein-Uhlenbeck process with the variance sigma^2 and the autocorrelation exp(-|dt| / time_constant), exact at any instants.

    x[k+1] = a[k] x[k] + sigma sqrt(1 - a[k]^2) n[k], a[k] = exp(-(t[k+1] - t[k]) / time_constant), n standard normal.

    Parameters
    ----------
    times : (n,) [s], ascending. sigma : 1 sigma in the unit of the samples. time_constant : [s] > 0.

    Returns
    -------
    Shape (n,), stationary from the first sample on.

    Source: Gillespie, D. T. (1996), Exact numerical simulation of the Ornstein-Uhlenbeck process, Phys. Rev. E 54, 2084.
    """
    normal = rng.standard_normal(len(times))
    decay = np.exp(-np.diff(times, prepend=-np.inf) / time_constant)
    x = sigma * np.sqrt(1 - decay**2) * normal
    shift = 1
    while shift < len(x) and decay[shift:].any():  # x = decay x_before + x, composed over 1, 2, 4, ... samples
        x[shift:] = x[shift:] + decay[shift:] * x[:-shift]
        decay[shift:] = decay[shift:] * decay[:-shift]
        shift *= 2
    return x


def random_walk(rng: np.random.Generator, times: Array, rate: float) -> Array:
    """Integrated white noise: zero at 0 s, with the standard deviation rate sqrt(t).

    times : (n,) [s], ascending, not below 0. rate : [unit/s^0.5]. Returns shape (n,).
    """
    steps = np.sqrt(np.maximum(np.diff(times, prepend=0.0), 0.0))
    return rate * np.cumsum(steps * rng.standard_normal(len(times)))


def lapses(rng: np.random.Generator, times: Array, fraction: float, mean_length: float) -> NDArray[np.bool_]:
    """Which samples fall into lapses: a two-state Markov process with exponential dwell times.

    times : (n,) [s], ascending. fraction : share of the time in lapses [-], below 1. mean_length : mean duration of a lapse [s]; 0:
    each sample is lost by itself. Returns shape (n,), true where lost.
    """
    if mean_length == 0:
        return rng.random(len(times)) < fraction
    if fraction == 0 or len(times) == 0:
        return np.zeros(len(times), dtype=bool)
    span = float(times[-1] - times[0])
    between = mean_length * (1 - fraction) / fraction
    edges = [float(times[0])]
    lost_first = bool(rng.random() < fraction)
    while edges[-1] <= times[-1]:
        count = max(4, int(2 * span / (mean_length + between)) + 1)
        lengths = np.empty(2 * count)
        lengths[0::2] = rng.exponential(mean_length if lost_first else between, count)
        lengths[1::2] = rng.exponential(between if lost_first else mean_length, count)
        edges += list(edges[-1] + np.cumsum(lengths))
    number = np.searchsorted(edges, times, side="right") - 1
    return (number % 2 == 0) == lost_first  # stretches alternate
