"""The sensor is late."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

from effect_rigs import flywheel, sensed, spinning
from rille.model import Effect, Sensor
from rille.simulate import run


def test_the_reading_is_distorted_as_the_law_says(make_model):
    """The flywheel turns at 2 rad/s, so that the angle is 2 t; the rigid servo's start costs 1e-6."""
    times, values = sensed(make_model, Effect(kind="delay", target="encoder", parameters={"delay": 0.0437}))
    true = 2.0 * np.arange(101) / 100
    assert times == pytest.approx(np.arange(101) / 100, abs=1e-9)
    # linear between steps, and the first value before anything is known
    assert values == pytest.approx(np.maximum(0, true - 2 * 0.0437), abs=1e-5)


def test_a_late_orientation_is_one_while_the_body_turns_over(make_model):
    """At half a turn the quaternion with w >= 0 changes its sign, and what is read between two steps must not mix both: 2 rad/s, steps of 1
    ms, chords of 2e-3 rad.
    """
    attitude = Sensor(name="attitude", quantity="part.orientation", target="disc", rate=997.0)
    path = make_model(flywheel(sensors=[attitude]), spinning(2.0), None, [Effect(kind="delay", parameters={"delay": 0.0105})])
    assert run(path).status == "done"
    with closing(sqlite3.connect(path)) as connection:
        values = np.array(connection.execute("SELECT value FROM sensor_sample ORDER BY time, component").fetchall()).reshape(-1, 4)
    assert values[:, 0].min() < 0.01
    assert np.linalg.norm(values, axis=1) == pytest.approx(1.0, abs=1e-6)
