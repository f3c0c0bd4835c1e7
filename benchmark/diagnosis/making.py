"""A trial as files: recordings that a machine made which is not quite as its model, and the database that diagnosis gets."""

import contextlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from bench_points import points_recording
from faults import real_instruments, real_machine
from instrument_sets import instruments
from maneuvers import maneuver
from subjects import subject
from trials import Trial

from rille import store
from rille.cli.import_recording import import_recording
from rille.cli.prove_making import MODEL, misfits_of, write_recording, write_subject
from rille.cli.record_run import simulated_recording
from rille.model import InputRefused, PhysicsFailed, Scenario
from rille.model.recording import Recording
from rille.proof.making import Misfit, excess
from rille.proof.strength import Unreachable, find_size
from rille.proof.subject import Subject
from rille.proof.trials import HELD_OUT, TRAINING
from rille.recording.instrument import Instruments

ACCEPTED = ("sign",)  # the data gate refuses a channel that is turned round; diagnosis is to name it all the same


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
        self.fault = trial.fault()
        rng = trial.random("maneuver")
        self.scenarios: list[Scenario] = [maneuver(self.subject, name, rng) for name in (*TRAINING, HELD_OUT)]
        self.instruments, self.step, self.hidden = instruments(self.subject, trial.random("instruments"))
        self.model = folder / MODEL
        write_subject(self.subject, self.model)
        for scenario in self.scenarios:
            store.write_scenario(self.model, scenario)
        self.misfits = misfits_of(self.model)

    def recordings(self, size: float, names: Sequence[str]) -> list[Recording]:
        """What is recorded of the machine as it is. Raises PhysicsFailed where a run does not reach its end."""
        machine = real_machine(self.fault, self.subject, size)
        if self.subject.kind == "points":
            return [points_recording(machine, name, self._seed(name), self.trial.random("maneuver")) for name in names]
        path = self.folder / "truth.db"
        path.unlink(missing_ok=True)
        write_subject(machine, path)
        made = []
        for scenario in (one for one in self.scenarios if one.name in names):
            store.write_scenario(path, replace(scenario, gravity=machine.gravity))
            told = replace(self.instruments, seed=self._seed(scenario.name))
            recording, taken = simulated_recording(
                path, real_instruments(self.fault, told, size), scenario=scenario.name, step=self.step, name=scenario.name
            )
            if taken.status not in ("done", "stopped"):
                raise PhysicsFailed(taken.message or taken.status)
            made.append(_as_told(recording, told))
        return made

    def _seed(self, name: str) -> int:
        return int(np.random.default_rng([*name.encode(), int(self.trial.random("noise").integers(1 << 31))]).integers(1 << 31))

    def excess(self, recordings: Sequence[Recording], floor: Mapping[str, Misfit] | None = None) -> tuple[float, str]:
        """``rille.proof.making.excess`` with noise as it is, also where the manifest hides it. floor : without the fault."""
        return excess(self.misfits(recordings, ()), floor or {})

    @cached_property
    def floor(self) -> Mapping[str, Misfit]:
        """Of channels what is shown without the fault."""
        return self.misfits(self.recordings(0.0, TRAINING), ())

    def strength(self, size: float) -> tuple[float, str]:
        """Excess in the training recordings at a size; infinite where physics ends a run or refuses the numbers."""
        try:
            return self.excess(self.recordings(size, TRAINING), self.floor if size > 0 else None)
        except (PhysicsFailed, InputRefused):
            return np.inf, ""

    def size(self, wanted: float) -> tuple[float, float, str]:
        """Size of the fault whose excess is ``wanted``, the excess that it really has, and its channel."""
        assert self.fault is not None
        return find_size(self.strength, wanted, self.fault.first, self.fault.most, self.fault.least)


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
        recordings = maker.recordings(size, (*TRAINING, HELD_OUT))
    except (PhysicsFailed, InputRefused) as error:
        raise Unreachable(str(error)) from error
    manifests = [write_recording(one, folder, hides_noise=bool(maker.hidden), accepted=ACCEPTED) for one in recordings]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        import_recording(manifests, maker.model)
    return Truth(
        trial=trial.name,
        cause=trial.cause,
        kind=trial.kind,
        target=trial.target,
        numbers=maker.fault.numbers(size) if maker.fault else {},
        size=size,
        strength=strength,
        channel=channel,
        step=maker.step,
        hidden=maker.hidden,
    )
