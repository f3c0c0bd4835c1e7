"""Inverse dynamics: the efforts that the recorded motion needs, beside those that were measured or commanded."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.comparison.compare import why_unfit
from rille.diagnosis.starts.kinematic_smoother import LocalMotion, Series, smooth
from rille.diagnosis.starts.noise_floor import noise_of
from rille.diagnosis.starts.start_states import series_of
from rille.diagnosis.starts.state_coordinates import N_ROOT, Coordinate, coordinates_of
from rille.diagnosis.starts.steady_turns import with_steady_turns
from rille.model import InputRefused
from rille.model.comparison import ComparedChannel, CompareWindow, Comparison, Regimes
from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
WIDEST = 0.25  # [s] of the smoother to either side
MOST_SPANS = 20_000  # of one comparison
TRIED = 40  # instants at which widths and inertias are looked at


def compare_inverse(
    simulator: Any, recording: Recording, *, window: float = 0.5, on_progress: Callable[[int, int, str], None] | None = None
) -> Comparison:
    """Efforts that the smoothed motion needs in the model, against the recorded ones; both are means over short spans.

    For mechanisms that the world holds and whose joints are all recorded. Over a span T from the smoothed state on, the model with the
    recorded commands reaches v_s, the recording v: M (v - v_s) / T is what its drives lack, and with what they gave it is what the motion
    needs. Better than M a of a smoothed acceleration: commands that jump and dry friction that turns do not blur it. Beside it stand the
    measured efforts, or the commanded ones of joints whose effort was not measured. Spans do not share samples, so their errors are
    independent. The noise is that of both means: its median over the spans.

    Parameters
    ----------
    window : [s] length of the stretches into which the comparison is divided.

    Raises
    ------
    InputRefused : for a machine with a free root, a joint that is not recorded, or no recorded effort.
    """
    simulator.drive_by(recording)
    if simulator.root:
        raise InputRefused(
            f"inverse dynamics needs a mechanism that the world holds, but '{simulator.root}' is free; compare forward, in windows, instead"
        )
    fit = [c for c in with_steady_turns(recording.with_role("observed")) if not why_unfit(c, recording)]
    coordinates = coordinates_of("", simulator.joints, simulator.ratios)
    series = {c.name: series_of(c, [(channel, noise_of(channel)[0]) for channel in fit], "", simulator.joints) for c in coordinates}
    missing = [name for name, found in series.items() if not any(s.order == 0 for s in found)]
    if missing:
        raise InputRefused(
            f"inverse dynamics needs the position of every joint; recording '{recording.name}' lacks that of {', '.join(missing)}; "
            "compare forward, in windows, instead"
        )
    efforts = _efforts(simulator, recording, fit)
    instants, span = _spans(list(series.values()), simulator.step)
    motions: list[tuple[LocalMotion, LocalMotion]] = []
    for k, coordinate in enumerate(coordinates):
        ends = [smooth(instants + shift, series[coordinate.name], widest=WIDEST) for shift in (0.0, span)]
        motions.append((ends[0], ends[1]))
        if on_progress:
            on_progress(k + 1, len(coordinates) + 1, "smoothing")
    good = np.all([end.seen for pair in motions for end in pair], axis=0)
    instants, motions = instants[good], [(_chosen(a, good), _chosen(b, good)) for a, b in motions]
    if len(instants) < 2:
        raise InputRefused(
            f"recording '{recording.name}' is too short or too sparse for inverse dynamics; compare forward, in windows, instead"
        )
    states = _states(len(simulator.joints), coordinates, [a for a, _ in motions], instants)
    after = _states(len(simulator.joints), coordinates, [b for _, b in motions], instants)[:, N_ROOT + len(simulator.joints) :]
    applied, lacking = simulator.missing_efforts(states, span, after)
    variance = np.stack([before.covariance[:, 1, 1] + behind.covariance[:, 1, 1] for before, behind in motions], axis=1)
    inertia = _inertias(simulator, coordinates, states, span, after)
    if on_progress:
        on_progress(len(coordinates) + 1, len(coordinates) + 1, "inverse dynamics")
    number = np.unique(np.floor((instants - instants[0]) / window + 1e-9), return_inverse=True)[1].astype(np.int64)
    channels, needed_of = [], {}
    for joint, channel in efforts.items():
        place = simulator.joints.index(joint)
        k = next(k for k, c in enumerate(coordinates) if place in c.factors)
        factors = coordinates[k].factors
        needed = applied[:, place] + sum(f * lacking[:, p] for p, f in factors.items()) / factors[place]
        needed_of[joint] = needed
        uncertain = np.sqrt(variance @ inertia[k] ** 2) / span / abs(factors[place])
        channels.append(_compared(channel, instants, span, number, needed, uncertain))
    return Comparison(
        recording=recording.name,
        model=str(simulator.path),
        scenario=simulator.scenario,
        mode="inverse_dynamics",
        channels=tuple(channels),
        windows=tuple(
            CompareWindow(number=w, start=float(instants[number == w][0]), stop=float(instants[number == w][-1]))
            for w in range(int(number[-1]) + 1)
        ),
        regimes=_regimes(simulator.joints, instants, number, states, needed_of),
        notes=("inverse dynamics: simulated is the effort that the recorded motion needs in the model, measured the recorded effort",),
    )


def _efforts(simulator: Any, recording: Recording, fit: Sequence[Channel]) -> dict[str, Channel]:
    """Joint -> its recorded effort: measured, or else commanded (with the delay taken in)."""
    found = {c.target: c for c in fit if c.quantity == "joint.effort"}
    joint_of = {name: joint for drive, joint, _ in simulator.drives for name in (drive, joint)}
    for c in recording.with_role("command"):
        if c.quantity == "joint.effort":
            found.setdefault(joint_of[c.target], replace(c, time=c.time + c.delay, delay=0.0))
    found = {joint: channel for joint, channel in found.items() if joint in simulator.joints}
    if not found:
        raise InputRefused(
            f"recording '{recording.name}' holds no effort of a joint, neither observed nor commanded; inverse dynamics needs one "
            "to compare with"
        )
    return found


def _spans(series: Sequence[Sequence[Series]], step: float) -> tuple[Array, float]:
    """Starts [s] of spans and their length [s]: four median half-widths of the fits, two apart."""
    first = max(min(s.time[0] for s in group) for group in series)
    last = min(max(s.time[-1] for s in group) for group in series)
    tried = np.linspace(first, last, TRIED + 2)[1:-1]
    width = float(np.median(np.concatenate([m.width[m.seen] for m in (smooth(tried, group, widest=WIDEST) for group in series)])))
    span = max(4, round(4 * width / step)) * step
    starts = np.arange(first + width, last - span - width, max(span + 2 * width, (last - first) / MOST_SPANS))
    return np.round(starts / step) * step, span


def _chosen(motion: LocalMotion, good: NDArray[np.bool_]) -> LocalMotion:
    return LocalMotion(
        value=motion.value[good], covariance=motion.covariance[good], width=motion.width[good], seen=motion.seen[good], placed=motion.placed
    )


def _states(n_joints: int, coordinates: Sequence[Coordinate], motions: Sequence[LocalMotion], instants: Array) -> Array:
    """States (m, n) of a mechanism that the world holds."""
    states = np.zeros((len(instants), N_ROOT + 2 * n_joints))
    states[:, 0], states[:, 4] = instants, 1.0
    for coordinate, motion in zip(coordinates, motions, strict=True):
        for place, factor in coordinate.factors.items():
            states[:, N_ROOT + place] = factor * motion.value[:, 0]
            states[:, N_ROOT + n_joints + place] = factor * motion.value[:, 1]
    return states


def _inertias(simulator: Any, coordinates: Sequence[Coordinate], states: Array, span: float, after: Array) -> Array:
    """(n, n): effort along one coordinate per acceleration of another, root mean square over some spans: by a little more speed at their
    ends.
    """
    some = np.unique(np.linspace(0, len(states) - 1, TRIED).round().astype(np.int64))
    before = simulator.missing_efforts(states[some], span, after[some])[1]
    found = np.zeros((len(coordinates), len(coordinates)))
    for column, coordinate in enumerate(coordinates):
        more = after[some].copy()
        for place, factor in coordinate.factors.items():
            more[:, place] += factor * span
        gained = simulator.missing_efforts(states[some], span, more)[1] - before
        for row, other in enumerate(coordinates):
            along = sum((f * gained[:, place] for place, f in other.factors.items()), np.zeros(len(some)))
            found[row, column] = np.sqrt(np.nanmean(along**2))
    return found


def _compared(
    channel: Channel, instants: Array, span: float, number: NDArray[np.int64], needed: Array, uncertain: Array
) -> ComparedChannel:
    """One effort: its recorded means over the spans, beside what the motion needs; their time is the middle of the span."""
    seen = np.isfinite(channel.value)
    time, value = channel.time[seen] - channel.delay, channel.value[seen]
    firsts, lasts = np.searchsorted(time, instants), np.searchsorted(time, instants + span)
    count = lasts - firsts
    measured = _held_mean(time, value, instants, span)
    noise, source = (0.0, "stated") if channel.role == "command" else noise_of(channel)
    sigma = np.sqrt(noise**2 / np.maximum(count, 1) + uncertain**2)
    whole = np.isfinite(needed)
    return ComparedChannel(
        channel=replace(channel, time=np.empty(0), value=np.empty(0)),
        time=instants[whole] + 0.5 * span + channel.delay,
        measured=measured[whole],
        simulated=needed[whole],
        window=number[whole],
        noise=float(np.median(sigma[whole])),
        noise_from=source,
        start_gain=np.zeros(int(whole.sum())),
    )


def _held_mean(time: Array, value: Array, starts: Array, span: float) -> Array:
    """Means over spans of a value that holds until the next sample."""
    area = np.r_[0.0, np.cumsum(value[:-1] * np.diff(time))]

    def integral(at: Array) -> Array:
        place = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 1)
        return area[place] + value[place] * (at - time[place])

    return (integral(starts + span) - integral(starts)) / span


def _regimes(joints: Sequence[str], instants: Array, number: NDArray[np.int64], states: Array, needed: Mapping[str, Array]) -> Regimes:
    speeds = {f"joint_speed/{joint}": states[:, N_ROOT + len(joints) + k] for k, joint in enumerate(joints)}
    return Regimes(time=instants, window=number, values=speeds | {f"effort/{joint}": value for joint, value in needed.items()})
