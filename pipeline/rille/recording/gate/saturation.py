"""Flat tops at the extreme values."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rille.model.recording import Channel, GateFinding
from rille.recording.gate.motion import Held, Manner
from rille.recording.gate.stuck import Contradicts

SHORTEST = 3  # samples
VISITS = 2
SHOWN = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class FlatTops:
    """Flat tops at the ``side`` (largest or smallest) value of a channel: how many, their samples, and the longest of them."""

    side: str
    value: float
    count: int
    samples: int
    longest: tuple[Held, ...]


def flat_tops(channel: Channel, manner: Manner) -> list[FlatTops]:
    """Tops that are reached too fast to be rounded.

    A rounded top of a quantised signal (step r) is reached with a slope of about 4 r / L per sample, L its length in samples; a cut-off one
    much faster. Two or more such tops of three samples at exactly the extreme value count, if they are a third of all of them.
    """
    value, time = channel.value, channel.time
    finite = value[np.isfinite(value)]
    if len(finite) < 50:
        return []
    found = []
    for side, extreme in (("largest", float(finite.max())), ("smallest", float(finite.min()))):
        where = np.flatnonzero(value == extreme)
        if len(where) < SHORTEST * VISITS or extreme == 0:
            continue
        begins = np.flatnonzero(np.diff(where, prepend=-2) > 1)
        first, last = where[begins], where[np.append(begins[1:], len(where)) - 1] + 1
        long = last - first >= SHORTEST
        first, last = first[long], last[long]
        length = last - first
        before = np.abs(extreme - value[np.maximum(first - 2, 0)]) / 2
        after = np.abs(extreme - value[np.minimum(last + 1, len(value) - 1)]) / 2
        slope = np.fmax(np.nan_to_num(before), np.nan_to_num(after))
        cut = slope > np.maximum(20 * max(manner.resolution, 1e-6 * abs(extreme)) / np.maximum(length, 1), 1.5 * manner.resolution)
        if np.count_nonzero(cut) < max(VISITS, len(first) / 3):
            continue
        chosen = np.flatnonzero(cut)
        order = chosen[np.argsort(length[chosen], kind="stable")[::-1][:SHOWN]]
        longest = tuple(Held(span=(float(time[first[k]]), float(time[last[k] - 1])), value=extreme, samples=int(length[k])) for k in order)
        found.append(FlatTops(side=side, value=extreme, count=len(chosen), samples=int(length[cut].sum()), longest=longest))
    return found


def check_saturation(channel: Channel, count: int, tops: Sequence[FlatTops], contradicts: Contradicts) -> list[GateFinding]:
    """Whether the channel is cut off, and no other one confirms that nothing went beyond. Commands are limited on purpose: a note."""
    found = []
    for top in tops:
        command = channel.role == "command"
        verdicts = [] if command else [contradicts(held) for held in top.longest[:10]]
        if "" in verdicts and not any(verdicts):
            continue
        begin, end = top.longest[0].span
        message = (
            f"channel '{channel.name}' is cut off at its {top.side} value, {top.value:.6g} {channel.unit}: {top.count} flat tops, "
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
        }
        severity = "note" if command else "warning"
        found.append(GateFinding(code="saturation", severity=severity, channel=channel.name, detail=detail, message=message))
    return found
