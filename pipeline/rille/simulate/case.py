"""Cases of a study in process: the model is read once, changed in memory, driven, and reduced to numbers."""

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Scenario
from rille.model.study import CaseResult, Change, ChannelMeasure, Measure, Status, TracedChannel
from rille.simulate.case_measures import Channel, Driven, Drove, driven_of, measured, measures_of
from rille.simulate.machine_facts import machine_facts
from rille.simulate.tip_over import support_of

Array = NDArray[np.float64]
Setting = tuple[Change, float]


class CaseRunner:
    """Runs cases of one model and scenario.

    path : model.db with the scenario, which is given as a value, too. channels : outcomes asked besides the usual ones. traced,
    trace_time [s] : channels that are kept at these times.
    Raises InputRefused if the model cannot be simulated or has no such channel.
    """

    def __init__(
        self,
        path: Path | str,
        scenario: Scenario,
        *,
        channels: Sequence[ChannelMeasure] = (),
        traced: Sequence[TracedChannel] = (),
        trace_time: Sequence[float] = (),
    ) -> None:
        from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

        self._solver = _solver
        self._scenario = scenario
        self._asked = tuple(channels)
        self._traced = [Channel(c.quantity, c.target, c.component) for c in traced]
        self._trace_time = np.array(trace_time)
        self._model = _solver.Model(str(path), scenario.name)
        self._driven = driven_of(machine_facts(self._model), [Channel(c.quantity, c.target, c.component) for c in channels])
        self._channels = list(dict.fromkeys([*self._driven.channels, *self._traced]))
        _solver.Simulation(self._model.copy()).sample(1, 1, self._channels)  # refuses what it does not have

    @property
    def bounds(self) -> dict[str, tuple[float, float, float]]:
        """Every parameter of the model: value, lower and upper bound [SI]."""
        return self._model.bounds()

    @property
    def driven(self) -> Driven:
        """What is read of the machine."""
        return self._driven

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Outcomes that each case has besides those asked."""
        return measures_of(self._driven)

    def run(self, number: int, settings: Sequence[Setting], model: Any = None) -> CaseResult:
        """One case. Nothing that a case can be makes it raise.

        settings : changes with their values [SI]. model : instead of the one that was read (on other ground).
        """
        begin = time.perf_counter()
        try:
            result = self._run(number, settings, model)
        except InputRefused as refusal:
            result = CaseResult(number=number, status="refused", reason=str(refusal))
        except Exception as error:  # a case that fails is a row; the next one is another case
            result = CaseResult(number=number, status="error", reason=f"{type(error).__name__}: {error}")
        object.__setattr__(result, "seconds", time.perf_counter() - begin)
        return result

    def _run(self, number: int, settings: Sequence[Setting], model: Any) -> CaseResult:
        changed = (self._model if model is None else model).copy()
        duration = _change(changed, self._scenario, settings)
        step: float = changed.step
        simulation = self._solver.Simulation(changed)
        if changed.settle_time > 0:
            simulation.settle()
        every = max(1, round(self._scenario.output_interval / step))
        instants, rows = _driven_through(simulation, max(1, round(duration / step)), every, step, self._channels)
        outcome: str = simulation.step(0)
        status = cast(Status, "done" if outcome == "running" else outcome)
        support, wheels = None, simulation.wheels()
        if self._driven.corners is not None and len(wheels):
            facts = simulation.facts
            support = support_of(self._driven.corners, facts["bodies"], facts["wheels"], simulation.bodies(), wheels, simulation.gravity)
        drove = Drove(
            time=instants,
            values={channel: rows[:, k] for k, channel in enumerate(self._channels)},
            work=float(np.nansum(simulation.joints()[:, 3])),
            time_reached=simulation.time,
            support=support,
        )
        outcomes = measured(self._driven, drove, self._asked)
        return CaseResult(number=number, status=status, reason=simulation.message, outcomes=outcomes, traces=self._traces(drove))

    def _traces(self, drove: Drove) -> Array | None:
        """(channels, times), straight lines between samples, NaN after the end."""
        if not self._traced:
            return None
        if not len(drove.time):
            return np.full((len(self._traced), len(self._trace_time)), np.nan)
        lasted = self._trace_time <= drove.time[-1] * (1 + 1e-9)  # whatever the rounding of both
        return np.array([np.where(lasted, np.interp(self._trace_time, drove.time, drove.values[c]), np.nan) for c in self._traced])

    def read(self, path: Path | str) -> Any:
        """The same model on other ground, for ``run``."""
        return self._solver.Model(str(path), self._scenario.name)


def _driven_through(simulation: Any, steps: int, every: int, step: float, channels: Sequence[Channel]) -> tuple[Array, Array]:
    """Drive to the end. Returns times (n,) [s] and readings (n, channels) that are finite: at the start, after every so many steps, and as
    the last one the state in which the drive ended, whether its time was over or something ended it before.
    """
    every = min(every, steps)
    rows = simulation.sample(steps - steps % every, every, channels, from_start=True)
    simulation.step(steps % every)
    time = np.asarray(step * every * np.arange(len(rows)), dtype=np.float64)
    read = np.isfinite(rows).all(axis=1)
    time, rows = time[read], rows[read]
    end = np.array([[simulation.read(c.quantity, c.target)[c.component] for c in channels]])
    if simulation.time > time.max(initial=-math.inf) + step / 2 and np.isfinite(end).all():
        return np.array([*time, simulation.time]), np.concatenate([rows, end])
    return time, rows


def _change(model: Any, scenario: Scenario, settings: Sequence[Setting]) -> float:
    """Change a model in memory; returns the duration [s]. Gravity is first: soil weighs with it, but a unit weight that is set stays."""
    duration = scenario.duration
    start = {"x": scenario.start.position[0], "y": scenario.start.position[1], "heading": _heading(scenario)}
    commands: dict[str, dict[int, float]] = {}
    effects: dict[tuple[str, str], dict[str, float]] = {}
    moved = False
    for change, given in sorted(settings, key=lambda setting: (setting[0].kind, setting[0].name) != ("scenario", "gravity")):
        value = float(given)
        if change.kind == "parameter":
            model.set(change.name, value * model.get(change.name) if change.relative else value)
        elif change.kind == "effect":
            effects.setdefault((change.name, change.target), {})[change.number] = value
        elif change.kind == "start":
            start[change.name] = value * start[change.name] if change.relative else value
            moved = True
        elif change.kind == "command":
            place = int(change.number)
            own = _commands(scenario, change.name)[place].value
            commands.setdefault(change.name, {})[place] = value * own if change.relative else value
        elif change.kind == "scenario":
            duration = _of_scenario(model, scenario, change, value, duration)
    if moved:
        model.set_start(start["x"], start["y"], start["heading"])
    for drive, new in commands.items():
        own = _commands(scenario, drive)
        values = [new.get(k, command.value) for k, command in enumerate(own)]
        model.set_commands(drive, np.array([command.time for command in own]), np.array(values))
    for (law, target), numbers in effects.items():
        model.add_effect(law, target, numbers)
    return duration


def _of_scenario(model: Any, scenario: Scenario, change: Change, value: float, duration: float) -> float:
    if change.name == "duration":
        return value * scenario.duration if change.relative else value
    if change.name == "step":
        model.set_step(value * scenario.step if change.relative else value)
        return duration
    before = -scenario.gravity[2]
    after = value * before if change.relative else value
    model.set("gravity.z", -after)
    for name in model.parameters():  # soil weighs with it
        if name.startswith("soil.") and name.endswith(".unit_weight"):
            model.set(name, model.get(name) * after / before)
    return duration


def _commands(scenario: Scenario, drive: str) -> list[Any]:
    """Commands of a drive in the order of time."""
    return sorted((command for command in scenario.commands if command.drive == drive), key=lambda command: command.time)


def _heading(scenario: Scenario) -> float:
    w, x, y, z = scenario.start.rotation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
