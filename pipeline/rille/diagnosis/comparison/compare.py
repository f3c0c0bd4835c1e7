"""A recording beside the model: in windows from fitted start states, or as one run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.comparison.pooled import root_mean_square
from rille.diagnosis.starts.noise_floor import noise_of, quantisation
from rille.diagnosis.starts.start_fit import Samples, StartFit, fit_starts_doubting, residuals
from rille.diagnosis.starts.start_states import Starts, start_states
from rille.diagnosis.starts.steady_turns import with_steady_turns
from rille.diagnosis.starts.step_error import finest, step_error, timing
from rille.diagnosis.starts.windows import Cut, cut, picked
from rille.model import InputRefused
from rille.model.comparison import ComparedChannel, CompareWindow, Comparison, Regimes
from rille.model.recording import MOTION_QUANTITIES, Channel, Recording
from rille.model.scatter import difference_noise

Array = NDArray[np.float64]
Noise = Mapping[str, tuple[float, str]]
Progress = Callable[[int, int, str], None] | None
RUN_UP = 0.2  # [s] on ground: what a start state's error of height and tilt does to wheel loads has died out by then
EXPLAINED = 2.0  # [noise]
OF_NO_USE = {"bad_channel": "the data gate calls it a bad channel", "stuck": "the data gate found it stuck"}


def compare_windows(
    simulator: Any,
    recording: Recording,
    *,
    window: float = 0.5,
    noise: Noise | None = None,
    rough: float | None = None,
    far: float = 1.0,
    on_progress: Progress = None,
) -> Comparison:
    """Replays a recording in windows, each from its own start state.

    Nodes every ``window`` [s]; start states smoothed from the recording without the model (``start_states``) and fitted to the window
    within their uncertainty (``fit_starts``); what is left is measured - simulated. Errors do not pile up, and the blame lands in its
    window. Efforts and accelerations take part in the fit where the model explains them: what no channel shows directly (slip, the rate
    of a suspension) shakes them at the start of a window, and only they can tell it. What the simulation's step does is taken off
    (``step_error``).

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``; it takes the recording's commands. noise : of channels by name, as of ``shared_noise`` over
        recordings of the same sensors; None: from this recording. rough : step [s] that is good enough for derivatives, a multiple of the
        simulator's; None: its own. far : as of ``fit_starts``: with 0 what is not fitted near the smoothed starts counts as misfit at once.

    Raises
    ------
    InputRefused : for commands that do not fit the drives, targets that the model lacks, no channel that shows the state, a bad window.
    """
    return _compare(simulator, recording, window, noise, on_progress, rough, far)


def compare_whole(simulator: Any, recording: Recording, *, noise: Noise | None = None, on_progress: Progress = None) -> Comparison:
    """Replays a recording as one run from one fitted start state: errors add up, as they do in a prediction. Raises as
    ``compare_windows``.
    """
    return _compare(simulator, recording, None, noise, on_progress)


def _refuse_without_noise(recording: Recording, names: Sequence[str]) -> None:
    """Refuse a recording whose channels of motion are all left out because nobody knows their noise."""
    if names:
        raise InputRefused(
            f"the noise of {', '.join(repr(name) for name in names[:4])} of recording '{recording.name}' is not known: they show none, or "
            "have too few samples to show any; state it in the manifest (noise = ...)"
        )


def _compare(
    simulator: Any,
    recording: Recording,
    window: float | None,
    known: Noise | None,
    on_progress: Progress,
    rough: float | None = None,
    far: float = 1.0,
) -> Comparison:
    simulator.drive_by(recording)
    observed = with_steady_turns(recording.with_role("observed"))
    unfit = {channel.name: why_unfit(channel, recording) for channel in observed}
    noise = {c.name: known[c.name] if known and c.name in known else noise_of(c) for c in observed}
    shows = [c for c in observed if not unfit[c.name] and c.quantity in MOTION_QUANTITIES and noise[c.name][0] > 0]
    if not shows:
        _refuse_without_noise(recording, [c.name for c in observed if c.quantity in MOTION_QUANTITIES and not noise[c.name][0] > 0])
    parts = cut(recording, shows, window, rough or simulator.step, RUN_UP if simulator.has_ground else 0.0)
    starts = start_states(simulator, [(c, noise[c.name][0]) for c in shows], parts.begins, widest=window or 1.0, on_progress=on_progress)
    samples = [samples_of(c, max(noise[c.name][0], 1e-300), parts) for c in observed]
    fitted = with_a_say(simulator, [c for c in observed if not unfit[c.name] and noise[c.name][0] > 0], noise, starts, parts)
    names = [c.name for c in fitted]
    heard = [s for s in samples if s.channel.name in names]
    short = window is not None  # errors of a whole run are not those of its steps
    larger = simulator.changed(step=rough) if rough else None

    def fitted_to(some: Sequence[Samples]) -> StartFit:
        def error(states: Array) -> tuple[Array, ...]:
            return step_error(simulator, states, parts.stops, some)[0]

        return fit_starts_doubting(simulator, starts, parts.stops, some, on_progress, error=error if short else None, rough=larger, far=far)

    fit = fitted_to(heard)
    off: Sequence[Array] = [np.zeros(len(s.time)) for s in samples]
    left_out = 0
    if short:
        off, jumps = step_error(simulator, fit.states, parts.stops, samples)
        left_out = sum(int(jump.sum()) for jump in jumps)
        if left_out:
            samples = [s.where(~jump) for s, jump in zip(samples, jumps, strict=True)]
            fit = fitted_to([s for s in samples if s.channel.name in names])
            off = step_error(simulator, fit.states, parts.stops, samples)[0]
    channels, unreached = _compared(simulator, observed, fitted, samples, off, unfit, noise, fit, parts.stops)
    if short:
        moved = timing(simulator.predict, 0.5 * finest(simulator), fit.states, parts.stops, samples)
        channels = tuple(replace(c, instants=root_mean_square(m * s.noise)) for c, s, m in zip(channels, samples, moved, strict=True))
    return Comparison(
        recording=recording.name,
        model=str(simulator.path),
        scenario=simulator.scenario,
        mode="windows" if window is not None else "whole",
        channels=channels,
        windows=_windows(simulator, fit, parts, unreached),
        regimes=within(simulator.regimes(fit.states, parts.stops), parts.starts),
        notes=_notes(starts, fit, left_out),
    )


def with_a_say(simulator: Any, channels: Sequence[Channel], noise: Noise, starts: Starts, parts: Cut) -> list[Channel]:
    """Channels that take part in the fit of starts: all that show the state, and of the others (efforts, loads, accelerations) those that
    the model nearly explains from the smoothed starts: in most windows within ``EXPLAINED`` times their noise. What it does not explain
    must not move starts, nor what else is seen there.
    """
    others = [c for c in channels if c.quantity not in MOTION_QUANTITIES]
    samples = [samples_of(c, noise[c.name][0], parts) for c in others]
    answers = simulator.predict(starts.states[None], parts.stops, others, [(s.window, s.time) for s in samples]) if others else []
    explained = set()
    for s, answer in zip(samples, answers, strict=True):
        left = np.abs(residuals(s, answer[0]) / s.noise)
        count = np.bincount(s.window, np.isfinite(left))
        size = np.sqrt(np.bincount(s.window, np.nan_to_num(left) ** 2)[count > 0] / count[count > 0])
        if len(size) and np.median(size) < EXPLAINED:
            explained.add(s.channel.name)
    return [c for c in channels if c.quantity in MOTION_QUANTITIES or c.name in explained]


def why_unfit(channel: Channel, recording: Recording) -> str:
    """Why a channel takes no part in fits; '' if it does."""
    for code, why in OF_NO_USE.items():
        if channel.name in recording.flagged(code):
            return why
    return "" if np.isfinite(channel.value).sum() >= 8 else "it has fewer than 8 samples"


def within(regimes: Regimes, starts: Array) -> Regimes:
    """Without the run-up: from ``starts`` (n_windows,) [s] on."""
    here = regimes.time > starts[regimes.window] - 1e-9
    return Regimes(
        time=regimes.time[here], window=regimes.window[here], values={name: value[here] for name, value in regimes.values.items()}
    )


def samples_of(channel: Channel, noise: float, parts: Cut) -> Samples:
    """Samples of a channel that lie in windows."""
    places, window = picked(channel, parts.starts, parts.stops)
    bare = replace(channel, time=np.empty(0), value=np.empty(0))
    return Samples(channel=bare, window=window, time=channel.time[places] - channel.delay, value=channel.value[places], noise=noise)


def _compared(
    simulator: Any,
    observed: Sequence[Channel],
    shows: Sequence[Channel],
    samples: Sequence[Samples],
    error: Sequence[Array],
    unfit: dict[str, str],
    noise: dict[str, tuple[float, str]],
    fit: StartFit,
    stops: Array,
) -> tuple[tuple[ComparedChannel, ...], list[int]]:
    """Every observed channel beside what the fitted starts give for it, and the windows whose run ended before their last sample."""
    predicted = simulator.predict(fit.states[None], stops, [s.channel for s in samples], [(s.window, s.time) for s in samples])
    gains = {channel.name: gain for channel, gain in zip(shows, fit.gain, strict=True)}
    found, unreached = [], set()
    for channel, s, answer, e in zip(observed, samples, predicted, error, strict=True):
        simulated = s.value - residuals(s, answer[0] - e)  # of quaternions the sign, of angles the turn that is meant
        reached = np.isfinite(simulated)
        unreached |= set(s.window[~reached].tolist())
        sigma, source = _floor(channel, s, simulated, *noise[channel.name])
        gain = gains.get(channel.name, np.zeros(len(s.time))) * (sigma / s.noise)  # what the fit took is a share of the noise that it knew
        found.append(
            ComparedChannel(
                channel=s.channel,
                time=s.time[reached] + channel.delay,
                measured=s.value[reached],
                simulated=simulated[reached],
                window=s.window[reached],
                noise=sigma,
                noise_from=source,
                left_out=unfit[channel.name] or ("" if sigma > 0 else "it never changes, so that nothing tells its noise; state it"),
                start_gain=gain[reached],
            )
        )
    return tuple(found), sorted(unreached)


def _floor(channel: Channel, samples: Samples, simulated: Array, sigma: float, source: str) -> tuple[float, str]:
    """Noise by which residuals are normalised: of unstated channels that of the innovations, where it is less.

    Differences of the residuals show the noise better than those of the values, where the simulation takes the motion away.
    """
    if source == "stated":
        return sigma, source
    order = np.argsort(samples.time, kind="stable")
    innovations = difference_noise(samples.time[order], (samples.value - simulated)[order])
    if 0 < innovations < sigma and innovations > quantisation(channel):
        return innovations, "innovations"
    return sigma, source


def _windows(simulator: Any, fit: StartFit, parts: Cut, unreached: Sequence[int]) -> tuple[CompareWindow, ...]:
    ended = {window: simulator.why_ended(fit.states[window], float(parts.stops[window])) for window in unreached}
    return tuple(
        CompareWindow(number=k, start=float(start), stop=float(stop), shift=float(fit.shift[k]), ended=ended.get(k, ""))
        for k, (start, stop) in enumerate(zip(parts.starts, parts.stops, strict=True))
    )


def _notes(starts: Starts, fit: StartFit, left_out: int) -> tuple[str, ...]:
    unseen = [c.name for c, seen in zip(starts.coordinates, np.atleast_1d(starts.seen.any(axis=0)).tolist(), strict=True) if not seen]
    notes = []
    if unseen:
        notes.append(f"not recorded, carried on by the simulation from window to window: {', '.join(unseen)}")
    if len(fit.unfit):
        few = ", ".join(str(window) for window in fit.unfit[:8].tolist()) + (" ..." if len(fit.unfit) > 8 else "")
        notes.append(
            f"{len(fit.unfit)} of {len(fit.states)} windows are fitted by no start near the recorded state, and start from it: {few}"
        )
    if left_out:
        notes.append(f"{left_out} samples are left out: what is simulated jumps there, sooner or later as the step is small or large")
    return tuple(notes)
