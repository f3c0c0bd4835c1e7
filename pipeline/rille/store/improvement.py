"""A copy of a model with other numbers and more effects: what a diagnosis proposes, as rows."""

import hashlib
import json
import math
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rille.model import Effect, InputRefused, SourceFile, nearest_names
from rille.model.finding import RowChange
from rille.store.database import reading, writing
from rille.store.effects import find_effect_kind, insert_effect
from rille.store.health import units
from rille.store.rover import write_sources
from rille.store.track_width import spread_wheels, track_width

# Tables and columns that parameters of the solver come from; the first word of the parameter's name -> table.
TABLES = {"soil": "soil", "body": "body", "wheel": "wheel", "drive": "drive"}
TRACK_WIDTH = "track_width"  # parameter that many rows make together
RESULTS = ("run", "bench_point")  # belong to the model as it was
NOT_MODEL = {
    *("provenance", "part", "part_instance", "mesh", "recording", "clock", "clock_block", "channel", "sample_block", "correction"),
    *("gate_finding", "finding", "run", "body_state", "joint_state", "wheel_state", "joint_reaction", "energy_state", "sensor_sample"),
    *("rut_tile", "checkpoint", "bench_point", "event"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """A number in the database. key : of its row. factor : the column over the solver's parameter. inside : its key in JSON."""

    table: str
    key: int
    row: str
    column: str
    before: float
    factor: float = 1.0
    inside: str = ""

    @property
    def value(self) -> float:
        """Of the solver's parameter."""
        return self.before / self.factor


def parameter_values(path: Path, names: Iterable[str], scenario: str | None = None) -> dict[str, float]:
    """Values that parameters of the solver have in a database [SI], by name.

    names : "soil.lunar.cohesion", "drive.hub.max_torque", "track_width". scenario : whose gravity is meant; None: the only one.

    Raises
    ------
    InputRefused : for a parameter that no row of the database holds.
    """
    with reading(path) as connection:
        return {
            name: track_width(connection) if name == TRACK_WIDTH else _place(connection, path, name, scenario).value
            for name in dict.fromkeys(names)
        }


def planned_changes(
    path: Path, effects: Sequence[Effect], parameters: Mapping[str, float], scenario: str | None = None
) -> tuple[RowChange, ...]:
    """What :func:`improve` would change: one row per number, effects first. Parameters and errors as there."""
    columns = units(path)
    changes = []
    with reading(path) as connection:
        for effect in effects:
            known = {parameter.name: parameter.unit for parameter in find_effect_kind(effect.kind).parameters}
            row = f"{effect.kind}.{effect.target}"
            changes += [
                RowChange(table="effect", row=row, column=name, before=None, after=float(value), unit=known.get(name, ""))
                for name, value in effect.parameters.items()
                if isinstance(value, int | float)
            ]
        for name, value in parameters.items():
            if name == TRACK_WIDTH:
                width = track_width(connection)
                changes.append(RowChange(table="wheel", row="all", column="across", before=width, after=value, unit="m"))
                continue
            place = _place(connection, path, name, scenario, parameters)
            column = place.inside or place.column
            unit = _unit_of_effect(place) if place.inside else columns[place.table].get(place.column, "").partition("]")[0].lstrip("[")
            after = place.factor * value
            changes.append(RowChange(table=place.table, row=place.row, column=column, before=place.before, after=after, unit=unit))
    return tuple(changes)


def _unit_of_effect(place: _Place) -> str:
    units_of = {parameter.name: parameter.unit for parameter in find_effect_kind(place.row.partition(".")[0]).parameters}
    return units_of.get(place.inside, "")


def improve(
    source: Path,
    target: Path,
    effects: Sequence[Effect],
    parameters: Mapping[str, float],
    *,
    why: str,
    tool: str,
    scenario: str | None = None,
) -> None:
    """Copy the database ``source`` to ``target``, with these effects added and these parameters changed.

    Runs and bench points are left behind: they belong to the model as it was. Recordings and findings go along. Changed rows say that they
    are ``measured`` and ``calibrated by`` ``why``; table provenance names the source file, its digest and ``tool``.

    Parameters
    ----------
    parameters : parameter of the solver -> its new value [SI]. scenario : whose gravity is meant by ``gravity.z``; None: the only one.

    Raises
    ------
    InputRefused : if ``target`` exists or cannot be written, if no row holds a parameter, or if a value breaks a rule of the schema.
    Nothing is left behind.
    """
    target = Path(target)
    if target.exists():
        raise InputRefused(f"'{target}' exists already; choose another name or remove it")
    if not target.parent.is_dir():
        raise InputRefused(f"the folder '{target.parent}' does not exist; create it first")
    unfinished = target.with_name(target.name + ".part")
    _remove(unfinished)
    try:
        with reading(source) as original, closing(sqlite3.connect(unfinished)) as copy:
            original.backup(copy)
            copy.execute("PRAGMA journal_mode = WAL")
        with writing(unfinished) as connection:
            for table in RESULTS:
                connection.execute(f"DELETE FROM {table}")
            for name, value in parameters.items():
                if name == TRACK_WIDTH:
                    spread_wheels(connection, value)
                else:
                    _change(connection, _place(connection, source, name, scenario, parameters), value, why)
            for effect in effects:
                insert_effect(connection, effect)
            file = SourceFile(subject=f"calibrated by {why}", file=str(source), sha256=_digest(source), tool=tool)
            write_sources(connection, (file,))
        with closing(sqlite3.connect(unfinished, isolation_level=None)) as connection:
            connection.execute("VACUUM")
        unfinished.rename(target)
    except (sqlite3.Error, OSError) as error:
        raise InputRefused(f"'{target}' could not be written: {error}; is the folder writable and the disk not full?") from error
    finally:
        _remove(unfinished)


def _remove(path: Path) -> None:
    for suffix in ("", "-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)


def _digest(path: Path) -> str:
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _change(connection: sqlite3.Connection, place: _Place, value: float, why: str) -> None:
    after = place.factor * value
    try:
        if place.inside:
            statement = f"UPDATE {place.table} SET {place.column} = json_set({place.column}, ?, ?) WHERE id = ?"
            connection.execute(statement, (f'$."{place.inside}"', after, place.key))
        else:
            connection.execute(f"UPDATE {place.table} SET {place.column} = ? WHERE id = ?", (after, place.key))
        _mark(connection, place, why)
    except sqlite3.IntegrityError as error:
        raise InputRefused(
            f"{place.table} '{place.row}' cannot have {place.inside or place.column} = {after:g}: {error}; "
            "the finding was made with another model"
        ) from error


def _mark(connection: sqlite3.Connection, place: _Place, why: str) -> None:
    """Say in the row where its number is from now."""
    columns = {row["name"] for row in connection.execute(f"PRAGMA table_info({place.table})")}
    if place.table == "body":
        mark = "mass_provenance" if place.column == "mass" or place.column.startswith("com") else "inertia_provenance"
        connection.execute(f"UPDATE body SET {mark} = 'measured' WHERE id = ?", (place.key,))
        return
    if "provenance" in columns:
        connection.execute(f"UPDATE {place.table} SET provenance = 'measured' WHERE id = ?", (place.key,))
    if "source" in columns:
        old = connection.execute(f"SELECT source FROM {place.table} WHERE id = ?", (place.key,)).fetchone()["source"]
        said = f"calibrated by {why}"
        if said not in old:
            connection.execute(f"UPDATE {place.table} SET source = ? WHERE id = ?", (f"{old}; {said}" if old else said, place.key))


def _place(
    connection: sqlite3.Connection, path: Path, name: str, scenario: str | None, others: Mapping[str, float] | None = None
) -> _Place:
    """Where a parameter of the solver is kept. Names of rows may hold dots: the first and last word are what counts.

    others : parameters that change together with it; a density is a unit weight over the gravity that will be.
    """
    first, _, rest = name.partition(".")
    if first == "gravity":
        return _gravity(connection, path, rest, scenario)
    row, _, number = rest.rpartition(".")
    if first == "effect":
        return _of_effect(connection, path, row, number)
    if first not in TABLES:
        raise InputRefused(f"'{path}' has no place for the parameter '{name}'; {nearest_names(first, [*TABLES, 'effect', 'gravity'])}")
    table, factor = TABLES[first], 1.0
    if table == "soil" and number == "unit_weight":
        number, factor = "density", 1 / _gravity_size(connection, path, scenario, others or {})
    rows = {r["name"]: r for r in connection.execute(f"SELECT * FROM {table}")}
    if row not in rows:
        raise InputRefused(f"'{path}' has no {table} '{row}'; {nearest_names(row, rows)}")
    if number not in rows[row].keys() or not isinstance(rows[row][number], float | int):  # noqa: SIM118, a Row is no dict
        raise InputRefused(f"{table} '{row}' of '{path}' has no number '{number}' that '{name}' could mean")
    return _Place(table=table, key=rows[row]["id"], row=row, column=number, before=float(rows[row][number]), factor=factor)


def _scenario_row(connection: sqlite3.Connection, path: Path, scenario: str | None) -> sqlite3.Row:
    rows = {r["name"]: r for r in connection.execute("SELECT * FROM scenario ORDER BY id")}
    if scenario is None and len(rows) == 1:
        return next(iter(rows.values()))
    if scenario not in rows:
        raise InputRefused(f"'{path}' has no scenario '{scenario or ''}'; {nearest_names(scenario or '', rows)}")
    return rows[scenario]


def _gravity(connection: sqlite3.Connection, path: Path, axis: str, scenario: str | None) -> _Place:
    row, column = _scenario_row(connection, path, scenario), f"gravity_{axis}"
    return _Place(table="scenario", key=row["id"], row=row["name"], column=column, before=float(row[column]))


def _gravity_size(connection: sqlite3.Connection, path: Path, scenario: str | None, others: Mapping[str, float]) -> float:
    row = _scenario_row(connection, path, scenario)
    return math.hypot(*(others.get(f"gravity.{axis}", row[f"gravity_{axis}"]) for axis in "xyz"))


def _of_effect(connection: sqlite3.Connection, path: Path, kind_and_target: str, number: str) -> _Place:
    query = (
        "SELECT effect.id AS id, name || '.' || effect.target AS place, parameters "
        "FROM effect JOIN effect_kind ON effect_kind.id = effect_kind_id ORDER BY effect.id DESC"
    )
    rows = {r["place"]: r for r in connection.execute(query)}
    if kind_and_target not in rows:
        raise InputRefused(f"the model in '{path}' has no effect '{kind_and_target}'; {nearest_names(kind_and_target, rows)}")
    row = rows[kind_and_target]
    parameters: dict[str, Any] = json.loads(row["parameters"])
    typical = {p.name: 0.0 if p.amplitude else p.typical for p in find_effect_kind(kind_and_target.partition(".")[0]).parameters}
    before = parameters.get(number, typical.get(number, 0.0))
    return _Place(table="effect", key=row["id"], row=kind_and_target, column="parameters", before=float(before), inside=number)


def model_digest(path: Path) -> str:
    """SHA-256 of all rows that a simulation depends on; pictures, recordings, results and findings leave it as it is."""
    found = hashlib.sha256()
    with reading(path) as connection:
        tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%' ORDER BY name")
        for table in [row["name"] for row in tables]:
            if table not in NOT_MODEL:
                found.update(table.encode())
                for row in connection.execute(f"SELECT * FROM {table} ORDER BY rowid"):
                    found.update(repr(tuple(row)).encode())
    return found.hexdigest()
