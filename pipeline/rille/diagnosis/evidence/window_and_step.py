"""The windows and the step that a diagnosis simulates with: as long, and as large, as the recording allows."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rille.diagnosis.evidence.applied import Simulators, of_scenario
from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.evidence_part import Part, gather_part
from rille.diagnosis.evidence.held_out import extent
from rille.diagnosis.evidence.window_length import LENGTHS, window_length
from rille.diagnosis.starts.start_fit import between
from rille.diagnosis.starts.step_error import finest
from rille.model import InputRefused
from rille.model.recording import Recording

MULTIPLES = (8, 6, 4, 3, 2)  # of the scenario's step that are tried, largest first
GRID = 24  # steps of which the windows that are tried begin and end at whole multiples: of all those steps too
WINDOWS, SECONDS = (3, 8), 12.0  # that are tried, and how long [s] together
SMALL = 0.3  # [sigma] root mean square of a channel that a larger step may change in three of four windows: most of it is taken off
ROUGHLY = 1.0  # the same for twice the step, where changes alone matter
QUARTER = 0.75
RESOLVED = 0.5  # of the shortest sampling interval: ripples that samples can show are faster than longer steps


def window_and_step(
    simulator: Any,
    recording: Recording,
    *,
    noise: Mapping[str, tuple[float, str]],
    duration: float,
    window: float | None = None,
    longest: float = LENGTHS[0],
) -> tuple[float, float, float | None]:
    """Length of windows, as of ``window_length`` if it is not given, the step of all replays, and that of derivatives and first looks [s].

    The step is the largest multiple of the simulator's own with which a few windows of the recording come out as with its own: what it
    changes in a channel, as far as another start, or half a step of time, would not do the same, stays below ``SMALL``. The simulator's
    own step where none does, or windows are too short to tell. Twice that is good enough where only changes matter, if it does not change
    more than ``ROUGHLY`` itself; None otherwise.

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``; it stays as it is. noise : of channels by name, as of ``shared_noise``. duration : [s] of
        all recordings together. longest : windows [s] that are tried.

    Raises
    ------
    InputRefused : as ``compare_windows``.
    """
    interval = min((float(np.median(np.diff(c.time))) for c in recording.with_role("observed") if len(c.time) > 2), default=0.0)
    multiples = [multiple for multiple in MULTIPLES if multiple * simulator.step <= RESOLVED * interval]
    rough = simulator.changed(step=multiples[-1] * simulator.step) if multiples else simulator  # good enough for the starts
    grid, part = GRID * simulator.step, None
    if window is None:
        window, part = window_length(rough, recording, duration=duration, noise=noise, grid=grid if multiples else None, longest=longest)
    if not multiples or window < 4 * grid:
        return window, simulator.step, None
    if part is None:
        most = int(np.clip(SECONDS / window, *WINDOWS))
        part = gather_part(rough, recording, window=window, noise=noise, grid=grid, most=most, corrected=False)
    multiple, doubled = _largest(simulator, part, multiples)
    return window, multiple * simulator.step, 2 * multiple * simulator.step if doubled else None


def window_and_step_of_all(
    simulators: Simulators, recordings: Sequence[Recording], *, noise: Mapping[str, tuple[float, str]], window: float | None = None
) -> tuple[float, float, float | None]:
    """Length of windows and steps as all recordings allow: what one that moves faster shows of long ones is no physics.

    simulators : as of ``gather``. Others as of ``window_and_step``.
    """
    duration = sum(last - first for first, last in map(extent, recordings))
    models = [of_scenario(simulators, recording.scenario) for recording in recordings]
    like: dict[str, Any] = {"noise": noise, "duration": duration}
    found: list[tuple[float, float, float | None]] = []
    for model, recording in zip(models, recordings, strict=True):
        longest = found[-1][0] if found else LENGTHS[0]
        found.append(window_and_step(model, recording, window=window, longest=longest, **like))
    shortest = found[-1][0]
    for k, (length, _, _) in enumerate(found):
        if length > shortest:
            found[k] = window_and_step(models[k], recordings[k], window=shortest, **like)
    step = min(step for _, step, _ in found)
    rough = min(rough or 0.0 for _, _, rough in found)
    return shortest, step, rough if rough > step else None


def _largest(simulator: Any, part: Part, multiples: Sequence[int]) -> tuple[int, bool]:
    """Largest multiple of the step for the windows of a part, which begin and end at whole multiples of all, and whether twice that will
    do for changes.
    """
    bare, picks = [s.channel for s in part.samples], [(s.window, s.time) for s in part.samples]
    fine = part.simulator.changed(step=simulator.step)
    own = [a[0] for a in fine.predict(part.states[None], part.last, bare, picks)]
    number = part.ordered([np.full(len(s.time), k) for k, s in enumerate(part.samples)])
    place = number * len(part.first) + part.window
    there = np.isfinite(part.ordered(own))

    def worst(multiple: int) -> float:
        """Root mean square [sigma] of what that step changes in a channel, in three of four windows; the largest of all."""
        try:
            model = part.simulator.changed(step=multiple * simulator.step)
        except InputRefused:  # longer than a solver may step
            return np.inf
        answers = [a[0] for a in model.predict(part.states[None], part.last, bare, picks)]
        change = part.ordered([between(s, a, b) / s.noise for s, a, b in zip(part.samples, answers, own, strict=True)])
        if not np.isfinite(change[there]).all():
            return np.inf
        coarse = replace(part, timing=tuple(multiple * simulator.step / finest(simulator) * timing for timing in part.timing))
        metric = Metric(part.window, coarse.start_gain)
        power = metric.whitened(np.where(there, change, 0.0)[None])[0] ** 2
        size = len(part.first) * len(part.samples)
        means = np.bincount(place, power, size) / np.maximum(np.bincount(place, minlength=size), 1)
        return float(np.quantile(np.sqrt(means).reshape(len(part.samples), -1), QUARTER, axis=1).max())

    chosen = next((multiple for multiple in multiples if worst(multiple) < SMALL), 1)
    return chosen, GRID % (2 * chosen) == 0 and worst(2 * chosen) < ROUGHLY
