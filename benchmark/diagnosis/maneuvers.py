"""Maneuvers drawn at random that move everything a machine has: each recording of a trial has its own."""

import numpy as np

from rille.model import Command, InitialJointState, Pose, Scenario
from rille.proof.machines import GROUND
from rille.proof.maneuvers import HELD, drive_about, scenario_of, waves
from rille.proof.subject import Subject


def maneuver(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    """A scenario of that name, as diagnosis will know it."""
    return MANEUVERS[subject.name](subject, name, rng)


def _driven_by_waves(rng: np.random.Generator, subject: Subject, drive: str, paces: tuple[float, float]) -> list[Command]:
    time = np.arange(0, subject.duration, HELD)
    wave = waves(rng, time, subject.efforts[drive], *paces)
    return [Command(drive=drive, time=float(t), value=float(v)) for t, v in zip(time, wave, strict=True)]


def _pendulum(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    states = tuple(InitialJointState(joint=joint, position=float(rng.uniform(-0.5, 0.5))) for joint in ("shoulder", "elbow"))
    return scenario_of(subject, name, initial_states=states, commands=tuple(_driven_by_waves(rng, subject, "shoulder", (1.5, 9))))


def _arm(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    commands = [
        *_driven_by_waves(rng, subject, "waist", (0.8, 4)),
        *_driven_by_waves(rng, subject, "shoulder", (1.5, 8)),
        *_driven_by_waves(rng, subject, "motor", (1.5, 8)),
    ]
    elbow = float(rng.uniform(-0.8, 0.8))
    states = [InitialJointState(joint="shoulder", position=float(rng.uniform(-1, 1)))]
    states += [InitialJointState(joint="elbow", position=elbow), InitialJointState(joint="motor", position=12.0 * elbow)]
    return scenario_of(subject, name, initial_states=tuple(states), commands=tuple(commands))


def _free_body(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    return scenario_of(
        subject,
        name,
        start=Pose(position=(0, 0, 1.0)),
        start_velocity=(*rng.uniform(-3, 3, 2).tolist(), float(rng.uniform(3, 5))),
        start_angular_velocity=tuple(rng.uniform(-1.5, 1.5, 3).tolist()),
        commands=tuple(_driven_by_waves(rng, subject, "spin", (1, 6))),
    )


def _bench(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    return scenario_of(subject, name, terrain=GROUND)


MANEUVERS = {"pendulum": _pendulum, "arm": _arm, "free_body": _free_body, "rover": drive_about, "bench": _bench}
