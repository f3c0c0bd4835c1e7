"""Recorded steps: what the manifest asks to change in what was recorded. Pure functions of one clock's times and values."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused
from rille.model.recording import Array, Channel, Correction
from rille.model.turns import counted_on, unwrapped

WHOLE = ("sort", "drop_duplicates", "resample", "unwrap")  # need all samples of a clock at once; the others work piece by piece
OF_CHANNEL = ("drop_samples", "unwrap")  # of one channel; the others change a clock
MOST = 50_000_000  # samples of a clock that are resampled: all of them at once
Values = dict[str, Array]


def correct(step: Correction, clock: str, time: Array, values: Values, channels: Mapping[str, Channel]) -> tuple[Array, Values, int]:
    """Apply one step to samples of one clock.

    time : (n,) [s]. values : (n,) each, by name of the channel. Returns times, values, and how many samples the step touched.
    A step whose ``channel`` names another clock or channel changes nothing.
    """
    if step.channel not in (values if step.kind in OF_CHANNEL else ("", clock)):
        return time, values, 0
    if step.kind == "drop_samples":
        chosen = _span(step, time)
        return time, values | {step.channel: np.where(chosen, np.nan, values[step.channel])}, int(chosen.sum())
    if step.kind == "unwrap":
        turned = counted_on(values[step.channel], _number(step, "by"))
        return time, values | {step.channel: turned}, int(np.count_nonzero(np.abs(turned - values[step.channel]) > 0))
    if step.kind == "shift_clock":
        return time + _number(step, "by"), values, len(time)
    if step.kind == "scale_clock":
        return time * _number(step, "factor"), values, len(time)
    if step.kind == "cut":
        return _chosen(time, values, _span(step, time))
    if step.kind == "sort":
        order = np.argsort(time, kind="stable")
        moved = int(np.count_nonzero(order != np.arange(len(order))))
        return time[order], {name: value[order] for name, value in values.items()}, moved
    if step.kind == "drop_duplicates":
        return _merged(time, values)
    return _resampled(time, values, channels, 1 / _number(step, "rate"))


def _number(step: Correction, key: str) -> float:
    return float(step.detail[key])  # type: ignore[arg-type]


def _span(step: Correction, time: Array) -> NDArray[np.bool_]:
    start, end = (float(step.detail.get(key, bound)) for key, bound in (("start", -np.inf), ("end", np.inf)))  # type: ignore[arg-type]
    return (time >= start) & (time <= end)


def _chosen(time: Array, values: Values, keep: NDArray[np.bool_]) -> tuple[Array, Values, int]:
    return time[keep], {name: value[keep] for name, value in values.items()}, int(len(time) - keep.sum())


def _merged(time: Array, values: Values) -> tuple[Array, Values, int]:
    """One sample of each time: of every channel its first value there that is not missing, so that rows which two rates share lose none."""
    if not len(time):
        return time, values, 0
    starts = np.flatnonzero(np.concatenate([[True], np.diff(time) != 0]))
    merged = {}
    for name, value in values.items():
        place = np.minimum.reduceat(np.where(np.isnan(value), len(value), np.arange(len(value))), starts)
        merged[name] = np.append(value, np.nan)[place]
    return time[starts], merged, len(time) - len(starts)


def _resampled(time: Array, values: Values, channels: Mapping[str, Channel], step: float) -> tuple[Array, Values, int]:
    """On multiples of ``step``: commands hold their value, the rest is interpolated linearly, angles of an orientation the short way
    round, those of a joint without the jumps of an encoder that wraps, quaternions of one sign and of length one; an instant between
    samples of which one is missing is missing."""
    if len(time) < 2:
        return time, values, 0
    first, last = np.ceil(time[0] / step - 1e-9), np.floor(time[-1] / step + 1e-9)
    if not last - first < MOST:
        raise InputRefused(
            f"resampling to {1 / step:g} Hz would make {last - first:.3g} samples of {time[-1] - time[0]:g} s; at most {MOST:g} are taken, "
            "lower the rate or cut first"
        )
    grid = np.arange(first, last + 1) * step
    before = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(time) - 2)
    width = time[before + 1] - time[before]
    part = np.clip((grid - time[before]) / np.where(width > 0, width, 1), 0, 1)
    quaternions = _quaternions(channels, values)
    values = values | _of_one_sign(quaternions, values)
    found: Values = {}
    for name, value in values.items():
        channel = channels[name]
        if channel.quantity == "joint.position" and channel.unit == "rad" and channel.role != "command":
            value = unwrapped(value)
        if channel.role == "command":
            found[name] = np.where(part >= 1, value[before + 1], value[before])
            continue
        rise = value[before + 1] - value[before]
        if channel.quantity == "part.orientation" and channel.unit == "rad":
            rise = (rise + np.pi) % (2 * np.pi) - np.pi
        mixed = value[before] + part * rise
        found[name] = np.where(part <= 0, value[before], np.where(part >= 1, value[before + 1], mixed))
    for names in quaternions:
        length = np.sqrt(sum(found[name] ** 2 for name in names))
        found |= {name: found[name] / np.where(length > 0, length, 1) for name in names}
    return grid, found, len(grid)


def _quaternions(channels: Mapping[str, Channel], values: Values) -> list[tuple[str, ...]]:
    """Names of the channels w, x, y, z of each recorded quaternion that has all four; of two instruments on one part, in their order."""
    parts: dict[tuple[str, str, str], list[dict[str, str]]] = {}
    for name in values:
        channel = channels[name]
        if channel.quantity != "part.orientation" or channel.unit != "1":
            continue
        told = parts.setdefault((channel.target, channel.frame, channel.role), [])
        if all(channel.component in one for one in told):
            told.append({})
        next(one for one in told if channel.component not in one)[channel.component] = name
    return [tuple(one[c] for c in "wxyz") for told in parts.values() for one in told if set(one) == set("wxyz")]


def _of_one_sign(quaternions: Sequence[tuple[str, ...]], values: Values) -> Values:
    """Quaternions without changes of sign between neighbours: q and -q are one orientation, but their mean is none."""
    turned: Values = {}
    for names in quaternions:
        q = np.array([values[name] for name in names])
        known = np.flatnonzero(np.isfinite(q).all(axis=0))
        flips = (q[:, known[1:]] * q[:, known[:-1]]).sum(axis=0) < 0
        q[:, known[1:]] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)
        turned |= dict(zip(names, q, strict=True))
    return turned
