"""Values that hold still while the machine does not."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding
from rille.recording.gate.motion import Held, Manner
from rille.recording.gate.runs import held_runs

Array = NDArray[np.float64]
SHORTEST = 10  # samples
SHOWN = 50
STILL = ("joint.position", "part.position", "part.orientation", "wheel.sinkage")  # a machine at rest holds these at any value
Contradicts = Callable[[Held], str | None]  # as motion.contradicts


def held_stretches(channel: Channel, manner: Manner) -> list[Held]:
    """Stretches on which an observed channel holds one value for longer than it usually does; the longest fifty.

    ``odd`` are those that need no other channel as witness: the value jumps on release by more than it else changes in one step, or a rate,
    force or current whose noise exceeds its resolution holds a value other than zero and its extremes. Values that are held from one slow
    sample to the next are no such stretches.
    """
    time = channel.time
    value = np.where(np.isfinite(channel.value), channel.value, np.nan)
    n = len(value)
    finite = value[~np.isnan(value)]
    if n < SHORTEST or not len(finite):
        return []
    low, high = float(finite.min()), float(finite.max())
    if low == high:
        return [Held(span=(float(time[0]), float(time[-1])), value=low, samples=n)]
    first, last = held_runs(value, SHORTEST)
    if not len(first):
        return []
    order = np.argsort(last - first, kind="stable")[::-1][:SHOWN]
    first, last = first[order], last[order]
    inside = np.zeros(n - 1, dtype=bool)
    for a, b in zip(first, last, strict=True):
        inside[a : b - 1] = True
    usual = np.abs(np.diff(value))[~inside]
    usual = usual[np.isfinite(usual)]
    if not len(usual):
        return []
    largest = max(4 * float(np.quantile(usual, 0.995)), 3 * manner.resolution)
    repeats = (np.count_nonzero(usual == 0) + 1) / (len(usual) + 2)
    chance = SHORTEST + 2 * np.log(n) / -np.log(min(repeats, 0.999))
    noisy = manner.noise > max(0.7 * manner.resolution, 1e-6 * manner.spread) and channel.quantity not in STILL and repeats < 0.3
    found = []
    for a, b in zip(first, last, strict=True):
        if b - a > chance:
            held = float(value[a])
            jumps = b < n and bool(abs(value[b] - held) > largest)
            odd = jumps or bool(noisy and abs(held) > 3 * manner.noise and held not in (low, high))
            found.append(Held(span=(float(time[a]), float(time[b - 1])), value=held, samples=int(b - a), odd=odd))
    return found


def check_stuck(channel: Channel, count: int, stretches: Sequence[Held], contradicts: Contradicts) -> list[GateFinding]:
    """Stretches on which the channel is stuck: another channel moves, or, where none can tell, the channel itself shows it.

    channel : its samples are not needed. count : of its samples.
    """
    if len(stretches) == 1 and stretches[0].samples == count:
        return _constant(channel, stretches[0], contradicts(stretches[0]))
    stuck, witnesses = [], set()
    for held in stretches:
        witness = contradicts(held)
        if witness or (witness is None and held.odd):
            stuck.append(held)
            witnesses |= {witness} if witness else set()
    if not stuck:
        return []
    samples = sum(held.samples for held in stuck)
    longest = max(stuck, key=lambda held: held.samples)
    against = f" while {' and '.join(repr(name) for name in sorted(witnesses))} moved" if witnesses else ""
    many = f"{len(stuck)} stretches" if len(stuck) > 1 else "a stretch"
    message = (
        f"channel '{channel.name}' is stuck on {many}, {samples / count:.1%} of its samples, the longest at {longest.value:.6g} "
        f"{channel.unit} from {longest.span[0]:.6g} to {longest.span[1]:.6g} s{against}; leave these stretches or the channel out"
    )
    detail = {
        "fraction": samples / count,
        "intervals": sorted(list(held.span) for held in stuck),
        "value": longest.value,
        "witnesses": sorted(witnesses),
    }
    severity = "error" if samples > 0.5 * count else "warning"
    return [GateFinding(code="stuck", severity=severity, channel=channel.name, detail=detail, message=message)]


def _constant(channel: Channel, held: Held, witness: str | None) -> list[GateFinding]:
    detail = {"value": held.value, "fraction": 1.0, "intervals": [list(held.span)], "witnesses": [witness] if witness else []}
    what = f"channel '{channel.name}' holds {held.value:.6g} {channel.unit} throughout"
    if witness:
        message = f'{what} while \'{witness}\' moved; set role = "ignore", or accept "stuck" for this channel'
        return [GateFinding(code="stuck", severity="error", channel=channel.name, detail=detail, message=message)]
    return [
        GateFinding(code="constant", severity="note", channel=channel.name, detail=detail, message=f"{what}: it says nothing of the motion")
    ]
