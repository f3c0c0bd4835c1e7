"""What is wrong with the rows of a file, asked of SQLite and of the schema, each in a sentence."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

# Rules that SQL's CHECKs cannot say, each as a query whose rows are the offenders (column `subject`) and a sentence.
RULES = (
    (
        "SELECT name AS subject FROM body WHERE id NOT IN (SELECT child_body_id FROM joint) LIMIT -1 OFFSET 1",
        "body '{subject}' hangs on nothing, and it is not the only one; join all but one by joints",
    ),
    (
        "SELECT wheel.name AS subject FROM wheel JOIN joint ON joint.id = joint_id WHERE kind <> 'hinge'",
        "wheel '{subject}' turns on a joint that is not a hinge",
    ),
    (
        "SELECT joint.name AS subject FROM joint_limit JOIN joint ON joint.id = joint_id WHERE kind NOT IN ('hinge', 'prismatic')",
        "joint '{subject}' has a limit but neither turns nor slides about one axis",
    ),
    (
        "SELECT differential.name AS subject FROM differential JOIN joint ON joint.id IN (joint_a_id, joint_b_id) "
        "WHERE kind <> 'hinge' OR parent_body_id IS NOT carrier_body_id",
        "differential '{subject}' needs two hinges on its carrier",
    ),
    (
        "SELECT name AS subject FROM terrain WHERE (SELECT coalesce(sum(n_rows * n_cols), 0) FROM terrain_tile "
        "WHERE terrain_id = terrain.id AND layer = 'height' AND level = 0) < n_rows * n_cols",
        "terrain '{subject}' has cells without a tile",
    ),
    (
        "SELECT soil.name AS subject FROM soil WHERE id IN (SELECT soil_id FROM terrain UNION SELECT soil_id FROM soil_patch) "
        "AND id NOT IN (SELECT soil_id FROM material_pair WHERE soil_id IS NOT NULL)",
        "soil '{subject}' is used but no material_pair says how wheels respond to it",
    ),
)


def problems(path: Path, schema: str) -> list[str]:
    """What is damaged in a database of the present version: pages, columns, CHECKs, references, and what CHECKs cannot say.

    Parameters
    ----------
    schema : the SQL that makes a fresh database, whose tables and columns the file must have.
    """
    found: list[str] = []
    try:
        # SQLite leaves CHECKs out on connections that only read (its sqlite3AddCheckConstraint): this one could write, and is told not to.
        with closing(sqlite3.connect(path, timeout=10)) as connection:
            connection.execute("PRAGMA query_only = ON")
            connection.text_factory = lambda text: text.decode(errors="replace")
            found.extend(_asked(connection, schema))  # what was found stays, though the next question fails
    except sqlite3.Error as error:
        found.append(f"it cannot be read: {error}")
    return found


def _asked(connection: sqlite3.Connection, schema: str) -> Iterator[str]:
    yield from (f"the file is damaged: {row[0]}" for row in connection.execute("PRAGMA integrity_check") if row[0] != "ok")
    with closing(sqlite3.connect(":memory:")) as fresh:
        fresh.executescript(schema)
        expected, held = columns(fresh), columns(connection)
    for table, names in expected.items():
        if table not in held:
            yield f"table {table} is missing"
        elif missing := set(names) - set(held[table]):
            yield f"table {table} lacks column {', '.join(sorted(missing))}"
    yield from (
        f"row {row[1]} of table {row[0]} refers to a row of {row[2]} that does not exist"
        for row in connection.execute("PRAGMA foreign_key_check")
    )
    for query, sentence in RULES:
        yield from (sentence.format(subject=row[0]) for row in connection.execute(query))


def tables(connection: sqlite3.Connection) -> list[str]:
    """Names of the tables that are ours, not SQLite's."""
    return [row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")]


def columns(connection: sqlite3.Connection) -> dict[str, list[str]]:
    """Names of the columns of every table."""
    return {
        table: [row[0] for row in connection.execute("SELECT name FROM pragma_table_info(?)", (table,))] for table in tables(connection)
    }
