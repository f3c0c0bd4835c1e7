"""The double pendulum, recorded in simulation and replayed: residuals must be the noise and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from machines import chain
from recorded import commanded, record
from rille import diagnosis, simulate
from rille.model import Command, Drive, InitialJointState, Scenario
from rille.model.recording import Channel

DELAY = 0.007


def model(make_model, rng, length=(0.2, 0.3), duration=8.0):
    rover = chain(list(length), [0.6, 0.5])
    drives = tuple(Drive(name=f"hinge{k}", joint=f"hinge{k}", mode="torque", max_torque=10.0) for k in (1, 2))
    time = np.arange(0, duration, 0.01)
    commands = []
    for k, size in ((1, 0.8), (2, 0.25)):
        wave = sum(rng.normal() * np.sin(2 * np.pi * f * time + rng.uniform(0, 6)) for f in (0.5, 1.1, 2.3, 4.0)) * size / 2
        commands += [Command(drive=f"hinge{k}", time=float(t), value=float(v)) for t, v in zip(time, wave, strict=True)]
    scenario = Scenario(
        name="swing",
        duration=duration,
        step=1e-3,
        commands=tuple(sorted(commands, key=lambda c: c.time)),
        initial_states=(InitialJointState(joint="hinge1", position=0.5), InitialJointState(joint="hinge2", position=-0.3)),
    )
    return make_model(replace(rover, drives=drives), scenario), scenario


def sensors(delay=DELAY, stated=True):
    found = []
    for k in (1, 2):
        found.append(Channel(name=f"pos{k}", quantity="joint.position", target=f"hinge{k}", unit="rad", noise=1e-3, delay=delay))
        found.append(Channel(name=f"vel{k}", quantity="joint.velocity", target=f"hinge{k}", unit="rad/s", noise=0.05, delay=delay))
    return found


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_residuals_are_white_at_the_noise(make_model, seed):
    rng = np.random.default_rng(seed)
    path, scenario = model(make_model, rng)
    recording = record(path, sensors(), duration=8.0, rate=450, seed=seed, jitter=3e-4, gaps=[(2.9, 3.3), (5.0, 5.02)])
    recording = commanded(recording, scenario)
    comparison = diagnosis.compare_windows(simulate.Replayer(path), recording, window=0.5)
    chi2, count = 0.0, 0
    for channel in comparison.channels:
        left = channel.residual / channel.noise
        print(
            channel.channel.name,
            len(left),
            left.mean(),
            left.std(),
            np.mean(left[1:] * left[:-1]),
            "gain",
            np.median(channel.start_gain) / channel.noise,
        )
        chi2 += np.sum(left**2)
        count += len(left)
    print(chi2 / count, np.sqrt(2 / count), [round(w.shift, 2) for w in comparison.windows])
    assert chi2 / count == pytest.approx(1, abs=4 * np.sqrt(2 / count))


def test_inverse_dynamics_gives_back_the_torques(make_model):
    rng = np.random.default_rng(5)
    path, scenario = model(make_model, rng)
    channels = [
        *sensors(),
        *(Channel(name=f"tau{k}", quantity="joint.effort", target=f"hinge{k}", unit="N m", noise=0.02, delay=DELAY) for k in (1, 2)),
    ]
    recording = commanded(record(path, channels, duration=8.0, rate=450, seed=5, jitter=3e-4, gaps=[(2.9, 3.3)]), scenario)
    comparison = diagnosis.compare_inverse(simulate.Replayer(path), recording)
    for channel in comparison.channels:
        left = channel.residual / channel.noise
        print(channel.channel.name, len(left), channel.noise, left.mean(), left.std(), np.mean(left[1:] * left[:-1]))
    whole = diagnosis.compare_whole(simulate.Replayer(path), recording)
    for channel in whole.channels:
        left = channel.residual / channel.noise
        print(channel.channel.name, len(left), channel.noise, left.mean(), left.std(), np.mean(left[1:] * left[:-1]))
