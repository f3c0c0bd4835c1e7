"""Scenarios that go."""

import sqlite3
from collections.abc import Sequence


def forget_scenarios(connection: sqlite3.Connection, which: str, values: Sequence[object] = ()) -> None:
    """Delete scenarios with their runs. Recordings of them stay, and are of no scenario.

    which : question for their ids, with its ``values``.
    """
    connection.execute(f"UPDATE recording SET scenario_id = NULL WHERE scenario_id IN ({which})", values)
    connection.execute(f"DELETE FROM scenario WHERE id IN ({which})", values)
