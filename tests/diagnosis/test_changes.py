"""Changes of the ground: planted ones are located, a machine that does something else is none, real runs put in a row fall apart where they
were put together.
"""

import importlib.util
import sys

import numpy as np
import pytest

from rille.diagnosis.pushes.changes import find_changes
from rille.model.sheet import data_folder


def made(seed, *, at=(), levels=(0.0,), minutes=10.0, colour=0.7):
    """Currents that follow speed and turning with AR(1) noise; resistance jumps at ``at`` [s]. Speed changes often, turning comes late."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, 60 * minutes, 0.15)
    speed = rng.uniform(0.1, 0.6, 1000)[(time / 20).astype(int)]
    turn = np.where(time > 240, rng.uniform(0, 0.4, 1000)[(time / 13).astype(int)], 0.0)
    level = np.array(levels)[np.searchsorted(at, time, side="right")]
    responses = []
    for gain in (1.0, 0.7):
        noise, white = np.zeros(len(time)), rng.standard_normal(len(time))
        for k in range(1, len(time)):
            noise[k] = colour * noise[k - 1] + white[k]
        responses.append(3 + 4 * speed + gain * (6 * turn + level) + noise)
    return time, np.column_stack(responses), np.column_stack([speed, turn])


@pytest.mark.parametrize("seed", range(6))
def test_nothing_changes_where_only_the_driving_does(seed):
    assert find_changes(*made(seed)) == ()


@pytest.mark.parametrize("seed", range(3))
def test_planted_changes_are_located(seed):
    """Jumps of 2.5 A of a noise of 1.4 A, correlated over six samples: both found within two blocks, with their sizes to 35 %."""
    found = find_changes(*made(seed, at=(180.0, 400.0), levels=(0.0, 2.5, 0.0)))
    assert [change.time for change in found] == pytest.approx([180, 400], abs=8)
    assert all(change.low <= change.time <= change.high for change in found)
    assert [change.after[0] - change.before[0] for change in found] == pytest.approx([2.5, -2.5], rel=0.35)


def test_gaps_constants_and_short_records_are_harmless():
    time, responses, conditions = made(1, at=(300.0,), levels=(0.0, 3.0))
    responses[1000:1100] = np.nan
    conditions = np.column_stack([conditions, np.full(len(time), 2.0)])
    assert [change.time for change in find_changes(time, responses, conditions)] == pytest.approx([300], abs=8)
    assert find_changes(time[:15], responses[:15], conditions[:15]) == ()
    assert find_changes(time, np.ones_like(responses), conditions) == ()


@pytest.mark.skipif(
    not (data_folder() / "data/recordings/husky_terrain_imu.parquet").exists(), reason="the Husky's runs are not here (RILLE_DATA)"
)
def test_the_husky_finds_where_its_terrains_were_put_together(repository):
    """52 min, 61 runs: all four changes within 12 s; all else lies in the snow, of which the runs differ among themselves."""
    spec = importlib.util.spec_from_file_location("ground_changes", repository / "examples/husky/ground_changes.py")
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    sys.modules["ground_changes"] = example
    spec.loader.exec_module(example)
    wheels, imu = example.columns("wheel_current"), example.columns("imu")
    order = ["SNOW", "FLOORING", "ICE", "ASPHALT", "SANDY_LOAM"]
    rows, truth = example.in_a_row({name: example.drives(wheels, imu, name) for name in order}, order)
    found = [change.time for change in example.changes_of(rows)]
    assert all(min(abs(time - at) for time in found) <= 12 for at in truth)
    assert all(time < truth[0] + 12 or min(abs(time - at) for at in truth) <= 12 for time in found)
