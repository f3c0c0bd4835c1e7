"""Scenarios of runs that are steered, states kept by name, and the log of what was asked."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

from rille.model import InputRefused, Scenario, nearest_names
from rille.store.database import reading, writing
from rille.store.scenario import read_scenario, write_scenario

LONGEST = 1e8  # [s] duration of a scenario that goes on until it is ended; the run then writes what it took


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedState:
    """A state kept by name: the run and scenario that it was saved in, and its time [s]."""

    name: str
    run_id: int
    scenario: str
    time: float
    step: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedCommand:
    """A row of table ``command_log``: time [s] simulated at arrival; received: UTC; request: JSON; refused: why, or empty."""

    time: float
    received: str
    sender: str
    sequence: int | None
    request: str
    refused: str


def free_scenario_name(path: Path, stem: str) -> str:
    """``stem-1``, ``stem-2`` ...: the first that comes after all that the database has."""
    with reading(path) as connection:
        names = [row["name"] for row in connection.execute("SELECT name FROM scenario")]
    pattern = re.compile(re.escape(stem) + r"-(\d+)")
    numbers = [int(found[1]) for name in names if (found := pattern.fullmatch(name))]
    return f"{stem}-{max(numbers, default=0) + 1}"


def write_steered(path: Path, scenario: Scenario, stem: str) -> str:
    """Write a scenario of its own for a run that is steered, named after ``stem``, and return its name."""
    name = free_scenario_name(path, stem)
    write_scenario(path, replace(scenario, name=name, steered_from=scenario.steered_from or scenario.name))
    return name


def write_continued(path: Path, saved: str, stem: str) -> str:
    """Write a scenario that begins like the one in which a state was saved and goes on from there, and return its name.

    Raises
    ------
    InputRefused : if no state has that name.
    """
    states = {state.name: state for state in saved_states(path)}
    if saved not in states:
        raise InputRefused(f"'{path}' has no saved state '{saved}'; {nearest_names(saved, states)}")
    state = states[saved]
    before = read_scenario(path, state.scenario)
    latest = state.time + 0.25 * state.step
    begun = replace(
        before,
        duration=LONGEST,
        commands=tuple(command for command in before.commands if command.time <= latest),
        changes=tuple(change for change in before.changes if change.time <= latest),
    )
    return write_steered(path, begun, stem)


def saved_states(path: Path) -> tuple[SavedState, ...]:
    """States that were kept, by name."""
    with reading(path) as connection:
        rows = connection.execute(
            "SELECT saved_state.name, run_id, scenario.name AS scenario, time, run.step FROM saved_state "
            "JOIN run ON run.id = run_id JOIN scenario ON scenario.id = scenario_id ORDER BY saved_state.name"
        )
        return tuple(SavedState(**dict(row)) for row in rows)


def remove_unused(path: Path, scenario: str) -> None:
    """Remove a scenario and its run that never took a step and kept no state."""
    with writing(path, known_sound=True) as connection:
        connection.execute(
            "DELETE FROM scenario WHERE name = ? AND NOT EXISTS "
            "(SELECT 1 FROM run JOIN saved_state ON run_id = run.id WHERE scenario_id = scenario.id)",
            (scenario,),
        )


def read_command_log(path: Path, run_id: int) -> tuple[LoggedCommand, ...]:
    """What was asked of a run, in the order of arrival."""
    with reading(path) as connection:
        rows = connection.execute(
            "SELECT time, received, sender, sequence, request, refused FROM command_log WHERE run_id = ? ORDER BY number", (run_id,)
        )
        return tuple(LoggedCommand(**dict(row)) for row in rows)
