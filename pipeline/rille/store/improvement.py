"""A copy of a model with other numbers and more effects: what a diagnosis proposes, as rows."""

import hashlib
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path

from rille.model import Effect, InputRefused, Soil, SourceFile
from rille.model.finding import RowChange
from rille.store.database import reading, remove_database, writing
from rille.store.effects import find_effect_kind, insert_effect
from rille.store.health import units
from rille.store.parameter_places import Place, Places, unit_of
from rille.store.rover import write_sources
from rille.store.terrain import write_soil
from rille.store.track_width import spread_wheels, track_width

TRACK_WIDTH = "track_width"  # parameter that many rows make together
RESULTS = ("run", "bench_point")  # belong to the model as it was


def parameter_values(path: Path, names: Iterable[str], scenario: str | None = None, soils: Sequence[Soil] = ()) -> dict[str, float]:
    """Values that parameters of the solver have in a database [SI], by name.

    names : "soil.lunar.cohesion", "drive.hub.max_torque", "track_width". scenario : whose gravity is meant; None: the only one.
    soils : that the database does not hold but would.

    Raises
    ------
    InputRefused : for a parameter that no row of the database holds.
    """
    with reading(path) as connection:
        places = Places(connection=connection, path=path, scenario=scenario, soils=soils)
        return {name: track_width(connection) if name == TRACK_WIDTH else places.find(name).value for name in dict.fromkeys(names)}


def planned_changes(
    path: Path, effects: Sequence[Effect], parameters: Mapping[str, float], scenario: str | None = None, soils: Sequence[Soil] = ()
) -> tuple[RowChange, ...]:
    """What :func:`improve` would change: one row per number, effects first. Parameters and errors as there."""
    columns = units(path)
    changes = []
    with reading(path) as connection:
        places = Places(connection=connection, path=path, scenario=scenario, others=parameters, soils=soils)
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
            place = places.find(name)
            changes.append(
                RowChange(
                    table=place.table,
                    row=place.row,
                    column=place.name,
                    before=place.before,
                    after=place.factor * value,
                    unit=unit_of(place, columns),
                )
            )
    return tuple(changes)


def improve(
    source: Path,
    target: Path,
    effects: Sequence[Effect],
    parameters: Mapping[str, float],
    *,
    why: str,
    tool: str,
    scenario: str | None = None,
    soils: Sequence[Soil] = (),
) -> None:
    """Copy the database ``source`` to ``target``, with these effects added and these parameters changed.

    Runs and bench points are left behind: they belong to the model as it was. Recordings and findings go along. Changed rows say that they
    are ``measured`` and ``calibrated by`` ``why``; table provenance names the source file, its digest and ``tool``.

    Parameters
    ----------
    parameters : parameter of the solver -> its new value [SI]. scenario : whose gravity is meant by ``gravity.z``; None: the only one.
    soils : that the model did not hold and now does, before they change.

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
    remove_database(unfinished)
    try:
        with reading(source) as original, closing(sqlite3.connect(unfinished)) as copy:
            original.backup(copy)
            copy.execute("PRAGMA journal_mode = WAL")
        with writing(unfinished) as connection:
            for table in RESULTS:
                connection.execute(f"DELETE FROM {table}")
            for soil in soils:
                write_soil(connection, soil)
            places = Places(connection=connection, path=source, scenario=scenario, others=parameters)
            rows: dict[tuple[str, int], list[tuple[Place, float]]] = {}
            for name, value in parameters.items():
                if name == TRACK_WIDTH:
                    spread_wheels(connection, value)
                else:
                    place = places.find(name)
                    rows.setdefault((place.table, place.key), []).append((place, place.factor * value))
            for numbers in rows.values():
                _change(connection, numbers, why)
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
        remove_database(unfinished)


def _digest(path: Path) -> str:
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _change(connection: sqlite3.Connection, numbers: Sequence[tuple[Place, float]], why: str) -> None:
    """Numbers of one row, together: three moments of inertia must go with each other (a triangle), not each with the old ones."""
    table, row, key = numbers[0][0].table, numbers[0][0].row, numbers[0][0].key
    whole = [(place.column, after) for place, after in numbers if not place.inside]
    try:
        if whole:
            columns = ", ".join(f"{column} = ?" for column, _ in whole)
            connection.execute(f"UPDATE {table} SET {columns} WHERE id = ?", (*(after for _, after in whole), key))
        for place, after in numbers:
            if place.inside:
                statement = f"UPDATE {table} SET {place.column} = json_set({place.column}, ?, ?) WHERE id = ?"
                connection.execute(statement, (f'$."{place.inside}"', after, key))
            _mark(connection, place, why)
    except sqlite3.IntegrityError as error:
        listed = ", ".join(f"{place.name} = {after:g}" for place, after in numbers)
        raise InputRefused(f"{table} '{row}' cannot have {listed}: {error}; the finding was made with another model") from error


def _mark(connection: sqlite3.Connection, place: Place, why: str) -> None:
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
