"""Replays on a Dask cluster: the same numbers as here, and a sentence where there is no cluster."""

import numpy as np
import pytest

from rille import simulate
from rille.model import InputRefused
from rille.model.recording import Channel, Recording
from rille.simulate.cluster import ClusterReplayer
from rille.work import connected
from simulate.test_changed import ASIDE, CHANNELS, FRICTION, HEAVY, model, windows

distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install 'rille[cluster]'")


@pytest.fixture(scope="module")
def address():
    """A scheduler with two workers in this process."""
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": None, "protocol": "tcp"}
    with distributed.LocalCluster(**options) as cluster:
        yield cluster.scheduler_address


def test_workers_give_the_same_numbers(make_model, address):
    """Seven models, more than pieces of work; driven by a recording's commands, with a change upon a change."""
    path = model(make_model)
    time = np.array([0.0, 0.4])
    command = Channel(
        name="cmd",
        quantity="joint.velocity",
        target="wheel_front_left",
        unit="rad/s",
        role="command",
        time=time,
        value=np.array([1.0, 3.0]),
    )
    seen = Channel(name="x", quantity="part.position", component="x", target="chassis", unit="m", time=time, value=time)
    recording = Recording(name="r", channels=(command, seen))
    here = simulate.Replayer(path)
    here.drive_by(recording)
    states, stops, picks = windows(here, n=3)
    with connected(address) as client:
        there = ClusterReplayer(client, path)
        there.drive_by(recording)
        assert there.joints == here.joints
        assert there.machine().parameters == here.machine().parameters
        answers = []
        for base in (here, there):
            variants = [base.changed([effect]) for effect in (FRICTION, HEAVY, ASIDE)]
            variants += [variants[0].changed([HEAVY]), base.changed(parameters={"wheel.wheel_front_left.radius": 0.14})]
            answers.append(base.predict_many([base, *variants, base], states, stops, CHANNELS, picks))
        for a, b in zip(*answers, strict=True):
            np.testing.assert_array_equal(a, b)
        assert not np.array_equal(answers[0][0][0], answers[0][0][1])


def test_no_cluster_is_a_sentence(monkeypatch):
    monkeypatch.setattr("rille.work.cluster.PATIENCE", "1 s")
    with pytest.raises(InputRefused, match="no Dask scheduler answers"), connected("tcp://127.0.0.1:1"):
        pass
    with pytest.raises(InputRefused, match="no Dask scheduler answers"), connected("not an address"):
        pass
