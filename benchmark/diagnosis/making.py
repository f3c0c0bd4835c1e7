"""A trial as files: recordings that a machine made which is not quite as its model, and the database that diagnosis gets."""

import contextlib
import io
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from bench_points import points_recording, write_points
from faults import Fault
from instrument_sets import instruments
from maneuvers import maneuver
from subjects import Subject, subject
from trials import Trial

from rille import diagnosis, simulate, store
from rille.cli.compare_points import compare_points
from rille.cli.import_recording import import_recording
from rille.cli.record_run import simulated_recording
from rille.diagnosis.comparison.pooled import pool
from rille.model import InputRefused, PhysicsFailed, Scenario
from rille.model.comparison import Comparison
from rille.model.recording import Recording
from rille.recording.instrument import Instruments
from rille.recording.writing import manifest_text, write_recording_file

TRAINING, HELD_OUT = ("training_1", "training_2"), ("held_out",)
WINDOW = 0.5  # [s]
NEAR = 0.1  # relative: so far may the strength be off
MOST_TRIES = 9
ACCEPTED = ["sign"]  # the data gate refuses a channel that is turned round; diagnosis is to name it all the same
HIDDEN = 0.3  # [noise]: below this an excess says nothing about how it grows with the size


class Unreachable(Exception):
    """The fault cannot be as strong as wanted on this machine and maneuver."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What is wrong. strength : the excess that it has in the training recordings [noise], channel : where. hidden : by the manifest."""

    trial: str
    cause: str
    kind: str
    target: str
    numbers: dict[str, float]
    size: float
    strength: float
    channel: str
    step: float
    hidden: str


class Maker:
    """Makes the recordings of one trial at any size of its fault, and measures their excess."""

    def __init__(self, trial: Trial, folder: Path) -> None:
        self.trial, self.folder = trial, folder
        self.subject: Subject = subject(trial.machine)
        self.fault: Fault = trial.fault()
        rng = trial.random("maneuver")
        self.scenarios: list[Scenario] = [maneuver(self.subject, name, rng) for name in (*TRAINING, *HELD_OUT)]
        self.instruments, self.step, self.hidden = instruments(self.subject, trial.random("instruments"))
        self.model = folder / "model.db"
        self.subject.write(self.model)
        for scenario in self.scenarios:
            store.write_scenario(self.model, scenario)

    def recordings(self, size: float, names: Sequence[str]) -> list[Recording]:
        """What is recorded of the machine as it is. Raises PhysicsFailed where a run does not reach its end."""
        machine = self.fault.machine(self.subject, size)
        if self.subject.kind == "points":
            return [points_recording(machine, name, self._seed(name), self.trial.random("maneuver")) for name in names]
        path = self.folder / "truth.db"
        path.unlink(missing_ok=True)
        machine.write(path)
        made = []
        for scenario in (one for one in self.scenarios if one.name in names):
            store.write_scenario(path, replace(scenario, gravity=machine.gravity))
            told = replace(self.instruments, seed=self._seed(scenario.name))
            recording, taken = simulated_recording(
                path, self.fault.sensors(told, size), scenario=scenario.name, step=self.step, name=scenario.name
            )
            if taken.status not in ("done", "stopped"):
                raise PhysicsFailed(taken.message or taken.status)
            made.append(_as_told(recording, told))
        return made

    def _seed(self, name: str) -> int:
        return int(np.random.default_rng([*name.encode(), int(self.trial.random("noise").integers(1 << 31))]).integers(1 << 31))

    def excess(self, recordings: Sequence[Recording], floor: Mapping[str, float] | None = None) -> tuple[float, str]:
        """sqrt(normalised^2 - floor) of the channel where it is largest, and that channel.

        Noise as it is, also where the manifest hides it. floor : of channels the normalised^2 that they have without the fault, if above 1:
        values at rest are all rounded alike.
        """
        beyond = {name: square - max(1.0, (floor or {}).get(name, 1.0)) for name, square in self._squares(recordings).items()}
        worst = max(beyond, key=lambda name: beyond[name])
        return float(np.sqrt(max(0.0, beyond[worst]))), worst

    @cached_property
    def floor(self) -> Mapping[str, float]:
        """Of channels normalised^2 without the fault."""
        return self._squares(self.recordings(0.0, TRAINING))

    def _squares(self, recordings: Sequence[Recording]) -> dict[str, float]:
        pooled = [c for c in pool(self._compared(recordings)) if not c.left_out]
        return {c.channel.name: float(np.nansum(c.z**2) / np.sum(c.degrees)) for c in pooled}

    def _compared(self, recordings: Sequence[Recording]) -> list[Comparison]:
        if self.subject.kind == "points":
            return [compare_points(self.model, recording) for recording in recordings]
        return [
            diagnosis.compare_windows(simulate.Replayer(self.model, recording.name, threads=1), recording, window=WINDOW)
            for recording in recordings
        ]

    def strength(self, size: float) -> tuple[float, str]:
        """Excess in the training recordings at a size; infinite where physics ends a run or refuses the numbers."""
        try:
            return self.excess(self.recordings(size, TRAINING), self.floor if size > 0 else None)
        except (PhysicsFailed, InputRefused):
            return np.inf, ""

    def size(self, wanted: float) -> tuple[float, float, str]:
        """Size of the fault whose excess is ``wanted``, the excess that it really has, and its channel.

        Between the largest size that is too small and the smallest that is too large, by regula falsi in logarithms.
        """
        low, high = (0.0, 0.0), (np.inf, np.inf)
        size = max(self.fault.first, self.fault.least)
        best = (np.inf, 0.0, 0.0, "")
        for _ in range(MOST_TRIES):
            found, channel = self.strength(size)
            off = abs(np.log(found / wanted)) if 0 < found < np.inf else np.inf
            best = min(best, (off, size, found, channel), key=lambda one: one[0])
            if off < NEAR or self.fault.least >= self.fault.most:
                break
            if found < wanted:
                low = max(low, (size, found))
                if size >= self.fault.most:
                    break
            else:
                high = min(high, (size, found))
            size = min(_next(low, high, wanted), self.fault.most)
        off, size, found, channel = best
        if off > 0.35 and self.fault.least < self.fault.most:
            raise Unreachable(
                f"{self.trial.name}: excess {found:.3g} at size {size:.3g}, wanted {wanted:g}; sizes reach to {self.fault.most:g}"
            )
        return size, found, channel


def _next(low: tuple[float, float], high: tuple[float, float], wanted: float) -> float:
    """The size to try next, with (size, excess) that are too small and too large."""
    if not np.isfinite(high[0]):
        return low[0] * (float(np.clip(1.1 * wanted / low[1], 1.5, 8.0)) if low[1] > HIDDEN else 6.0)
    if low[1] < HIDDEN or not np.isfinite(high[1]):
        below = low[0] if low[0] > 0 else high[0] / 30
        guess = high[0] * float(np.clip(wanted / high[1], 1 / 20, 0.9)) if np.isfinite(high[1]) else 0.0
        return max(guess, float(np.sqrt(below * high[0]))) if low[0] > 0 else max(guess, below)
    share = np.log(wanted / low[1]) / np.log(high[1] / low[1])
    return float(np.exp(np.log(low[0]) + np.clip(share, 0.05, 0.95) * np.log(high[0] / low[0])))


def _as_told(recording: Recording, told: Instruments) -> Recording:
    """The recording as its manifest describes it: as the instruments should be, whatever they are."""
    known = {column: one for one in told.sensors for column in one.columns}
    return replace(
        recording,
        channels=tuple(replace(c, delay=known[c.name].delay) if c.name in known else c for c in recording.channels),
    )


def make(trial: Trial, folder: Path, size: float | None = None) -> Truth:
    """Make a trial in an empty folder: ``model.db`` with the model and imported recordings, and the files that they came from.

    size : of the fault, if it is known from before; None: looked for.

    Raises
    ------
    Unreachable : if no size of the fault is as strong as wanted.
    """
    folder.mkdir(parents=True, exist_ok=True)
    maker = Maker(trial, folder)
    if size is None:
        size, strength, channel = maker.size(trial.strength) if trial.strength > 0 else (0.0, *maker.strength(0.0))
    else:
        strength, channel = maker.strength(size)
    try:
        recordings = maker.recordings(size, (*TRAINING, *HELD_OUT))
    except (PhysicsFailed, InputRefused) as error:
        raise Unreachable(f"{trial.name}: {error}") from error
    manifests = [_written(recording, folder, maker.hidden) for recording in recordings]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        import_recording(manifests, maker.model)
    return Truth(
        trial=trial.name,
        cause=trial.cause,
        kind=trial.kind,
        target=trial.target,
        numbers=maker.fault.numbers(size),
        size=size,
        strength=strength,
        channel=channel,
        step=maker.step,
        hidden=maker.hidden,
    )


def _written(recording: Recording, folder: Path, hidden: str) -> Path:
    """File and manifest of a recording; returns the manifest."""
    if recording.kind == "points":
        return write_points(recording, folder, hidden)
    file = folder / f"{recording.name}.parquet"
    addresses = write_recording_file(file, recording, {})
    manifest = file.with_suffix(".toml")
    text = manifest_text(recording, file.name, "parquet", addresses, hidden=frozenset(filter(None, [hidden])))
    manifest.write_text(f"accepted = {json.dumps(ACCEPTED)}\n{text}")
    return manifest


def forget(folder: Path) -> None:
    """Remove the files of a trial."""
    shutil.rmtree(folder, ignore_errors=True)
