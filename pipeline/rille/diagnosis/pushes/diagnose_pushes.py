"""Diagnosis of recordings in which something pushed now and then, beside calm ones of the same machine in which nothing did."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rille.diagnosis.answer.locate import locate
from rille.diagnosis.answer.statement import percent, pushes_in_words, sentence
from rille.diagnosis.comparison.compare import compare_windows
from rille.diagnosis.comparison.difference import find_difference
from rille.diagnosis.pushes.pushes import PushCalibration, calibrate_pushes, find_pushes
from rille.diagnosis.staged import Progress, Stage, Staged, at_once
from rille.diagnosis.starts.noise_floor import shared_noise
from rille.model import EffectKind
from rille.model.comparison import Comparison
from rille.model.diagnosis import Diagnosis, Transient
from rille.model.recording import Recording

WINDOW = 0.5  # [s]
NONE = "no push stands out from what the model gets wrong in the calm recordings, too"


def diagnose_pushes(
    simulators: Callable[[str], Any],
    recordings: Sequence[Recording],
    calm: Sequence[Recording],
    *,
    kinds: Sequence[EffectKind],
    window: float = WINDOW,
    stage: Stage = at_once,
    on_progress: Progress = lambda what, fraction: None,
) -> Diagnosis:
    """Pushes at the joints: when, where, which way, how strong; their number need not be known.

    Parameters
    ----------
    simulators, kinds, stage, on_progress : as of ``diagnose``. recordings : in which pushes are looked for. calm : of the same machine,
        in which nothing pushed; they teach what the model gets wrong by itself, and how that grows where they never were. Commands that
        state no delay are late as the gate finds them (``late_commands``). window [s] : of the comparison that is shown beside.

    Raises
    ------
    InputRefused : as of ``calibrate_pushes`` and ``compare_windows``.
    """
    staged = Staged(on_progress, stage)
    delays = found_delays([*calm, *recordings])
    late, late_calm = late_commands(recordings, delays), late_commands(calm, delays)
    simulator = simulators(recordings[0].scenario or "")
    noise = shared_noise(recordings)
    base: list[Comparison] = staged.run(
        "comparisons", 0.0, 0.1, lambda told: [compare_windows(simulator, r, window=window, noise=noise, on_progress=told) for r in late]
    )
    learned: PushCalibration = staged.run(
        "calm recordings", 0.1, 0.8, lambda told: calibrate_pushes(simulator, late_calm, kinds, on_progress=told)
    )
    pushes: tuple[Transient, ...] = staged.run("pushes", 0.8, 1.0, lambda told: find_pushes(simulator, late, learned, on_progress=told))
    location = locate(find_difference(base), base)
    return Diagnosis(
        model=str(simulator.path),
        scenario=simulator.scenario,
        recordings=tuple(r.name for r in recordings),
        held_out=(),
        verdict="named" if pushes else "nothing_missing",
        sentence=sentence(pushes_in_words(pushes) if pushes else NONE),
        location=location,
        setting=(),
        transients=pushes,
        notes=_notes(learned, delays, calm),
        seconds=staged.seconds,
    )


def found_delays(recordings: Sequence[Recording]) -> dict[str, float]:
    """By target, how late [s] commands act whose manifest states nothing: what others state, else the median of what the gate found."""
    stated: dict[str, list[float]] = {}
    found: dict[str, list[float]] = {}
    for recording in recordings:
        for c in recording.with_role("command"):
            if c.delay != 0:
                stated.setdefault(c.target, []).append(c.delay)
        targets = {c.name: c.target for c in recording.with_role("command") if c.delay == 0}
        for finding in recording.findings:
            delay = finding.detail.get("delay")
            if (
                finding.code == "delay"
                and finding.channel in targets
                and finding.detail.get("kind") == "response"
                and isinstance(delay, float)
            ):
                found.setdefault(targets[finding.channel], []).append(delay)
    return {target: float(np.median(stated.get(target, found.get(target, [])))) for target in sorted({*stated, *found})}


def late_commands(recordings: Sequence[Recording], delays: dict[str, float]) -> list[Recording]:
    """Recordings whose commands are late by what was found for their targets [s], unless they state it."""
    return [
        replace(
            r,
            channels=tuple(
                replace(c, delay=delays[c.target]) if c.role == "command" and c.delay == 0 and c.target in delays else c for c in r.channels
            ),
        )
        for r in recordings
    ]


def _notes(learned: PushCalibration, delays: dict[str, float], calm: Sequence[Recording]) -> tuple[str, ...]:
    """What the calm recordings taught, in words."""
    notes = [f"commands of '{target}' that state no delay are taken as {1e3 * delay:.1f} ms late" for target, delay in delays.items()]
    for law in learned.leading:
        numbers = ", ".join(
            f"{n.name} {v:.3g} +- {e:.2g}{'' if n.unit == '1' else f' {n.unit}'}"
            for n, v, e in zip(law.term.hypothesis.free, law.term.values, law.errors, strict=True)
            if e > 0
        )
        notes.append(
            f"in the {len(calm)} calm recordings {law.term.hypothesis.title} ({numbers}) takes away {percent(law.share)} of what the "
            "model's efforts are off, squared; no proof that this law is the cause: diagnose the calm recordings for that"
        )
    return tuple(notes)
