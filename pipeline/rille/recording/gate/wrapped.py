"""Angles of joints that jump where an encoder begins anew: by a full turn, or by what its counter holds."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding
from rille.model.turns import counted_on, unwrapped

Array = NDArray[np.float64]
FEWEST = 3  # jumps that show by how much an encoder jumps
AROUND = 10  # samples on either side that show the way it goes
CLEAN = 0.7  # of the jumps, that go against the way
EVEN = 0.02  # by which they may differ
FASTEST = 0.25  # of a jump, that a joint turns within a sample


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rollover:
    """Jumps by ``period`` [rad] with its standard error, of which the first comes before sample ``first`` of those that are there."""

    period: float
    error: float
    count: int
    first: int


def check_wrapped(channel: Channel) -> list[GateFinding]:
    """Of an observed angle of a joint: a note where it wraps by full turns, as it is compared without these jumps; an error where an
    encoder begins anew after another angle, as no joint moves like that.
    """
    if channel.role != "observed" or channel.quantity != "joint.position" or channel.unit != "rad":
        return []
    good = np.isfinite(channel.value)
    time, value = channel.time[good], channel.value[good]
    turns = unwrapped(value) - value
    jumps = np.flatnonzero(np.abs(np.diff(turns)) > np.pi)
    if len(jumps):
        message = (
            f"channel '{channel.name}' jumps by a full turn {_times(len(jumps))}, first at {time[jumps[0] + 1]:.6g} s, as an encoder does "
            "that counts to +-pi; it is compared without these jumps"
        )
        detail: dict[str, object] = {"count": len(jumps), "first": float(time[jumps[0] + 1])}
        return [GateFinding(code="wrapped", severity="note", channel=channel.name, detail=detail, message=message)]
    found = _rollover(value)
    if found is None:
        return []
    message = (
        f"channel '{channel.name}' jumps back by {found.period:.6g} +- {found.error:.2g} rad {_times(found.count)}, first at "
        f'{time[found.first]:.6g} s, while it moves on: its encoder begins anew. State a [[correction]] kind = "unwrap", channel = '
        f'"{channel.name}", by = "{found.period:.6g} rad" (exactly: the size of a count times how many there are) with its reason'
    )
    detail = {"period": found.period, "error": found.error, "count": found.count, "first": float(time[found.first])}
    return [GateFinding(code="rollover", severity="error", channel=channel.name, detail=detail, message=message)]


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _rollover(value: Array) -> _Rollover | None:
    """Jumps by more than half of what the value (n,) spans, nearly all of one size, against the way it goes before and after them.

    A square wave jumps as far, but stands between its jumps; a needle comes back.
    """
    step = np.diff(value)
    jumps = np.flatnonzero(np.abs(step) > 0.5 * (value.max() - value.min())) if len(step) else np.empty(0, dtype=np.intp)
    if len(jumps) < FEWEST:
        return None
    start = np.maximum(jumps - AROUND, np.concatenate([[0], jumps[:-1] + 1]))
    end = np.minimum(jumps + 1 + AROUND, np.concatenate([jumps[1:], [len(value) - 1]]))
    before = (value[jumps] - value[start]) / np.maximum(jumps - start, 1)
    after = (value[end] - value[jumps + 1]) / np.maximum(end - jumps - 1, 1)
    clean = (np.sign(before) == -np.sign(step[jumps])) & (np.sign(after) == -np.sign(step[jumps]))
    if np.count_nonzero(clean) < FEWEST or np.mean(clean) < CLEAN:
        return None
    size = np.abs(step[jumps] - 0.5 * (before + after))[clean]
    period = float(np.median(size))
    error = 1.25 * float(np.std(size)) / np.sqrt(len(size))
    far = np.abs(np.diff(counted_on(value, period))).max() > FASTEST * period
    if far or float(np.mean(np.abs(size / period - 1) < EVEN)) < CLEAN:
        return None
    return _Rollover(period=period, error=error, count=len(jumps), first=int(jumps[0]) + 1)
