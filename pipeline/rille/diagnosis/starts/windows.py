"""Stretches of a recording that are replayed on their own, and which sample belongs to which."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.recording import MOTION_QUANTITIES, Channel, Recording

Array = NDArray[np.float64]
ROUNDED = 1e-6  # [s] of stamps
POLE = 1.2  # [rad] pitch beyond which errors of roll and yaw grow threefold
GAP = 0.25  # of a window: a longer stretch without any sample of the state ends the window before it
FIRST, LATE = 1.0, 0.25  # of a window (of a second, if it is one over everything), that is waited for a channel to begin, or to go on


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Windows. begin : (n,) [s] where the simulation begins, starts, stops : (n,) [s] what is compared; whole multiples of the step."""

    begins: Array
    starts: Array
    stops: Array


def cut(recording: Recording, channels: Sequence[Channel], window: float | None, step: float, run_up: float = 0.0) -> Cut:
    """Windows of about that length [s], one behind the other; None: one over everything.

    The first one begins where all channels have begun that do so within ``FIRST`` of a window: before, nothing shows what they show.
    Behind a gap, which the simulation bridges, less is waited for those that had begun: ``LATE``. A window that a gap would cut ends where
    the gap begins, and the next starts behind it. ``run_up`` [s]: the simulation begins so much earlier, so that wheels and contacts have
    found their loads where the comparison starts; where nothing was recorded before (at the beginning, behind a gap), it starts so much
    later instead. Windows of a body that points straight up or down, as angles tell it, are left out.

    Raises
    ------
    InputRefused : if nothing that shows the state was recorded, or the window is shorter than four steps.
    """
    times = [np.sort(c.time[np.isfinite(c.value)] - c.delay) for c in channels if c.quantity in MOTION_QUANTITIES]
    all_times = np.unique(np.concatenate(times)) if times else np.empty(0)
    if len(all_times) < 8:
        raise InputRefused(
            f"recording '{recording.name}' has {len(all_times)} samples that show a state ({', '.join(MOTION_QUANTITIES[:3])} ...), "
            "too few to start a replay from; give such a channel the role observed"
        )
    if window is not None and not window >= 4 * step:
        raise InputRefused(f"the window is {window:g} s; it must be at least four steps of {step:g} s")
    firsts, lasts = all_times[:1], all_times[-1:]
    if window is not None:
        longest_gap = max(GAP * window, 3 * float(np.median(np.diff(all_times))))
        edges = np.flatnonzero(np.diff(all_times) > longest_gap)
        firsts, lasts = np.r_[firsts, all_times[edges + 1]], np.r_[all_times[edges], lasts]
    run_up = _up(min(run_up, 0.5 * window if window is not None else np.inf), step)
    begins, starts, stops = [], [], []
    for first, last in zip(firsts, lasts, strict=True):
        nexts = [(float(t[k]), LATE if k else FIRST) for t in times if (k := np.searchsorted(t, first)) < len(t)]
        begin = _up(max(t for t, patience in nexts if t <= first + patience * (window or 1.0)), step)
        length = last - begin - run_up
        if length < max(4 * step, 1e-9):
            continue
        count = 1 if window is None else max(1, round(length / window))  # a rest shorter than half a window joins the last one
        edge = np.round((begin + run_up + (window or length) * np.arange(count + 1)) / step) * step
        edge[-1] = _up(last, step)
        begins.append(edge[:-1] - run_up)
        starts.append(edge[:-1])
        stops.append(edge[1:])
    if not begins:
        longest = float(np.max(lasts - firsts))
        raise InputRefused(
            f"recording '{recording.name}' has no stretch without gaps that is longer than {run_up + 4 * step:g} s (the longest lasts "
            f"{longest:.3g} s): record longer, or take a smaller step"
        )
    made = Cut(begins=np.concatenate(begins), starts=np.concatenate(starts), stops=np.concatenate(stops))
    return made if window is None else _off_the_pole(made, channels)


def _off_the_pole(made: Cut, channels: Sequence[Channel]) -> Cut:
    """Windows in which recorded roll, pitch and yaw stay away from where roll and yaw turn about one axis; all, if none does."""
    kept = np.ones(len(made.starts), dtype=bool)
    for channel in channels:
        if channel.component == "pitch":
            near = np.sort((channel.time - channel.delay)[np.abs(channel.value) > POLE])
            kept &= np.searchsorted(near, made.begins) == np.searchsorted(near, made.stops)
    return Cut(begins=made.begins[kept], starts=made.starts[kept], stops=made.stops[kept]) if kept.any() else made


def _up(time: float, step: float) -> float:
    """The next multiple of the step."""
    return float(np.ceil(time / step - 1e-6) * step)


def picked(channel: Channel, starts: Array, stops: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Samples of a channel that lie in a window: their places (m,) and windows (m,), both ascending.

    A sample belongs to the window in which the instant that it speaks of (its time less the delay) lies. Forces and accelerations are means
    over the step that ends there: at the very start of a window they belong to the window before.
    """
    instant = channel.time - channel.delay
    state = channel.quantity in MOTION_QUANTITIES
    window = (np.searchsorted(starts, instant, side="right") if state else np.searchsorted(starts, instant - ROUNDED, side="left")) - 1
    inside = (window >= 0) & np.isfinite(channel.value)
    inside &= instant <= stops[np.maximum(window, 0)] + (1e-9 if state else ROUNDED)
    places = np.flatnonzero(inside)
    order = np.argsort(window[places], kind="stable")
    return places[order], window[places][order]
