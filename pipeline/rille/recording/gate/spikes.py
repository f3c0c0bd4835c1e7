"""Needles: single samples, or two in a row, that leave their neighbours and come back."""

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import MOTION_QUANTITIES, Channel, GateFinding

Array = NDArray[np.float64]
HEIGHT = 20.0  # times what the channel usually changes by from sample to sample
SHORTEST = 100  # samples, fewer tell nothing of what is usual
FEW = 10  # largest differences, besides one in five hundred, that do not count as usual: they may be the needles' own
SHOWN = 5


def check_spikes(channel: Channel, resolution: float | None) -> list[GateFinding]:
    """Needles of an observed position, velocity or orientation.

    The bound is ``HEIGHT`` times the largest of the 99.9 % quantile of the differences between neighbours (zeros and the largest few left
    out), ``resolution`` [unit] and the least difference. What does not come back to half of its height is a step and no needle. A full turn
    of an angle and the common sign of a quaternion are no differences.
    """
    if channel.role != "observed" or channel.quantity not in MOTION_QUANTITIES:
        return []
    good = np.isfinite(channel.value)
    time, value = channel.time[good], channel.value[good]
    if len(value) < SHORTEST:
        return []
    if channel.quantity == "part.orientation" and channel.unit == "1":
        value = np.abs(value)
    turning = channel.unit == "rad"
    bound = _bound(_change(value, 1, turning), resolution)
    if bound is None:
        return []
    at = np.unique(np.concatenate([*(_needles(value, wide, bound, turning) for wide in (1, 2)), _off_the_line(value, resolution, turning)]))
    if not len(at):
        return []
    size = float(np.max(np.abs(value[at] - value[at - 1])))
    few = ", ".join(f"{instant:.6g}" for instant in time[at[:SHOWN]])
    count = f"{len(at)} needles" if len(at) > 1 else "a needle"
    message = (
        f"channel '{channel.name}' has {count} of one or two samples, up to {size:.4g} {channel.unit} high where neighbours usually differ "
        f"by less than {bound / HEIGHT:.3g}, at {few} s{' and later' if len(at) > SHOWN else ''}; "
        "leave these samples out (empty values) or accept them as the sensor's"
    )
    detail = {"count": len(at), "times": time[at[:SHOWN]].tolist(), "size": size, "bound": bound}
    return [GateFinding(code="spike", severity="warning", channel=channel.name, detail=detail, message=message)]


def _off_the_line(value: Array, resolution: float | None, turning: bool) -> NDArray[np.intp]:
    """Samples far off the middle of their neighbours, on the same side of both: needles on what moves fast, whose steps hide them."""
    before, after = value[1:-1] - value[:-2], value[1:-1] - value[2:]
    off = np.abs(before + after) / 2
    least = np.minimum(np.abs(before), np.abs(after))
    bound = _bound(off, resolution, each=3)
    if bound is None or not len(off):
        return np.empty(0, dtype=np.intp)
    one_side = (before * after > 0) & (least > 0.5 * off)
    return np.flatnonzero((off > bound) & one_side & ~(turning & (off > np.pi / 2))) + 1


def _change(value: Array, apart: int, turning: bool) -> Array:
    """|differences| (n - apart,) of samples that many apart, of angles without a full turn."""
    change = np.abs(value[apart:] - value[:-apart])
    return np.minimum(change, np.abs(change - 2 * np.pi)) if turning else change


def _bound(change: Array, resolution: float | None, each: int = 1) -> float | None:
    """Height from which a needle is one; None: too few changes to say what is usual. each : changes that a needle makes large."""
    change = change[change > 0]
    n = len(change)
    left = n - each * (FEW + n // 500)
    if left < 2 * FEW:
        return None
    rank = int(0.999 * (left - 1))
    parted = np.partition(change, (0, rank))
    return HEIGHT * max(float(parted[rank]), float(parted[0]), resolution or 0.0)


def _needles(value: Array, wide: int, bound: float, turning: bool) -> NDArray[np.intp]:
    """First index of each needle that is ``wide`` samples long."""
    step, across = _change(value, 1, turning), _change(value, wide + 1, turning)
    height = np.minimum(step[: len(across)], step[wide:])
    return np.flatnonzero((height > bound) & (across < 0.5 * height)) + 1
