"""Noise of a channel, from the channel itself: what differences of high order leave of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, Recording
from rille.model.scatter import beyond_stated, difference_noise, stated_noise

Array = NDArray[np.float64]
SMEARED = 0.5  # of the resolution: noise from which on rounding errors of neighbouring samples are independent


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

    A stated noise is that before rounding; rounding adds resolution/sqrt(12). Where samples plainly scatter by more,
    the statement is wrong (the gate says so), and what they show counts. A sigma of 0 means that the
    channel shows no noise at all.
    """
    rounding = quantisation(channel)
    if channel.noise is not None:
        seen = beyond_stated(channel)
        return (stated_noise(channel), "stated") if seen is None else (seen, "differences")
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


def lattice_noise(value: Array) -> float:
    """Rounding noise [unit] of values that stand on a lattice: its step (least distance of neighbouring values) / sqrt(12); 0 if all are
    equal.
    """
    levels = np.unique(value[np.isfinite(value)][:100_000])
    return float(np.diff(levels).min() / np.sqrt(12)) if len(levels) > 1 else 0.0
