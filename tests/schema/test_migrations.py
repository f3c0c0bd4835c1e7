"""Fresh = migrated, and a migration that fails leaves nothing behind."""

import re
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from rille import store
from rille.model import InputRefused
from rille.store.database import apply_step

HERE = Path(__file__).parent
FROZEN = sorted(HERE.glob("created_v*.sql"))
OLD_VIEWS = HERE / "views_v4.sql"  # of versions 1 to 4: rows and names that old files hold


def views_of(version):
    """The views of a released version: those of the first file that reaches it, else today's."""
    for last in (4, 8):
        if version <= last:
            return HERE / f"views_v{last}.sql"
    return Path(store.database.schema_folder()) / "views.sql"


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
        connection.executescript(views_of(int(frozen.stem.removeprefix("created_v"))).read_text())
    store.create(fresh)
    version = int(frozen.stem.removeprefix("created_v"))
    assert store.migrate(old) == (version, store.schema_version())
    assert shape(old) == shape(fresh)


def test_what_a_version_1_database_holds_is_kept(tmp_path):
    """Rows of every table that version 2 makes anew; references to them still hold."""
    path = tmp_path / "old.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(FROZEN[0].read_text())
        connection.executescript(OLD_VIEWS.read_text())
        connection.executescript(OLD_ROWS)
    store.migrate(path)
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT name, max_torque, integral_gain, speed_gain FROM drive").fetchall() == [("motor", 5.0, 0.0, None)]
        assert connection.execute("SELECT quantity, rate, frame FROM sensor").fetchall() == [("joint.velocity", 50.0, "world")]
        assert connection.execute("SELECT response, friction FROM material_pair").fetchall() == [("rigid", 0.5)]
        assert connection.execute("SELECT status, step, duration FROM run").fetchall() == [("done", 0.001, None)]
        assert connection.execute("SELECT count(*) FROM joint_trace").fetchone() == (1,)
        assert connection.execute("SELECT count(*) FROM effect_kind").fetchone()[0] > 40
        assert connection.execute("SELECT name FROM sqlite_master WHERE name LIKE 'old_%'").fetchall() == []
    assert [drive.name for drive in store.read_rover(path).drives] == ["motor"]


OLD_GROUND = """
INSERT INTO soil (id, name, sinkage_exponent, cohesive_modulus, frictional_modulus, cohesion, friction_angle, shear_modulus,
  lateral_shear_modulus, peak_angle_offset, peak_angle_slip, density, provenance)
VALUES (7, 'sand', 1, 1400, 820000, 170, 0.6, 0.018, 0.018, 0.4, 0.15, 1500, 'stated');
INSERT INTO terrain (id, name, soil_id, n_rows, n_cols, posting_x, posting_y, x_west, y_north, crs, map_x, map_y, map_z, source)
VALUES (4, 'old', 7, 2, 3, 0.5, 0.25, -1, 2, 'EPSG:32633', 10, 20, 30, 'by hand');
INSERT INTO terrain_tile (terrain_id, layer, row0, col0, n_rows, n_cols, dtype, data)
VALUES (4, 'height', 0, 0, 2, 3, 'float32', x'0000803f000000400000404000008040000080400000c07f');
INSERT INTO soil_patch (terrain_id, soil_id, name, polygon) VALUES (4, 7, 'p', '[[0,0],[1,0],[0,1]]');
INSERT INTO landform_instance (id, terrain_id, name, landform, x, y, heading, drivers)
VALUES (5, 4, 'first', 'crater', 1, 2, 0.5, '{"diameter": 8.0}'), (6, 4, 'second', 'mound', 3, 4, 0, '{}');
INSERT INTO scenario (id, name, terrain_id, gravity_z, duration, step, output_interval, placement)
VALUES (1, 's', 4, -9.8, 2, 0.001, 0.01, 'on_terrain');
"""


def test_what_a_version_3_database_holds_is_kept(tmp_path):
    """Ground, tiles and landforms, which version 4 makes anew; scenarios and patches still refer to them. The tile is float32, by hand:
    1 2 3 / 4 4 NaN."""
    path = tmp_path / "old.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript((Path(__file__).parent / "created_v3.sql").read_text())
        connection.executescript(OLD_VIEWS.read_text())
        connection.executescript(OLD_GROUND)
    assert store.migrate(path) == (3, store.schema_version())
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT name FROM sqlite_master WHERE name LIKE 'old_%'").fetchall() == []
        assert connection.execute("SELECT layer, level, n_rows, n_cols FROM terrain_tile").fetchall() == [("height", 0, 2, 3)]
        assert connection.execute("SELECT id, terrain_id FROM scenario").fetchall() == [(1, 4)]
    ground = store.read_terrain(path, "old")
    assert ground.heights == pytest.approx(np.array([[1, 2, 3], [4, 4, np.nan]]), nan_ok=True)
    assert (ground.map_origin, ground.map_heading, ground.crs, ground.source) == ((10, 20, 30), 0.0, "EPSG:32633", "by hand")
    assert [(f.name, f.x, f.heading, f.scale, f.soil, f.age, f.drivers) for f in ground.landforms] == [
        ("first", 1.0, 0.5, 1.0, "", None, {"diameter": 8.0}),
        ("second", 3.0, 0.0, 1.0, "", None, {}),
    ]
    assert [p.polygon for p in ground.patches] == [((0, 0), (1, 0), (0, 1))]


OLD_RECORDING = """
INSERT INTO recording (id, name, source) VALUES (3, 'drive', 'drive.csv');
INSERT INTO channel (id, recording_id, name, quantity, target, unit, role, noise)
VALUES (8, 3, 'q', 'joint.position', 'hinge', 'rad', 'observed', 0.01), (9, 3, 'u', 'joint.effort', 'hinge', 'N m', 'command', NULL);
INSERT INTO sample SELECT 8, value / 64.0, iif(value = 5, NULL, value * value / 3.0) FROM generated;
INSERT INTO sample VALUES (9, 0.5, -2);
INSERT INTO finding (id, recording_id, verdict, detail) VALUES (1, 3, 'unknown', '{}');
"""


def test_what_a_version_4_database_holds_is_kept(tmp_path):
    """Recordings: 9 000 rows become three blocks, and the view shows the same numbers, to the last bit."""
    path = tmp_path / "old.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript((Path(__file__).parent / "created_v4.sql").read_text())
        connection.executescript(OLD_VIEWS.read_text())
        connection.execute("CREATE TEMP TABLE generated (value INTEGER)")
        connection.executemany("INSERT INTO generated VALUES (?)", [(k,) for k in range(9000)])
        connection.executescript(OLD_RECORDING)
    assert store.migrate(path) == (4, store.schema_version())
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
        assert connection.execute("SELECT name FROM sqlite_master WHERE name LIKE 'old_%'").fetchall() == []
        assert connection.execute("SELECT verdict FROM finding WHERE recording_id = 3").fetchall() == [("unknown",)]
        assert connection.execute("SELECT n FROM sample_block WHERE channel_id = 8 ORDER BY block").fetchall() == [(4096,), (4096,), (808,)]
        rows = connection.execute("SELECT number, time, value FROM sample WHERE channel = 'q' ORDER BY number").fetchall()
    assert rows == [(k, k / 64.0, None if k == 5 else k * k / 3.0) for k in range(9000)]
    kept = store.read_recording(path, "drive")
    assert [(c.name, c.quantity, c.role, c.noise) for c in kept.channels] == [
        ("q", "joint.position", "observed", 0.01),
        ("u", "joint.effort", "command", None),
    ]
    assert kept.channel("u").value.tolist() == [-2.0]


OLD_FINDINGS = """
INSERT INTO body (id, name, mass, com_x, com_y, com_z, ixx, iyy, izz, mass_provenance, inertia_provenance)
VALUES (1, 'rod', 1.2, 0, 0, -0.5, 0.1, 0.1, 0.0001, 'stated', 'stated');
INSERT INTO joint (id, name, kind, parent_body_id, child_body_id, x, y, z, axis_x, axis_y, axis_z)
VALUES (1, 'hinge', 'hinge', NULL, 1, 0, 0, 0, 0, 1, 0);
INSERT INTO effect_kind (id, name, family, target, passive, channel, equation, meaning, source)
VALUES (70, 'coulomb_friction', 'drive', 'joint', 1, 'c', 'e', 'm', 's'), (71, 'motor_lag', 'drive', 'joint', 1, 'c', 'e', 'm', 's');
INSERT INTO effect_parameter VALUES (70, 'torque', 'N m', 1, 0, 1000, 0.5, 0.5, 'size');
INSERT INTO effect (id, effect_kind_id, target, parameters)
VALUES (5, 71, 'hinge', '{"time_constant": 0.1}'), (6, 70, '*', '{"torque": 2}');
INSERT INTO recording (id, name) VALUES (3, 'drive');
INSERT INTO finding (id, recording_id, verdict, target, detail)
VALUES (1, 3, 'coulomb_friction', 'hinge', '{}'), (2, NULL, 'nothing_missing', '', '[1]'), (4, 3, 'mass', '', '{}');
"""


def test_what_a_version_5_database_holds_is_kept(tmp_path):
    """Effects still refer to their laws, which know of memory and search now; findings have names."""
    path = tmp_path / "old.db"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript((Path(__file__).parent / "created_v5.sql").read_text())
        connection.executescript(views_of(5).read_text())
        connection.executescript(OLD_FINDINGS)
    assert store.migrate(path) == (5, store.schema_version())
    assert [(e.kind, e.target, dict(e.parameters)) for e in store.read_effects(path)] == [
        ("motor_lag", "hinge", {"time_constant": 0.1}),
        ("coulomb_friction", "*", {"torque": 2}),
    ]
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
        assert connection.execute("SELECT name FROM sqlite_master WHERE name LIKE 'old_%'").fetchall() == []
        rows = connection.execute("SELECT memory, needs FROM effect_kind WHERE id IN (70, 71) ORDER BY id").fetchall()
        assert rows == [(0, ""), (1, "drive")]
        assert connection.execute("SELECT name, verdict, target, recordings, detail FROM finding ORDER BY id").fetchall() == [
            ("diagnosis-1", "named", "coulomb_friction of hinge", '["drive"]', "{}"),
            ("diagnosis-2", "nothing_missing", "", "[]", "[1]"),
            ("diagnosis-4", "named", "mass", '["drive"]', "{}"),
        ]


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
