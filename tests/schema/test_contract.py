"""The contract: units in every column, physics in the CHECKs, names in the views, refusals that change nothing."""

import re
import sqlite3
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from machines import LUNAR_SOIL, box, cart, plane
from rille import store
from rille.model import (
    Differential,
    Drive,
    Gear,
    Grouser,
    InputRefused,
    Joint,
    JointLimit,
    LoopClosure,
    Material,
    Mesh,
    Part,
    PartInstance,
    Pose,
    Rover,
    Scenario,
    SoilPatch,
    SourceFile,
)


@pytest.fixture
def database(tmp_path):
    """An empty database."""
    path = tmp_path / "model.db"
    store.create(path)
    return path


def test_every_column_carries_its_unit(database):
    """SQLite keeps the comments of a table's columns; `rille db info --units` reads them from the file itself."""
    with closing(sqlite3.connect(database)) as connection:
        tables = [r[0] for r in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        kept = store.units(database)
        for table in tables:
            columns = [r[1] for r in connection.execute(f"PRAGMA table_info({table})")]
            for column in columns:
                assert re.match(r"\[[^\]]+\] \S", kept[table].get(column, "")), f"{table}.{column} has no `-- [unit] meaning`"


def test_every_table_is_strict_and_the_header_is_ours(database):
    with closing(sqlite3.connect(database)) as connection:
        for name, strict in connection.execute("SELECT name, strict FROM pragma_table_list WHERE type = 'table' AND schema = 'main'"):
            assert strict or name.startswith("sqlite_"), name
        assert connection.execute("PRAGMA application_id").fetchone()[0] == int.from_bytes(b"RILL")
        assert connection.execute("PRAGMA user_version").fetchone()[0] == store.schema_version()


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE body SET mass = 0",
        "UPDATE body SET mass = -1",
        "UPDATE body SET ixx = 0",
        "UPDATE body SET ixx = iyy + izz + 1",
        "UPDATE joint SET axis_y = 2",
        "UPDATE joint SET parent_body_id = child_body_id",
        "UPDATE wheel SET radius = 0",
        "UPDATE wheel SET joint_id = 999",
        "UPDATE drive SET max_torque = 0",
        "UPDATE soil SET friction_angle = 1.6",
        "UPDATE soil SET cohesion = -1",
        "UPDATE soil SET sinkage_exponent = 0",
        "UPDATE terrain SET posting_x = 0",
        "UPDATE terrain_tile SET n_rows = n_rows + 1",
        "UPDATE material_pair SET response = 'rigid'",
        "UPDATE scenario SET step = 0",
        "UPDATE scenario SET gravity_z = NULL",
        "UPDATE scenario SET name = 5.5e0 || ''",
    ],
)
def test_physics_that_cannot_be_is_refused_by_the_file_itself(database, change):
    """Somebody who writes by hand is stopped by SQLite, whatever program they use."""
    store.write_rover(database, cart(5.0, 0.15, 0.165))
    store.write_terrain(database, plane())
    store.write_scenario(database, Scenario(name="s", duration=1, terrain="plane", placement="on_terrain"))
    with closing(sqlite3.connect(database)) as connection:
        connection.execute("PRAGMA foreign_keys = ON")
        if change.endswith("|| ''"):
            connection.execute(change)  # a text is a text: the control that shows that updates work at all
        else:
            with pytest.raises(sqlite3.IntegrityError):
                connection.execute(change)


def full_rover() -> Rover:
    """A rover that uses every table."""
    rover = cart(5.0, 0.15, 0.165)
    triangle = Mesh(vertices=np.eye(3, dtype=np.float32), triangles=np.array([[0, 1, 2]], np.int32), tolerance=1e-3)
    part = Part(
        name="plate", volume=1e-3, properties=box("x", 2.7, (0, 0, 0), (0.1, 0.1, 0.1)).properties, material="steel", meshes=(triangle,)
    )
    wheels = (replace(rover.wheels[0], material="steel", grouser=Grouser(count=24, height=0.01, thickness=0.005)), *rover.wheels[1:])
    joints = (*rover.joints[:3], replace(rover.joints[3], limit=JointLimit(lower=-1.0, upper=2.0, provenance="measured")))
    drives = (Drive(name="d", joint=joints[0].name, mode="position", max_torque=1.0, max_speed=0.5, position_gain=3.0),)
    return replace(
        rover,
        materials=(Material(name="steel", density=7850.0, source="nominal"),),
        parts=(part,),
        instances=(PartInstance(path="a/plate", part="plate", body="chassis", pose=Pose(position=(1, 2, 3))),),
        joints=joints,
        drives=drives,
        wheels=wheels,
        differentials=(Differential(name="diff", carrier="chassis", joint_a=joints[0].name, joint_b=joints[1].name),),
        gears=(Gear(name="gear", joint_a=joints[0].name, joint_b=joints[2].name, ratio=-2.0),),
        loop_closures=(LoopClosure(name="loop", body_a="chassis", body_b=None, point=(0, 0, 1)),),
        sources=(SourceFile(subject="rover", file="x.step", sha256="0" * 64, tool="test"),),
    )


def test_a_rover_comes_back_as_it_went_in(database):
    rover = full_rover()
    store.write_rover(database, rover)
    back = store.read_rover(database)
    for field in ("materials", "joints", "drives", "differentials", "gears", "loop_closures", "wheels", "instances", "sources"):
        assert getattr(back, field) == getattr(rover, field), field
    assert np.array_equal(back.parts[0].meshes[0].vertices, rover.parts[0].meshes[0].vertices)
    for mine, read in zip(rover.bodies, back.bodies, strict=True):
        assert mine.name == read.name
        assert np.array_equal(mine.properties.inertia, read.properties.inertia)


def test_a_terrain_comes_back_as_it_went_in(database):
    soft = replace(LUNAR_SOIL, name="soft", cohesion=0.0)
    terrain = replace(
        plane(0.1, -0.2),
        soils=(LUNAR_SOIL, soft),
        patches=(SoilPatch(name="p", soil="soft", polygon=((0.0, 0.0), (1.0, 0.0), (0.5, 2.0))),),
        crs="EPSG:32633",
        map_origin=(1.0, 2.0, 3.0),
    )
    terrain = replace(terrain, pairs=(*terrain.pairs, replace(terrain.pairs[0], soil="soft")))
    store.write_terrain(database, terrain)
    back = store.read_terrain(database)
    assert np.array_equal(back.heights, terrain.heights)
    assert replace(back, heights=terrain.heights) == terrain


def test_tiles_of_a_large_terrain_meet_without_a_seam(database):
    """More than one tile each way, and no multiple of the tile's size."""
    heights = np.random.default_rng(0).standard_normal((1500, 1100))
    store.write_terrain(database, replace(plane(), heights=heights))
    assert np.array_equal(store.read_terrain(database).heights, heights)


def test_a_refused_rover_leaves_the_old_one(database):
    rover = cart(5.0, 0.15, 0.165)
    store.write_rover(database, rover)
    before = database.read_bytes()
    chassis = replace(rover.bodies[0], properties=replace(rover.bodies[0].properties, mass=0.0))
    with pytest.raises(InputRefused, match=r"body 'chassis'.*mass > 0"):
        store.write_rover(database, replace(rover, bodies=(chassis, *rover.bodies[1:])))
    flat = replace(rover.bodies[0].properties, inertia=np.diag([1.0, 1.0, 5.0]))
    with pytest.raises(InputRefused, match="triangle inequality"):
        store.write_rover(database, replace(rover, bodies=(replace(rover.bodies[0], properties=flat), *rover.bodies[1:])))
    stray = Joint(name="stray", kind="hinge", parent="chasis", child="wheel_front_left", point=(0, 0, 0))
    with pytest.raises(InputRefused, match="did you mean 'chassis'"):
        store.write_rover(database, replace(rover, joints=(stray, *rover.joints[1:])))
    assert database.read_bytes() == before


def test_what_was_made_for_a_refused_rover_is_removed_again(tmp_path):
    """With what SQLite keeps beside it; a database that was there before is not."""
    rover = cart(5.0, 0.15, 0.165)
    bad = replace(rover, joints=(Joint(name="stray", kind="hinge", parent="chasis", child="wheel_front_left", point=(0, 0, 0)),))
    path = tmp_path / "new.db"
    with pytest.raises(InputRefused, match="chasis"), store.made_if_absent(path):
        store.write_rover(path, bad)
    assert list(tmp_path.iterdir()) == []
    with store.made_if_absent(path):
        store.write_rover(path, rover)
    with pytest.raises(InputRefused, match="chasis"), store.made_if_absent(path):
        store.write_rover(path, bad)
    assert store.read_rover(path) is not None


def test_results_are_not_thrown_away_by_accident(database):
    rover = cart(5.0, 0.15, 0.165)
    store.write_rover(database, rover)
    store.write_terrain(database, plane())
    scenario = Scenario(name="s", duration=1, terrain="plane", placement="on_terrain")
    store.write_scenario(database, scenario)
    store.write_scenario(database, scenario)  # the same again is no change
    with closing(sqlite3.connect(database)) as connection:
        connection.execute("INSERT INTO run (scenario_id, solver, step, status) VALUES (1, 'x', 0.001, 'done')")
        connection.commit()
    with pytest.raises(InputRefused, match="--force"):
        store.write_rover(database, rover)
    with pytest.raises(InputRefused, match="--force"):
        store.write_terrain(database, plane(0.3))
    with pytest.raises(InputRefused, match="--force"):
        store.write_scenario(database, replace(scenario, duration=2))
    assert len(store.list_runs(database)) == 1
    store.write_scenario(database, replace(scenario, duration=2), replace=True)
    assert store.list_runs(database) == []


def test_check_names_what_does_not_hang_together(database):
    store.write_rover(database, cart(5.0, 0.15, 0.165))
    store.write_terrain(database, plane())
    assert store.check(database) == []
    with closing(sqlite3.connect(database)) as connection:
        connection.execute("DELETE FROM material_pair")
        connection.execute("DELETE FROM terrain_tile")
        connection.execute("DELETE FROM joint WHERE id = 1")
        connection.commit()
    problems = " ".join(store.check(database))
    for word in ("material_pair", "without a tile", "hangs on nothing", "refers to a row of joint"):
        assert word in problems


@pytest.mark.parametrize(
    ("target", "parameters", "words"),
    [
        ("wheel_front_left", '{"torque": -1}', "must lie in"),
        ("nowhere", '{"torque": 0.1}', "which the model does not have"),
        ("*", "[1]", "give a JSON object"),
        ("*", '{"torque": "much"}', "give a number in N m"),
    ],
)
def test_check_names_effects_that_every_run_refuses(database, target, parameters, words):
    """Written by SQL, past the store's own refusals."""
    store.write_rover(database, cart(5.0, 0.15, 0.165))
    with closing(sqlite3.connect(database)) as connection:
        law = "SELECT id, ?, ? FROM effect_kind WHERE name = 'coulomb_friction'"
        connection.execute(f"INSERT INTO effect (effect_kind_id, target, parameters) {law}", (target, parameters))
        connection.commit()
    assert words in " ".join(store.check(database))


def damaged(tmp_path, database):
    """Files that are no database of this version, by name."""
    files = {name: tmp_path / f"{name}.db" for name in ("text", "foreign", "newer", "truncated", "empty")}
    files["text"].write_text("SELECT 1;" * 100)
    files["empty"].write_bytes(b"")
    with closing(sqlite3.connect(files["foreign"])) as connection:
        connection.execute("CREATE TABLE body (x)")
        connection.commit()
    for name in ("newer", "truncated"):
        files[name].write_bytes(database.read_bytes())
    with closing(sqlite3.connect(files["newer"])) as connection:
        connection.execute(f"PRAGMA user_version = {store.schema_version() + 1}")
        connection.commit()
    files["truncated"].write_bytes(database.read_bytes()[: 3 * 4096 + 100])
    return files


WORDS = {
    "text": "not an SQLite database",
    "empty": "not an SQLite database",
    "foreign": "another program",
    "newer": "upgrade rille",
    "truncated": "restore",
}


@pytest.mark.parametrize("name", WORDS)
def test_strangers_are_refused_in_one_sentence_and_keep_every_byte(tmp_path, database, name):
    store.write_rover(database, cart(5.0, 0.15, 0.165))
    file = damaged(tmp_path, database)[name]
    before = file.read_bytes()
    for attempt in (store.read_rover, store.check, store.info, store.migrate, lambda p: store.write_rover(p, Rover())):
        with pytest.raises(InputRefused, match=WORDS[name]) as refusal:
            attempt(file)
        assert "\n" not in str(refusal.value)
    assert file.read_bytes() == before
