"""Scenario values <-> rows."""

import sqlite3
from dataclasses import replace as changed
from pathlib import Path

from rille.model import Command, InitialJointState, InputRefused, Pose, Scenario, StateChange, Watch, nearest_names
from rille.store.database import insert, reading, writing
from rille.store.forget import forget_scenarios
from rille.store.rover import read_sources, write_sources

WATCH_COLUMNS = ("name", "event", "quantity", "component", "target", "above", "below", "hold", "action", "value")
START_COLUMNS = (
    *(f"start_{c}" for c in ("x", "y", "z", "qw", "qx", "qy", "qz")),
    *(f"start_{c}" for c in ("vx", "vy", "vz", "wx", "wy", "wz")),
)


def write_scenario(path: Path, scenario: Scenario, *, replace: bool = False) -> None:
    """Put a scenario into the database. One that is there already with the same values is left alone, with its runs.

    Raises
    ------
    InputRefused : if a different scenario of that name has runs and ``replace`` is false (true deletes them), if it names a
        drive, joint or terrain that does not exist, or if a value breaks a rule of the schema.
    """
    with writing(path) as connection:
        recordings: list[sqlite3.Row] = []  # of this scenario: they stay so, whatever it becomes
        present = connection.execute("SELECT id FROM scenario WHERE name = ?", (scenario.name,)).fetchone()
        if present is not None:
            if changed(_read(connection, scenario.name), sources=()) == changed(scenario, sources=()):
                return
            runs = connection.execute("SELECT id FROM run WHERE scenario_id = ?", (present["id"],)).fetchall()
            if runs and not replace:
                raise InputRefused(
                    f"scenario '{scenario.name}' differs from the one that run {runs[0]['id']} in '{path}' used; "
                    "rename it, or --force to replace it and delete its runs"
                )
            recordings = connection.execute("SELECT id FROM recording WHERE scenario_id = ?", (present["id"],)).fetchall()
            forget_scenarios(connection, "SELECT ?", (present["id"],))
        connection.execute("DELETE FROM provenance WHERE subject = ?", (f"scenario {scenario.name}",))
        _write(connection, scenario)
        connection.executemany(
            "UPDATE recording SET scenario_id = (SELECT id FROM scenario WHERE name = ?) WHERE id = ?",
            [(scenario.name, row["id"]) for row in recordings],
        )
        write_sources(connection, scenario.sources)


def remove_scenario(path: Path, name: str) -> None:
    """Take out a scenario that has no run and no recording; of one that has, or of a name that is not there, nothing is taken."""
    with writing(path) as connection:
        used = "SELECT scenario_id FROM run UNION SELECT scenario_id FROM recording WHERE scenario_id IS NOT NULL"
        gone = connection.execute(f"DELETE FROM scenario WHERE name = ? AND id NOT IN ({used})", (name,)).rowcount
        if gone:
            connection.execute("DELETE FROM provenance WHERE subject = ?", (f"scenario {name}",))


def scenario_names(path: Path) -> tuple[str, ...]:
    """Names of the scenarios of a database, oldest first."""
    with reading(path) as connection:
        return tuple(row["name"] for row in connection.execute("SELECT name FROM scenario ORDER BY id"))


def _keys(connection: sqlite3.Connection, table: str) -> dict[str, int]:
    return dict(connection.execute(f"SELECT name, id FROM {table}").fetchall())


def _key(keys: dict[str, int], what: str, name: str, subject: str) -> int:
    if name not in keys:
        raise InputRefused(f"{subject} names the {what} '{name}', which the model does not have; {nearest_names(name, keys)}")
    return keys[name]


def _write(connection: sqlite3.Connection, scenario: Scenario) -> None:
    subject = f"scenario '{scenario.name}'"
    terrains, joints, drives = (_keys(connection, t) for t in ("terrain", "joint", "drive"))
    start = (
        *scenario.start.position,
        *scenario.start.rotation,
        *scenario.start_velocity,
        *scenario.start_angular_velocity,
    )
    row = {
        "name": scenario.name,
        "terrain_id": None if scenario.terrain is None else _key(terrains, "terrain", scenario.terrain, subject),
        **dict(zip(("gravity_x", "gravity_y", "gravity_z"), map(float, scenario.gravity), strict=True)),
        "duration": scenario.duration,
        "step": scenario.step,
        "output_interval": scenario.output_interval,
        "integrator": scenario.integrator,
        "placement": scenario.placement,
        "settle_time": scenario.settle_time,
        "steered_from": scenario.steered_from,
        **dict(zip(START_COLUMNS, map(float, start), strict=True)),
    }
    key = insert(connection, "scenario", subject, row)
    for state in scenario.initial_states:
        row = {
            "scenario_id": key,
            "joint_id": _key(joints, "joint", state.joint, f"an initial state of {subject}"),
            "position": state.position,
            "velocity": state.velocity,
        }
        insert(connection, "initial_state", f"the initial state of joint '{state.joint}' in {subject}", row)
    for watch in scenario.watches:
        what = f"watch '{watch.name}' of {subject}"
        row = {
            "scenario_id": key,
            **{f: getattr(watch, f) for f in WATCH_COLUMNS},
            "drive_id": None if watch.drive is None else _key(drives, "drive", watch.drive, what),
        }
        insert(connection, "watch", what, row)
    for number, change in enumerate(scenario.changes, start=1):
        for component, value in enumerate(change.values):
            row = {
                "scenario_id": key,
                "number": number,
                "component": component,
                "time": change.time,
                "quantity": change.quantity,
                "target": change.target,
                "value": value,
            }
            insert(connection, "state_change", f"the change of {change.quantity} of '{change.target}' at {change.time} s in {subject}", row)
    for command in scenario.commands:
        row = {
            "scenario_id": key,
            "drive_id": _key(drives, "drive", command.drive, f"a command of {subject}"),
            "time": command.time,
            "value": command.value,
        }
        insert(connection, "command", f"the command of drive '{command.drive}' at {command.time} s in {subject}", row)


def resumable_scenarios(path: Path) -> tuple[str, ...]:
    """Names of scenarios with a run that was interrupted and can go on, in the order of the database."""
    with reading(path) as connection:
        rows = connection.execute(
            "SELECT name FROM scenario WHERE id IN (SELECT scenario_id FROM run JOIN checkpoint ON run_id = run.id "
            "WHERE status IN ('interrupted', 'running')) ORDER BY id"
        )
        return tuple(row["name"] for row in rows)


def read_scenario(path: Path, name: str | None = None) -> Scenario:
    """Read a scenario; without a name, the only one.

    Raises
    ------
    InputRefused : if there is none, none of that name, or several and no name was given.
    """
    with reading(path) as connection:
        stated = "" if name is not None else "WHERE steered_from = ''"  # without a name, what was steered is not meant
        names = [r["name"] for r in connection.execute(f"SELECT name FROM scenario {stated} ORDER BY id")]
        if not names:
            raise InputRefused(f"'{path}' has no scenario; give one: `rille run {path} --scenario FILE.toml`")
        if name is None and len(names) > 1:
            raise InputRefused(f"'{path}' has several scenarios; name one with --scenario, {nearest_names('', names)}")
        if name is not None and name not in names:
            raise InputRefused(f"'{path}' has no scenario '{name}'; {nearest_names(name, names)}")
        return _read(connection, name or names[0])


def _read(connection: sqlite3.Connection, name: str) -> Scenario:
    row = connection.execute(
        "SELECT scenario.*, terrain.name AS terrain FROM scenario LEFT JOIN terrain ON terrain.id = terrain_id WHERE scenario.name = ?",
        (name,),
    ).fetchone()
    states = connection.execute(
        "SELECT name, position, velocity FROM initial_state JOIN joint ON joint.id = joint_id WHERE scenario_id = ? "
        "ORDER BY initial_state.rowid",
        (row["id"],),
    )
    commands = connection.execute(
        "SELECT name, time, value FROM command JOIN drive ON drive.id = drive_id WHERE scenario_id = ? ORDER BY command.rowid",
        (row["id"],),
    )
    watches = connection.execute(
        "SELECT watch.*, drive.name AS drive FROM watch LEFT JOIN drive ON drive.id = drive_id WHERE scenario_id = ? ORDER BY watch.id",
        (row["id"],),
    )
    changes: dict[int, list[sqlite3.Row]] = {}
    for change in connection.execute("SELECT * FROM state_change WHERE scenario_id = ? ORDER BY number, component", (row["id"],)):
        changes.setdefault(change["number"], []).append(change)
    start = [row[c] for c in START_COLUMNS]
    return Scenario(
        name=row["name"],
        terrain=row["terrain"],
        gravity=(row["gravity_x"], row["gravity_y"], row["gravity_z"]),
        duration=row["duration"],
        step=row["step"],
        output_interval=row["output_interval"],
        integrator=row["integrator"],
        placement=row["placement"],
        settle_time=row["settle_time"],
        steered_from=row["steered_from"],
        start=Pose(position=(start[0], start[1], start[2]), rotation=(start[3], start[4], start[5], start[6])),
        start_velocity=(start[7], start[8], start[9]),
        start_angular_velocity=(start[10], start[11], start[12]),
        initial_states=tuple(InitialJointState(joint=s["name"], position=s["position"], velocity=s["velocity"]) for s in states),
        watches=tuple(Watch(drive=w["drive"], **{f: w[f] for f in WATCH_COLUMNS}) for w in watches),
        changes=tuple(
            StateChange(time=c[0]["time"], quantity=c[0]["quantity"], target=c[0]["target"], values=tuple(v["value"] for v in c))
            for c in changes.values()
        ),
        commands=tuple(Command(drive=c["name"], time=c["time"], value=c["value"]) for c in commands),
        sources=read_sources(connection, f"scenario {name}"),
    )
