"""A drive does more or less than it is told."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille import store
from rille.model import Effect


@pytest.mark.parametrize("mode", ["speed", "torque", "position"])
def test_the_motion_is_that_of_a_larger_command(make_model, mode):
    """By definition; the products of gain and command are the same numbers, so that nothing but rounding may differ: 1e-12."""
    off = make_model(flywheel(2.0, mode), commanded(0.8), None, [Effect(kind="command_gain", parameters={"relative_error": 0.25})])
    larger = make_model(flywheel(2.0, mode), commanded(0.8 * 1.25), None, [])
    seen = [sample(path, 1000, ("joint.velocity", "hub"), every=50)[:, 0] for path in (off, larger)]
    assert np.ptp(seen[0]) > 0 or seen[0][0] != 0
    assert seen[0] == pytest.approx(seen[1], rel=1e-12, abs=1e-15)


def test_a_torque_of_another_size(make_model):
    """I w = (1 + e) tau t; the step integrates a constant torque exactly but for rounding: 1e-9."""
    path = make_model(flywheel(2.0, "torque"), commanded(3.0), None, [Effect(kind="command_gain", parameters={"relative_error": -0.3})])
    assert sample(path, 1000, ("joint.velocity", "hub"), every=1000)[0, 0] == pytest.approx(0.7 * 3.0 / 2.0, rel=1e-9)


def test_a_database_from_before_the_law_learns_it(make_model):
    """The catalogue grows within one version of the schema: a file that lacks the row is given it when the effect is written."""
    path = make_model(flywheel(2.0, "torque"), commanded(3.0), None, [])
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("DELETE FROM effect_parameter WHERE effect_kind_id = (SELECT id FROM effect_kind WHERE name = 'command_gain')")
        connection.execute("DELETE FROM effect_kind WHERE name = 'command_gain'")
        connection.commit()
    store.add_effect(path, Effect(kind="command_gain", target="hub", parameters={"relative_error": 1.0}))
    assert sample(path, 1000, ("joint.velocity", "hub"), every=1000)[0, 0] == pytest.approx(3.0, rel=1e-9)
