"""What is fitted, and what is kept aside to judge the fit by."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rille.model import InputRefused
from rille.model.recording import MOTION_QUANTITIES, Channel, Recording

SHARE = 0.3  # of recordings, or of the time of a single one
SHORTEST = 4  # windows that a part in time must have


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """training, held_out : recordings. how : what was held out, in words."""

    training: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    how: str

    def later(self, by: float) -> "Parts":
        """Without the first ``by`` [s] of each recording over time."""
        both = (tuple(cut_in_time(r, extent(r)[0] + by, np.inf) for r in part) for part in (self.training, self.held_out))
        training, held_out = both
        return replace(self, training=training, held_out=held_out)


def held_out_parts(recordings: Sequence[Recording], named: Sequence[Recording], window: float) -> Parts:
    """Recordings that are named are held out; of several others the last ``SHARE``; of a single one the end of it.

    Raises
    ------
    InputRefused : if a recording is both.
    """
    both = {r.name for r in recordings} & {r.name for r in named}
    if both:
        raise InputRefused(f"recording '{min(both)}' cannot be diagnosed and held out at once; name it once")
    if named:
        return Parts(training=tuple(recordings), held_out=tuple(named), how=_listed(named))
    if len(recordings) > 1:
        count = max(1, round(SHARE * len(recordings)))
        # Spread over the list: what a campaign did last is not all that it did.
        places = set(np.linspace(len(recordings) - 1, 0, count, endpoint=count > 1).round().astype(int).tolist())
        held = [r for k, r in enumerate(recordings) if k in places]
        return Parts(training=tuple(r for k, r in enumerate(recordings) if k not in places), held_out=tuple(held), how=_listed(held))
    (recording,) = recordings
    if recording.kind == "points":
        return Parts(training=(recording,), held_out=(), how="")
    first, last = extent(recording)
    at = last - SHARE * (last - first)
    if last - at < SHORTEST * window:
        return Parts(training=(recording,), held_out=(), how="")
    return Parts(
        training=(cut_in_time(recording, -np.inf, at),),
        held_out=(cut_in_time(recording, at, np.inf),),
        how=f"the last {100 * SHARE:.0f} % of '{recording.name}', from {at:.4g} s on",
    )


def cut_in_time(recording: Recording, start: float, stop: float) -> Recording:
    """Samples of observed channels in [start, stop) [s]; commands before it stay, for the last of them still acts."""

    def part(channel: Channel) -> Channel:
        inside = (channel.time < stop) & ((channel.time >= start) | (channel.role == "command"))
        return replace(channel, time=channel.time[inside], value=channel.value[inside])

    return replace(recording, channels=tuple(part(channel) for channel in recording.channels))


def extent(recording: Recording) -> tuple[float, float]:
    """First and last instant [s] that shows a state."""
    times = [c.time for c in recording.with_role("observed") if c.quantity in MOTION_QUANTITIES and len(c.time)]
    return (min(float(t[0]) for t in times), max(float(t[-1]) for t in times)) if times else (0.0, 0.0)


def _listed(recordings: Sequence[Recording]) -> str:
    names = [f"'{r.name}'" for r in recordings]
    return ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:3])} and {len(names) - 3} more recordings"
