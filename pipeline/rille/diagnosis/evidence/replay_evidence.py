"""Recordings over time as evidence: replayed in windows, every setting from the same starts."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.evidence.applied import Simulators, of_scenario
from rille.diagnosis.evidence.evidence_part import Part, gather_part, innovation_noise
from rille.diagnosis.evidence.momentary import residuals
from rille.diagnosis.starts.noise_floor import shared_noise
from rille.model.hypothesis import Setting
from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Noise = Mapping[str, tuple[float, str]]
Progress = Callable[[int, int, str], None] | None


def gather(
    simulators: Simulators,
    recordings: Sequence[Recording],
    *,
    window: float = 0.5,
    noise: Noise | None = None,
    rough: float | None = None,
    on_progress: Progress = None,
) -> "ReplayEvidence":
    """Cuts recordings into windows, fits the starts of all, and keeps how their samples answer to the starts.

    Parameters
    ----------
    simulators : of scenarios by name, as ``rille.simulate.Replayer``; or a function from the name. They stay as they are. window : [s].
    noise : of channels by name with where it is from, as of ``shared_noise``; None: from these recordings. rough : as of
        ``gather_part``.

    Raises
    ------
    InputRefused : as ``compare_windows``; if a recording's scenario is not among ``simulators``.
    """
    noise = {**shared_noise(recordings), **(noise or {})}
    parts = []
    for number, recording in enumerate(recordings):

        def report(done: int, total: int, stage: str, number: int = number) -> None:
            if on_progress:
                on_progress(number * total + done, len(recordings) * total, stage)

        simulator = of_scenario(simulators, recording.scenario)
        parts.append(gather_part(simulator, recording, window=window, noise=noise, rough=rough, on_progress=report))
    return ReplayEvidence(_with_innovations(parts), window=window)


def _with_innovations(parts: Sequence[Part]) -> list[Part]:
    """Parts with the noise of unstated channels as the simulation leaves it: one sensor has one, the median over recordings."""
    found: dict[str, list[float]] = {}
    for part in parts:
        for name, sigma in innovation_noise(part).items():
            found.setdefault(name, []).append(sigma)
    sigma = {name: sorted(values)[len(values) // 2] for name, values in found.items()}
    return [part.with_noise(sigma) for part in parts]


class ReplayEvidence:
    """``Evidence`` of recordings over time. ``parts``: one a recording, in the order of the windows."""

    def __init__(self, parts: Sequence[Part], *, window: float) -> None:
        self.parts = tuple(part for part in parts if len(part.first))
        self._start_gain: Array | None = None
        self.length = window
        self.channels: tuple[Channel, ...] = tuple({_key(s.channel): s.channel for part in self.parts for s in part.samples}.values())
        self.starts: Array = np.concatenate([part.first for part in self.parts])
        self.stops: Array = np.concatenate([part.last for part in self.parts])
        self.run: Whole = np.repeat(np.arange(len(self.parts)), [len(part.first) for part in self.parts])
        firsts = np.cumsum([0, *(len(part.first) for part in self.parts)])
        self.window: Whole = np.concatenate([p.window + f for p, f in zip(self.parts, firsts, strict=False)])
        self.time: Array = np.concatenate([part.ordered([s.time for s in part.samples]) for part in self.parts])
        self.sigma: Array = np.concatenate([p.ordered([np.full(len(s.time), s.noise) for s in p.samples]) for p in self.parts])
        place = {_key(channel): k for k, channel in enumerate(self.channels)}
        self.channel: Whole = np.concatenate(
            [p.ordered([np.full(len(s.time), place[_key(s.channel)]) for s in p.samples]) for p in self.parts]
        )

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings, in the order of ``run``."""
        return tuple(part.recording.name for part in self.parts)

    @property
    def start_gain(self) -> Array:
        """D (N, d), in columns that are of no direction of a recording 0."""
        if self._start_gain is None:
            gains = [part.start_gain for part in self.parts]
            widest = max(gain.shape[1] for gain in gains)
            self._start_gain = np.concatenate([np.pad(gain, ((0, 0), (0, widest - gain.shape[1]))) for gain in gains])
        return self._start_gain

    def residuals(self, settings: Sequence[Setting]) -> Array:
        """(k, N) as ``Evidence`` says. A setting that the model refuses (a value out of its bounds) is a row of NaN."""
        return np.concatenate([residuals(part, settings) for part in self.parts], axis=1)

    def relinearised(self, setting: Setting, on_progress: Progress = None) -> "ReplayEvidence":
        """The same windows and noise with starts fitted under a setting."""
        return ReplayEvidence([part.relinearised(setting, on_progress) for part in self.parts], window=self.length)

    def subset(self, windows: Whole, *, roughly: bool = False) -> "ReplayEvidence":
        """Only these windows (ascending numbers), renumbered from 0. Recordings without any are left out. roughly : for a first look."""
        firsts = np.searchsorted(self.run, np.arange(len(self.parts) + 1))
        chosen = [windows[(windows >= a) & (windows < b)] - a for a, b in pairwise(firsts)]
        parts = [p.subset(c) for p, c in zip(self.parts, chosen, strict=True) if len(c)]
        return ReplayEvidence([part.roughly() if roughly else part for part in parts], window=self.length)


def _key(channel: Channel) -> tuple[str, str, str, str]:
    return channel.name, channel.quantity, channel.target, channel.component
