"""Runs: what there is, and a run as arrays."""

import sqlite3
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rille.model import BodyTrace, Event, InputRefused, JointTrace, Trace, WheelTrace
from rille.store.database import reading


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """One row of table ``run``, with the scenario's name."""

    id: int
    scenario: str
    status: str
    time_reached: float
    step: float
    message: str


def list_runs(path: Path) -> list[RunRow]:
    """All runs of a database, oldest first."""
    with reading(path) as connection:
        rows = connection.execute(
            "SELECT run.id, scenario.name AS scenario, status, time_reached, run.step, message "
            "FROM run JOIN scenario ON scenario.id = scenario_id ORDER BY run.id"
        )
        return [RunRow(**dict(row)) for row in rows]


def read_trace(path: Path, run_id: int | None = None) -> Trace:
    """Read a run; without a number, the latest.

    Raises
    ------
    InputRefused : if there is no run, or none of that number.
    """
    runs = {run.id: run for run in list_runs(path)}
    if not runs:
        raise InputRefused(f"'{path}' has no run; make one: `rille run {path}`")
    if run_id is not None and run_id not in runs:
        raise InputRefused(f"'{path}' has no run {run_id}; it has {', '.join(map(str, runs))}")
    run = runs[run_id if run_id is not None else max(runs)]
    with reading(path) as connection:
        time, bodies = _states(connection, "body", run.id)
        _, joints = _states(connection, "joint", run.id)
        _, wheels = _states(connection, "wheel", run.id)
        events = connection.execute("SELECT * FROM event WHERE run_id = ? ORDER BY id", (run.id,)).fetchall()
    return Trace(
        run_id=run.id,
        scenario=run.scenario,
        status=run.status,
        message=run.message,
        step=run.step,
        time=time,
        bodies=tuple(
            BodyTrace(name=n, position=v[:, :3], rotation=v[:, 3:7], velocity=v[:, 7:10], angular_velocity=v[:, 10:13])
            for n, v in bodies.items()
        ),
        joints=tuple(JointTrace(name=n, position=v[:, 0], velocity=v[:, 1], effort=v[:, 2], work=v[:, 3]) for n, v in joints.items()),
        wheels=tuple(
            WheelTrace(
                name=n,
                center=v[:, :3],
                ground_height=v[:, 3],
                slip_ratio=v[:, 4],
                slip_angle=v[:, 5],
                sinkage=v[:, 6],
                normal_load=v[:, 7],
                drawbar_pull=v[:, 8],
                side_force=v[:, 9],
                drive_torque=v[:, 10],
            )
            for n, v in wheels.items()
        ),
        events=tuple(Event(time=e["time"], kind=e["kind"], subject=e["subject"], message=e["message"]) for e in events),
    )


def _states(connection: sqlite3.Connection, what: str, run_id: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times (n,) and, by name, the columns of ``<what>_state`` after time and key, shape (n, columns)."""
    names = dict(connection.execute(f"SELECT id, name FROM {what}").fetchall())
    rows = connection.execute(f"SELECT * FROM {what}_state WHERE run_id = ? ORDER BY {what}_id, time", (run_id,)).fetchall()
    if not rows:
        return np.empty(0), {}
    table = np.array([tuple(row) for row in rows], dtype=float)
    keys = table[:, 2]
    present = [key for key in names if (keys == key).any()]
    series = {names[key]: table[keys == key][:, 3:] for key in sorted(present)}
    return table[keys == keys[0]][:, 1], series
