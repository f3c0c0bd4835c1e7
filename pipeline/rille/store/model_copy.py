"""A copy of what a simulation depends on, and nothing else: small enough to be sent to workers."""

import sqlite3
from contextlib import closing
from pathlib import Path

from rille.model import InputRefused
from rille.store.database import address, create, reading
from rille.store.model_digest import NOT_MODEL

OF_SCENARIOS = ("initial_state", "command", "state_change", "watch")  # tables whose rows belong to a scenario


def copy_model(path: Path, out: Path, scenario: str | None = None, *, without_scenarios: bool = False) -> None:
    """Copy a model into a new database, without pictures, recordings and results.

    scenario : keep only this one; None: all. without_scenarios : keep none.

    Raises
    ------
    InputRefused : as of ``create`` and of reading a database.
    """
    with reading(path) as connection:
        tables = [r["name"] for r in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")]
    create(out)
    try:
        with closing(sqlite3.connect(out, isolation_level=None, uri=True)) as connection:
            connection.execute("PRAGMA journal_mode = DELETE")  # one file, whose bytes are all
            connection.execute("ATTACH ? AS source", (address(path),))
            connection.execute("BEGIN")
            for table in tables:
                if table not in NOT_MODEL:
                    connection.execute(f"DELETE FROM {table}")
                    connection.execute(f"INSERT INTO {table} SELECT * FROM source.{table}")
            if scenario is not None or without_scenarios:
                _drop_scenarios(connection, scenario)
            connection.execute("COMMIT")
            connection.execute("DETACH source")
            connection.execute("VACUUM")
    except sqlite3.Error as error:
        Path(out).unlink(missing_ok=True)
        raise InputRefused(f"'{path}' could not be copied to '{out}': {error}; is the disk full?") from error


def _drop_scenarios(connection: sqlite3.Connection, kept: str | None) -> None:
    """Scenarios but one, and grounds that no scenario needs if one is kept."""
    for table in OF_SCENARIOS:
        connection.execute(f"DELETE FROM {table} WHERE scenario_id NOT IN (SELECT id FROM scenario WHERE name IS ?)", (kept,))
    connection.execute("DELETE FROM scenario WHERE name IS NOT ?", (kept,))
    if kept is not None:
        unused = "terrain_id NOT IN (SELECT terrain_id FROM scenario WHERE terrain_id IS NOT NULL)"
        for table in ("terrain_tile", "soil_patch", "obstacle", "landform_instance", "landform_population"):
            connection.execute(f"DELETE FROM {table} WHERE {unused}")
        connection.execute("DELETE FROM terrain WHERE id NOT IN (SELECT terrain_id FROM scenario WHERE terrain_id IS NOT NULL)")
