"""What is built anew takes away only what was built of it before."""

import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest

from machines import cart, plane
from rille import store
from rille.model import Command, Scenario


def change(path, *statements):
    with closing(sqlite3.connect(path)) as connection, connection:
        for statement in statements:
            connection.execute(statement)


def found(path, question):
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(question).fetchall()


SCENARIO_OF_RECORDING = "SELECT scenario.name FROM recording LEFT JOIN scenario ON scenario.id = scenario_id"


@pytest.fixture
def recorded(make_model):
    """A model with a scenario and a recording of it."""
    scenario = Scenario(name="s", duration=1.0, gravity=(0, 0, -1.6), terrain="plane", placement="on_terrain")
    path = make_model(cart(5.0, 0.15, 0.165), scenario, plane())
    change(path, "INSERT INTO recording (name, scenario_id) SELECT 'seen', id FROM scenario")
    return path, scenario


def test_a_scenario_that_is_changed_keeps_its_recordings(recorded):
    path, scenario = recorded
    command = Command(drive="wheel_front_left", time=0.0, value=0.5)
    store.write_scenario(path, replace(scenario, duration=2.0, commands=(command,)))
    assert store.read_scenario(path, "s").duration == 2.0
    assert found(path, SCENARIO_OF_RECORDING) == [("s",)]


def test_a_rover_or_terrain_that_is_replaced_leaves_recordings_without_scenario(recorded):
    path, scenario = recorded
    store.write_rover(path, cart(6.0, 0.15, 0.165), replace=True)
    assert found(path, SCENARIO_OF_RECORDING) == [(None,)]
    store.write_scenario(path, scenario)
    change(path, "UPDATE recording SET scenario_id = (SELECT id FROM scenario)")
    store.write_terrain(path, plane(0.1), replace=True)
    assert store.scenario_names(path) == ()
    assert found(path, SCENARIO_OF_RECORDING) == [(None,)]


def test_contacts_of_the_terrain_outlast_a_rover(make_model):
    """The wheels' material is written anew, and what the terrain says of it stays."""
    path = make_model(cart(5.0, 0.15, 0.165), Scenario(name="s", duration=1.0))
    change(
        path,
        "INSERT INTO material (name, density, provenance) VALUES ('tyre', 1000, 'stated'), ('hull', 1000, 'stated')",
        "INSERT INTO material_pair (material_id, response, friction) SELECT id, 'rigid', 0.9 FROM material WHERE name = 'tyre'",
    )
    store.write_rover(path, cart(6.0, 0.15, 0.165), replace=True)
    assert found(path, "SELECT name, friction FROM material_pair JOIN material ON material.id = material_id") == [("tyre", 0.9)]
    assert found(path, "SELECT count(*) FROM material WHERE name = 'hull'") == [(0,)]


def test_a_file_is_the_one_that_its_name_says(make_model, tmp_path):
    """Names with signs that mean something in a URI."""
    path = make_model(cart(5.0, 0.15, 0.165), Scenario(name="s", duration=1.0))
    (tmp_path / "trial1.db").write_bytes(b"another file")
    for name in ("trial%31.db", "a#1.db", "a?b=c.db"):
        (tmp_path / name).write_bytes(path.read_bytes())
        assert store.scenario_names(tmp_path / name) == ("s",)
    assert not (tmp_path / "a").exists()
