"""The double pendulum with torque drives, swung by waves, and its recordings."""

from dataclasses import replace

import numpy as np

from machines import chain
from recorded import commanded, record
from rille.model import Command, Drive, InitialJointState, Scenario
from rille.model.recording import Channel

DELAY = 0.007


def model(make_model, seed, effects=(), duration=8.0):
    """Two rods with torque drives, commands every 10 ms of four waves each."""
    rng = np.random.default_rng(seed)
    rover = chain([0.2, 0.3], [0.6, 0.5])
    drives = tuple(Drive(name=f"hinge{k}", joint=f"hinge{k}", mode="torque", max_torque=10.0) for k in (1, 2))
    time = np.arange(0, duration, 0.01)
    commands = []
    for k, size in ((1, 0.8), (2, 0.25)):
        wave = np.zeros(len(time))
        for frequency in (0.5, 1.1, 2.3, 4.0):
            wave += rng.normal() * size / 2 * np.sin(2 * np.pi * frequency * time + rng.uniform(0, 6))
        commands += [Command(drive=f"hinge{k}", time=float(t), value=float(v)) for t, v in zip(time, wave.tolist(), strict=True)]
    scenario = Scenario(
        name="swing",
        duration=duration,
        step=1e-3,
        commands=tuple(sorted(commands, key=lambda c: c.time)),
        initial_states=(InitialJointState(joint="hinge1", position=0.5), InitialJointState(joint="hinge2", position=-0.3)),
    )
    return make_model(replace(rover, drives=drives), scenario, None, effects), scenario


def sensors(**changes):
    """Encoders, rates and torques of both hinges."""
    found = []
    for k in (1, 2):
        found.append(Channel(name=f"angle{k}", quantity="joint.position", target=f"hinge{k}", unit="rad", noise=1e-3, delay=DELAY))
        found.append(Channel(name=f"rate{k}", quantity="joint.velocity", target=f"hinge{k}", unit="rad/s", noise=0.05, delay=DELAY))
        found.append(Channel(name=f"torque{k}", quantity="joint.effort", target=f"hinge{k}", unit="N m", noise=0.02, delay=DELAY))
    return [replace(channel, **changes) for channel in found]


def recorded(path, scenario, seed, channels=None):
    """8 s at 450 Hz, jittered by 0.3 ms, with gaps of 0.4 s and 20 ms."""
    run = record(path, channels or sensors(), duration=8.0, rate=450, seed=seed, jitter=3e-4, gaps=[(2.9, 3.3), (5.0, 5.02)])
    return commanded(run, scenario)
