"""The step that a diagnosis simulates with: as large as the recording's noise allows."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.evidence_part import gather_part
from rille.diagnosis.starts.start_fit import between
from rille.diagnosis.starts.step_error import finest
from rille.model.recording import Recording

MULTIPLES = (8, 6, 4, 3, 2)  # of the scenario's step that are tried, largest first
GRID = 24  # steps of which the windows that are tried begin and end at whole multiples: of all those steps too
WINDOWS, SECONDS = (3, 8), 12.0  # that are tried, and how long [s] together
SMALL = 0.3  # [sigma] root mean square of a channel that a larger step may change in three of four windows: most of it is taken off
QUARTER = 0.75
RESOLVED = 0.5  # of the shortest sampling interval: ripples that samples can show are faster than longer steps


def diagnosis_step(simulator: Any, recording: Recording, *, window: float, noise: Mapping[str, tuple[float, str]]) -> float:
    """Largest multiple of the simulator's step [s] with which a few windows of the recording come out as with its own.

    What the steps change in a channel, as far as another start, or half a step of time, would not do the same, must stay below ``SMALL``.
    The simulator's own step where none does, or windows are too short to tell.

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``; it stays as it is. window : [s]. noise : of channels by name, as of ``shared_noise``.

    Raises
    ------
    InputRefused : as ``compare_windows``.
    """
    if window < 4 * GRID * simulator.step:
        return simulator.step
    twice = simulator.changed(step=2 * simulator.step)  # good enough for the starts
    most = int(np.clip(SECONDS / window, *WINDOWS))
    part = gather_part(twice, recording, window=window, noise=noise, grid=GRID * simulator.step, most=most, corrected=False)
    bare, picks = [s.channel for s in part.samples], [(s.window, s.time) for s in part.samples]
    fine = part.simulator.changed(step=simulator.step)
    own = [a[0] for a in fine.predict(part.states[None], part.last, bare, picks)]
    number = part.ordered([np.full(len(s.time), k) for k, s in enumerate(part.samples)])
    place = number * len(part.first) + part.window
    interval = min(float(np.median(np.diff(c.time))) for c in recording.with_role("observed") if len(c.time) > 2)
    for multiple in MULTIPLES:
        if multiple * simulator.step > RESOLVED * interval:
            continue
        model = part.simulator.changed(step=multiple * simulator.step)
        answers = [a[0] for a in model.predict(part.states[None], part.last, bare, picks)]
        change = part.ordered([between(s, a, b) / s.noise for s, a, b in zip(part.samples, answers, own, strict=True)])
        there = np.isfinite(part.ordered(own))
        if not np.isfinite(change[there]).all():
            continue
        coarse = replace(part, timing=tuple(multiple * simulator.step / finest(simulator) * timing for timing in part.timing))
        metric = Metric(part.window, coarse.start_gain)
        power = metric.whitened(np.where(there, change, 0.0)[None])[0] ** 2
        size = len(part.first) * len(part.samples)
        means = np.bincount(place, power, size) / np.maximum(np.bincount(place, minlength=size), 1)
        worst = np.quantile(np.sqrt(means).reshape(len(part.samples), -1), QUARTER, axis=1).max()
        if worst < SMALL:
            return multiple * simulator.step
    return simulator.step
