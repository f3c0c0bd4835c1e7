"""A scenario is simulated in memory, step by step as the solver's program does it, and read at any instants."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover, Scenario
from rille.model.quaternion import angle_of, into_body
from rille.model.recording import ANGLES, MOTION_QUANTITIES

Array = NDArray[np.float64]
Column = tuple[str, str, int]  # quantity, target, component, as the solver counts them
CHUNK = 2048  # steps between two looks at the progress
ON_STEP = 1e-6  # steps: an instant that is so near to a step is that step, whatever the rounding
VECTOR, QUATERNION = ("x", "y", "z"), ("w", "x", "y", "z")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What to read, and when.

    quantity, target : as in ``model.recording.QUANTITIES``. components : of a vector or orientation; empty for a scalar.
    frame : ``world``, or ``body``: vectors in the axes of the part itself. times : (n,) [s], ascending.
    """

    quantity: str
    target: str
    components: tuple[str, ...]
    frame: str
    times: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Taken:
    """What a simulation showed.

    values : for each ``Wanted`` (n, components or 1) [SI]; NaN after the end of the run.
    commands : drive -> times (m,) [s] and set values (m,): each holds until the next. The first is at 0 s.
    status : ``done``, ``interrupted``, or the solver's word for what ended the run. reached : [s]. message : the end in a sentence.
    """

    values: tuple[Array, ...]
    commands: Mapping[str, tuple[Array, Array]]
    status: str
    reached: float
    message: str


def record(
    path: Path,
    scenario: Scenario,
    rover: Rover,
    wanted: Sequence[Wanted],
    *,
    step: float | None = None,
    duration: float | None = None,
    on_progress: Callable[[float, float], None] | None = None,
) -> Taken:
    """Simulate a scenario of the database and read it at the wanted instants.

    The states are bit by bit those of ``rille run``. Between two steps positions and velocities are interpolated linearly, quaternions
    likewise and normalised: the error is at most h^2/8 |d2y/dt2|, 1e-5 rad for 100 rad/s^2 at 1 ms, and none where an instant is a step.
    What a step makes (efforts, accelerations, forces and slip of wheels, currents) is that of the step that contains the instant; at 0 s
    accelerations and currents are those of the first step. Memory: what is wanted, and one chunk of steps.

    Parameters
    ----------
    scenario, rover : as read from the database at ``path``.
    step, duration : [s], instead of the scenario's.
    on_progress : called with simulated time and duration [s].

    Returns
    -------
    What was reached, also when physics ended the run early or Ctrl-C did.

    Raises
    ------
    InputRefused : with the solver's sentence, if it refuses the model or a target.
    """
    from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

    simulation = _solver.Simulation(str(path), scenario.name, step)
    h = scenario.step if step is None else step
    total = scenario.duration if duration is None else duration
    n_steps = max(1, int(np.floor(total / h + 0.5)))
    alive: Column = ("part.position", simulation.body_names[0], 0)  # NaN from the end of the run on, never before
    columns = list(dict.fromkeys([alive, *(column for want in wanted for column in _columns(want))]))
    place = {column: k for k, column in enumerate(columns)}
    by_step = [k for (quantity, _, _), k in place.items() if quantity == "part.linear_acceleration" or quantity.startswith("motor.")]
    values = tuple(np.full((len(want.times), max(1, len(want.components))), np.nan) for want in wanted)
    taken = [0] * len(wanted)
    first = {drive.name: simulation.read("joint.position", drive.joint)[0] if drive.mode == "position" else 0.0 for drive in rover.drives}
    status, done, fired, last = simulation.settle(), 0, [], np.empty((0, len(columns)))
    try:
        while status == "running" and done < n_steps:
            rows = np.vstack([last, simulation.sample(min(CHUNK, n_steps - done), 1, columns, from_start=done == 0)])
            status = simulation.step(0)
            fired += [(time, subject) for time, kind, subject, _ in simulation.events() if kind == "watch"]
            good = int(np.isfinite(rows[:, 0]).sum()) - 1
            if done == 0:
                rows[0, by_step] = rows[min(1, good), by_step]
            for k, want in enumerate(wanted):
                upper = int(np.searchsorted(want.times, (done + good) * h * (1 + 1e-12), side="right"))
                if upper > taken[k]:
                    values[k][taken[k] : upper] = _read(want, place, rows[: good + 1], want.times[taken[k] : upper] / h - done)
                taken[k] = max(taken[k], upper)
            last = rows[good : good + 1]
            done += good
            if on_progress is not None:
                on_progress(done * h, n_steps * h)
    except KeyboardInterrupt:
        status = "interrupted"
    return Taken(
        values=values,
        commands=_commands(scenario, first, fired, done * h),
        status="done" if status == "running" else status,
        reached=done * h,
        message="" if status in ("running", "interrupted") else simulation.message,
    )


def _columns(want: Wanted) -> list[Column]:
    """Columns of the solver that a reading needs: whole vectors for other axes."""
    if not want.components:
        return [(want.quantity, want.target, 0)]
    if want.quantity == "part.orientation":
        return [(want.quantity, want.target, k) for k in range(4)]
    needed = [(want.quantity, want.target, k) for k in range(3)]
    if want.frame == "body":
        needed += [("part.orientation", want.target, k) for k in range(4)]
    return needed


def _read(want: Wanted, place: Mapping[Column, int], rows: Array, position: Array) -> Array:
    """Values (n, components) at positions between the rows (counted in steps, from the first row)."""
    held = want.quantity not in MOTION_QUANTITIES
    position = np.where(np.abs(position - np.round(position)) < ON_STEP, np.round(position), position)
    below = np.clip((np.ceil(position) if held else np.floor(position)).astype(int), 0, len(rows) - 1)
    above = below if held else np.minimum(below + 1, len(rows) - 1)
    share = np.clip(position - below, 0, 1)[:, None]

    def between(quantity: str, n: int) -> Array:
        table = rows[:, [place[quantity, want.target, k] for k in range(n)]]
        low, high = table[below], table[above]
        if n == 4:  # q and -q are one orientation
            high = np.where(np.sum(low * high, axis=1, keepdims=True) < 0, -high, high)
        mixed = low + share * (high - low)
        return mixed / np.linalg.norm(mixed, axis=1, keepdims=True) if n == 4 else mixed

    if not want.components:
        return between(want.quantity, 1)
    if want.quantity != "part.orientation":
        vectors = between(want.quantity, 3)
        if want.frame == "body":
            vectors = into_body(between("part.orientation", 4), vectors)
        return vectors[:, [VECTOR.index(component) for component in want.components]]
    q = between("part.orientation", 4)
    return np.column_stack([angle_of(q, word) if word in ANGLES else q[:, QUATERNION.index(word)] for word in want.components])


def _commands(
    scenario: Scenario, first: Mapping[str, float], fired: Sequence[tuple[float, str]], reached: float
) -> dict[str, tuple[Array, Array]]:
    """What each drive was set to up to ``reached`` [s]: by itself at first (where it stands, of a position drive), then by the scenario's
    commands and those of watches.
    """
    given = [(command.time, command.drive, command.value) for command in scenario.commands]
    acting = {watch.name: watch for watch in scenario.watches if watch.action == "command"}
    given += [(time, str(acting[name].drive), float(acting[name].value or 0.0)) for time, name in fired if name in acting]
    result = {}
    for drive, own in first.items():
        series = {0.0: own}
        for time, name, value in sorted(given, key=lambda one: one[0]):
            if name == drive and time <= reached:
                series[time] = value
        result[drive] = (np.array(list(series)), np.array(list(series.values())))
    return result
