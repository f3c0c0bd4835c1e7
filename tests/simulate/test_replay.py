"""Replayer: it goes on as the run did, between steps as precisely as it says, with commands of hours as with those of seconds."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from machines import chain
from rille import simulate
from rille.model import Command, Drive, InitialJointState, Scenario
from rille.model.recording import Channel, Recording
from rille.simulate.observe import between


@pytest.fixture
def path(make_model):
    """Two rods, the first with a torque drive that alternates every 50 ms."""
    rover = replace(chain([0.2, 0.3], [0.6, 0.5]), drives=(Drive(name="motor", joint="hinge1", mode="torque", max_torque=5.0),))
    commands = tuple(Command(drive="motor", time=0.05 * k, value=0.4 * (-1) ** k) for k in range(40))
    states = (InitialJointState(joint="hinge1", position=0.6), InitialJointState(joint="hinge2", position=0.2))
    return make_model(rover, Scenario(name="s", duration=2, step=1e-3, commands=commands, initial_states=states))


def angle(joint="hinge2", **more):
    """An encoder."""
    return Channel(name=joint, quantity="joint.position", target=joint, unit="rad", **more)


def test_a_replay_from_recorded_states_goes_on_as_the_run_did(path):
    """States of the run at 0.3 and 1.1 s, the commands given as a recording: the same numbers at the steps, to rounding."""
    simulation = Simulation(str(path))
    states, truth = [], []
    for steps in (300, 800):
        simulation.step(steps)
        states.append(simulation.state()[0])
        kept = simulation.save()
        truth.append(simulation.sample(400, 100, [("joint.position", "hinge2", 0)])[:, 0])
        simulation.restore(kept)
    log = Channel(
        name="torque", quantity="joint.effort", target="hinge1", unit="N m", role="command", delay=0.01, time=np.arange(40.0) / 20 - 0.01,
        value=np.where(np.arange(40) % 2, -0.4, 0.4),
    )  # fmt: skip
    replayer = simulate.Replayer(path)
    replayer.drive_by(Recording(name="r", channels=(angle(), log)))
    starts = np.array(states)
    time = np.concatenate([s + 0.1 * np.arange(1, 5) for s in starts[:, 0]])
    found = replayer.predict(starts[None], starts[:, 0] + 0.4, [angle()], [(np.repeat([0, 1], 4), time)])[0][0]
    assert found == pytest.approx(np.concatenate(truth), abs=1e-9)
    ends = [replayer.advance(state, state[0] + 0.4)[0] for state in starts]
    assert [end[14 + 1] for end in ends] == pytest.approx([t[-1] for t in truth], abs=1e-9)


def test_between_steps_the_error_is_far_below_an_encoder(path):
    """Sine of 2 Hz at steps of 5 ms: a^4 h^4 x 3/128 for the cubic (6e-7 of the amplitude), w^2 h^2/8 for a line (5e-4)."""
    step, w = 5e-3, 2 * np.pi * 2
    series = np.sin(w * step * np.arange(200))[None]
    at = np.random.default_rng(1).uniform(2, 190, 1000)
    row = np.zeros(1000, dtype=np.int64)
    assert np.abs(between(series, row, at, "joint.position") - np.sin(w * step * at)).max() < 1e-6
    assert np.abs(between(series, row, at, "joint.velocity") - np.sin(w * step * at)).max() < 6e-4
    assert between(np.arange(5.0)[None], row[:3], np.array([1.2, 2.0, 2.7]), "joint.effort").tolist() == [2, 2, 3]


def test_a_log_of_an_hour_costs_a_window_no_more_than_one_of_a_second(path):
    """3.6 million commands: 20 windows at its end take less than 3 s, which reading the list for each of them would not."""
    import time as clock

    time = np.arange(3_600_000.0) / 1000
    log = Channel(
        name="torque", quantity="joint.effort", target="motor", unit="N m", role="command", time=time, value=0.1 * np.sin(7 * time)
    )
    replayer = simulate.Replayer(path)
    replayer.drive_by(Recording(name="r", channels=(log,)))
    state = replayer.rest()
    states = np.repeat(state[None], 20, axis=0)
    states[:, 0] = 3590 + 0.4 * np.arange(20)
    began = clock.process_time()
    for row in states:
        replayer.advance(row, row[0] + 0.05)
    replayer.predict(states[None], states[:, 0] + 0.1, [angle()], [(np.arange(20), states[:, 0] + 0.1)])
    assert clock.process_time() - began < 3


def test_missing_efforts_are_what_was_left_out(path):
    """The run had 0.4 N m more than the replay is told: the speeds at the end of 20 ms ask for it, to 5 % (M changes on the way)."""
    replayer = simulate.Replayer(path)
    simulation = Simulation(str(path))
    simulation.step(400)
    start = simulation.state()
    simulation.step(20)
    silent = Channel(
        name="torque", quantity="joint.effort", target="motor", unit="N m", role="command", time=np.zeros(1), value=np.zeros(1)
    )
    replayer.drive_by(Recording(name="r", channels=(silent,)))
    applied, lacking = replayer.missing_efforts(start, 0.02, simulation.state()[:, 16:])
    assert applied[0] == pytest.approx(0, abs=1e-12)
    assert lacking[0] == pytest.approx([0.4, 0], abs=0.02)
