"""Fresh = migrated, and a migration that fails leaves nothing behind."""

import re
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from rille import store
from rille.model import InputRefused
from rille.store.database import apply_step

FROZEN = sorted(Path(__file__).parent.glob("created_v*.sql"))


def shape(path):
    """Every statement of a schema without spaces and comments: what a database is, whatever its history."""
    with closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT type, name, sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY type, name").fetchall()
    return [(kind, name, re.sub(r"\s+", " ", re.sub(r"--.*", "", sql)).strip()) for kind, name, sql in rows]


@pytest.mark.parametrize("frozen", FROZEN, ids=lambda f: f.stem)
def test_every_released_version_migrates_to_what_a_fresh_database_is(tmp_path, frozen):
    old, fresh = tmp_path / "old.db", tmp_path / "fresh.db"
    with closing(sqlite3.connect(old)) as connection:
        connection.executescript(frozen.read_text())
        connection.executescript((Path(store.database.schema_folder()) / "views.sql").read_text())
    store.create(fresh)
    version = int(frozen.stem.removeprefix("created_v"))
    assert store.migrate(old) == (version, store.schema_version())
    assert shape(old) == shape(fresh)


def test_the_newest_version_is_frozen_too():
    assert FROZEN[-1].stem == f"created_v{store.schema_version()}"
    assert [int(f.stem.removeprefix("created_v")) for f in FROZEN] == list(range(1, store.schema_version() + 1))


def test_a_step_is_applied_whole_or_not_at_all(tmp_path):
    path = tmp_path / "model.db"
    store.create(path)
    before = shape(path)
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        with pytest.raises(InputRefused, match="migration to version 2 failed"):
            apply_step(connection, 2, "CREATE TABLE novelty (x); INSERT INTO nowhere VALUES (1);")
        assert connection.execute("PRAGMA user_version").fetchone()[0] == 1
    assert shape(path) == before
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        apply_step(connection, 2, "CREATE TABLE novelty (x);")
        assert connection.execute("PRAGMA user_version").fetchone()[0] == 2


def test_a_version_without_a_step_is_refused(tmp_path):
    path = tmp_path / "ancient.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(FROZEN[0].read_text())
        connection.execute("PRAGMA user_version = 0")
        connection.commit()
    with pytest.raises(InputRefused, match="no migration to version 1"):
        store.migrate(path)
    with pytest.raises(InputRefused, match="rille db migrate"):
        store.read_rover(path)
