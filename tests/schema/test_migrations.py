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


OLD_ROWS = """
INSERT INTO material (id, name, density, provenance) VALUES (1, 'rock', 2700, 'stated'), (2, 'rubber', 1100, 'stated');
INSERT INTO material_pair (material_id, other_material_id, response) VALUES (1, 2, 'rigid');
INSERT INTO body (id, name, mass, com_x, com_y, com_z, ixx, iyy, izz, mass_provenance, inertia_provenance)
VALUES (1, 'rod', 1.2, 0, 0, -0.5, 0.1, 0.1, 0.0001, 'stated', 'stated');
INSERT INTO joint (id, name, kind, parent_body_id, child_body_id, x, y, z, axis_x, axis_y, axis_z)
VALUES (1, 'hinge', 'hinge', NULL, 1, 0, 0, 0, 0, 1, 0);
INSERT INTO drive (id, name, joint_id, mode, max_torque, provenance) VALUES (3, 'motor', 1, 'speed', 5, 'stated');
INSERT INTO sensor (name, quantity, target, rate) VALUES ('encoder', 'joint.velocity', 'hinge', 50);
INSERT INTO scenario (id, name, gravity_z, duration, step, output_interval, placement) VALUES (1, 's', -9.8, 2, 0.001, 0.01, 'as_given');
INSERT INTO command (scenario_id, drive_id, time, value) VALUES (1, 3, 0, 1);
INSERT INTO run (id, scenario_id, status, step, solver, time_reached) VALUES (1, 1, 'done', 0.001, 'rille-solver', 2);
INSERT INTO joint_state (run_id, time, joint_id, position, velocity, effort, work) VALUES (1, 0, 1, 0, 0, 0, 0);
"""


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


def test_what_a_version_1_database_holds_is_kept(tmp_path):
    """Rows of every table that version 2 makes anew; references to them still hold."""
    path = tmp_path / "old.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(FROZEN[0].read_text())
        connection.executescript((Path(store.database.schema_folder()) / "views.sql").read_text())
        connection.executescript(OLD_ROWS)
    store.migrate(path)
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT name, max_torque, integral_gain, speed_gain FROM drive").fetchall() == [("motor", 5.0, 0.0, None)]
        assert connection.execute("SELECT quantity, rate, frame FROM sensor").fetchall() == [("joint.velocity", 50.0, "world")]
        assert connection.execute("SELECT response, friction FROM material_pair").fetchall() == [("rigid", 0.5)]
        assert connection.execute("SELECT status, step FROM run").fetchall() == [("done", 0.001)]
        assert connection.execute("SELECT count(*) FROM joint_trace").fetchone() == (1,)
        assert connection.execute("SELECT count(*) FROM effect_kind").fetchone()[0] > 40
        assert connection.execute("SELECT name FROM sqlite_master WHERE name LIKE 'old_%'").fetchall() == []
    assert [drive.name for drive in store.read_rover(path).drives] == ["motor"]


def test_the_newest_version_is_frozen_too():
    assert FROZEN[-1].stem == f"created_v{store.schema_version()}"
    assert [int(f.stem.removeprefix("created_v")) for f in FROZEN] == list(range(1, store.schema_version() + 1))


def test_a_step_is_applied_whole_or_not_at_all(tmp_path):
    path = tmp_path / "model.db"
    store.create(path)
    before = shape(path)
    newer = store.schema_version() + 1
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        with pytest.raises(InputRefused, match=f"migration to version {newer} failed"):
            apply_step(connection, newer, "CREATE TABLE novelty (x); INSERT INTO nowhere VALUES (1);")
        assert connection.execute("PRAGMA user_version").fetchone()[0] == newer - 1
    assert shape(path) == before
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        apply_step(connection, newer, "CREATE TABLE novelty (x);")
        assert connection.execute("PRAGMA user_version").fetchone()[0] == newer


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
