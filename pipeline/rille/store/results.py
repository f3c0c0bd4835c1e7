"""Runs: what there is, and a run as arrays."""

import sqlite3
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rille.model import BodyTrace, EnergyTrace, Event, InputRefused, JointTrace, Ruts, Trace, WheelTrace
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
        energy = connection.execute("SELECT * FROM energy_state WHERE run_id = ? ORDER BY time", (run.id,)).fetchall()
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
        energy=EnergyTrace(**{f: np.array([e[f] for e in energy]) for f in EnergyTrace.__dataclass_fields__}) if energy else None,
        events=tuple(Event(time=e["time"], kind=e["kind"], subject=e["subject"], message=e["message"]) for e in events),
    )


def read_reactions(path: Path, run_id: int) -> dict[str, np.ndarray]:
    """Reactions by joint: shape (n, 7), time [s], force [N] and torque [N m] of the carrier on the carried body, in W."""
    with reading(path) as connection:
        result = {}
        for key, name in connection.execute("SELECT id, name FROM joint ORDER BY id").fetchall():
            rows = connection.execute(
                "SELECT time, fx, fy, fz, tx, ty, tz FROM joint_reaction WHERE run_id = ? AND joint_id = ? ORDER BY time", (run_id, key)
            ).fetchall()
            result[name] = np.array([tuple(r) for r in rows]).reshape(-1, 7)
        return result


def read_samples(path: Path, run_id: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """What the sensors said, by name: times (n,) [s] by their own clocks, values (n, components) [SI]."""
    with reading(path) as connection:
        result = {}
        for key, name in connection.execute("SELECT id, name FROM sensor ORDER BY id").fetchall():
            rows = connection.execute(
                "SELECT time, component, value FROM sensor_sample WHERE run_id = ? AND sensor_id = ? ORDER BY time, component",
                (run_id, key),
            ).fetchall()
            width = 1 + max((r["component"] for r in rows), default=0)
            table = np.array([tuple(r) for r in rows], dtype=float).reshape(-1, width, 3)
            result[name] = (table[:, 0, 0], table[:, :, 2])
        return result


def read_ruts(path: Path, run_id: int) -> Ruts | None:
    """Ruts of a run, cropped to the tiles that were touched; None where no wheel touched soil."""
    with reading(path) as connection:
        tiles = connection.execute("SELECT * FROM rut_tile WHERE run_id = ?", (run_id,)).fetchall()
    if not tiles:
        return None
    row0, col0 = min(t["row0"] for t in tiles), min(t["col0"] for t in tiles)
    shape = (max(t["row0"] + t["n_rows"] for t in tiles) - row0, max(t["col0"] + t["n_cols"] for t in tiles) - col0)
    layers = {"sinkage": np.zeros(shape), "pressure": np.zeros(shape)}
    for t in tiles:
        i, j = t["row0"] - row0, t["col0"] - col0
        layers[t["layer"]][i : i + t["n_rows"], j : j + t["n_cols"]] = np.frombuffer(t["data"], "<f4").reshape(t["n_rows"], t["n_cols"])
    posting = tiles[0]["posting"]
    x_west, y_north = tiles[0]["x_west"] + col0 * posting, tiles[0]["y_north"] - row0 * posting
    return Ruts(sinkage=layers["sinkage"], pressure=layers["pressure"], posting=posting, x_west=x_west, y_north=y_north)


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
