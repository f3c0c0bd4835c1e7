"""Flat tops at the extreme values."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding
from rille.recording.gate.motion import Held, Manner
from rille.recording.gate.stuck import Contradicts

SHORTEST = 3  # samples
VISITS = 2
LEVEL = 1.9  # power of the number of samples, by which a run must be less likely than one in that many
SHOWN = 50
SAME = 1e-9  # of the spread: values no farther apart are one
OFF_GRID, ROUNDED = 0.01, 1e-6  # of a grid's step, and of the way on it, beyond which a value is not on the grid


@dataclass(frozen=True, slots=True, kw_only=True)
class FlatTops:
    """Flat tops at the ``side`` (largest or smallest) value of a channel: how many, their samples, and the longest of them.

    sure : the channel by itself shows that they are cut off: it hardly ever says a value twice in a row elsewhere.
    """

    side: str
    value: float
    count: int
    samples: int
    longest: tuple[Held, ...]
    sure: bool = False


def flat_tops(channel: Channel, manner: Manner) -> list[FlatTops]:
    """Tops that are reached too fast to be rounded.

    A rounded top of a quantised signal (step r) is reached with a slope of about 4 r / L per sample, L its length in samples; a cut-off one
    much faster. Two or more such tops of three samples at exactly the extreme value count, if they are a third of all of them; or one, if
    so many samples in a row are more than chance in a channel whose values repeat as seldom as elsewhere.
    """
    value, time = channel.value, channel.time
    finite = value[np.isfinite(value)]
    if len(finite) < 50:
        return []
    found = []
    step = max(manner.resolution, _grid(finite, manner.spread))
    chance = _longest_by_chance(value, float(finite.min()), float(finite.max()))
    for side, extreme in (("largest", float(finite.max())), ("smallest", float(finite.min()))):
        where = np.flatnonzero(value == extreme)
        if len(where) < SHORTEST or extreme == 0:
            continue
        begins = np.flatnonzero(np.diff(where, prepend=-2) > 1)
        first, last = where[begins], where[np.append(begins[1:], len(where)) - 1] + 1
        long = last - first >= SHORTEST
        first, last = first[long], last[long]
        length = last - first
        before = np.abs(extreme - value[np.maximum(first - 2, 0)]) / 2
        after = np.abs(extreme - value[np.minimum(last + 1, len(value) - 1)]) / 2
        slope = np.fmax(np.nan_to_num(before), np.nan_to_num(after))
        cut = slope > np.maximum(20 * max(step, 1e-6 * abs(extreme)) / np.maximum(length, 1), 1.5 * step)
        sure = bool(np.any(length[cut] > chance)) and manner.noise >= step
        if np.count_nonzero(cut) < max(1 if sure else VISITS, len(first) / 3):
            continue
        chosen = np.flatnonzero(cut)
        order = chosen[np.argsort(length[chosen], kind="stable")[::-1][:SHOWN]]
        longest = tuple(Held(span=(float(time[first[k]]), float(time[last[k] - 1])), value=extreme, samples=int(length[k])) for k in order)
        found.append(FlatTops(side=side, value=extreme, count=len(chosen), samples=int(length[cut].sum()), longest=longest, sure=sure))
    return found


def _grid(value: NDArray[np.float64], spread: float) -> float:
    """The step of the grid that all of (n,) values lie on; 0 of a fine channel, which may move by far more from sample to sample."""
    known = np.unique(value)
    steps = np.diff(known)
    step = float(np.min(steps[steps > SAME * spread], initial=np.inf))
    if not np.isfinite(step):
        return 0.0
    places = (known - known[0]) / step
    return step if np.all(np.abs(places - np.round(places)) < OFF_GRID + ROUNDED * places) else 0.0


def _longest_by_chance(value: NDArray[np.float64], low: float, high: float) -> float:
    """Samples in a row that may be equal by chance among (n,), as often as neighbours away from the extremes are."""
    same = (value[1:] == value[:-1])[(value[1:] != low) & (value[1:] != high)]
    repeats = (np.count_nonzero(same) + 1) / (len(same) + 2)
    return 1.0 + LEVEL * float(np.log(len(value)) / -np.log(repeats))


def check_saturation(channel: Channel, count: int, tops: Sequence[FlatTops], contradicts: Contradicts) -> list[GateFinding]:
    """Whether the channel is cut off, and no other one confirms that nothing went beyond. Commands are limited on purpose: a note."""
    found = []
    for top in tops:
        command = channel.role == "command"
        verdicts = [] if command else [contradicts(held) for held in top.longest[:10]]
        if "" in verdicts and not any(verdicts):
            continue
        begin, end = top.longest[0].span
        many = f"{top.count} flat tops" if top.count > 1 else "a flat top"
        message = (
            f"channel '{channel.name}' is cut off at its {top.side} value, {top.value:.6g} {channel.unit}: {many}, "
            f"{top.samples / count:.1%} of its samples, the longest from {begin:.6g} to {end:.6g} s"
        )
        if not command:
            message += "; what went beyond is lost: leave these stretches out of fits"
        intervals = sorted(list(held.span) for held in top.longest)
        detail = {
            "side": top.side,
            "value": top.value,
            "fraction": top.samples / count,
            "intervals": intervals,
            "witnesses": sorted({verdict for verdict in verdicts if verdict}),
            "sure": top.sure,
        }
        severity = "note" if command else "warning"
        found.append(GateFinding(code="saturation", severity=severity, channel=channel.name, detail=detail, message=message))
    return found
