"""Maneuvers drawn at random that move everything a machine has: each recording of a trial has its own."""

import numpy as np
from subjects import Subject

from rille.model import Command, InitialJointState, Pose, Scenario

HELD = 0.02  # [s] between two set values of a torque
RAMP = 10  # set values in which a wheel's speed changes


def maneuver(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    """A scenario of that name, as diagnosis will know it."""
    return MANEUVERS[subject.name](subject, name, rng)


def _scenario(subject: Subject, name: str, **more: object) -> Scenario:
    return Scenario(name=name, duration=subject.duration, step=subject.step, gravity=subject.gravity, **more)  # type: ignore[arg-type]


def _waves(rng: np.random.Generator, time: np.ndarray, size: float, slowest: float, fastest: float) -> np.ndarray:
    """Sum of four sines of random pace [rad/s] and phase, with ``size`` as its largest value."""
    paces, phases = np.exp(rng.uniform(np.log(slowest), np.log(fastest), 4)), rng.uniform(0, 2 * np.pi, 4)
    wave = np.sin(paces[:, None] * time + phases[:, None]).sum(axis=0)
    return size * wave / np.abs(wave).max()


def _driven_by_waves(rng: np.random.Generator, subject: Subject, drive: str, size: float, paces: tuple[float, float]) -> list[Command]:
    time = np.arange(0, subject.duration, HELD)
    return [Command(drive=drive, time=float(t), value=float(v)) for t, v in zip(time, _waves(rng, time, size, *paces), strict=True)]


def _pendulum(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    states = tuple(InitialJointState(joint=joint, position=float(rng.uniform(-0.5, 0.5))) for joint in ("shoulder", "elbow"))
    return _scenario(subject, name, initial_states=states, commands=tuple(_driven_by_waves(rng, subject, "shoulder", 0.6, (1.5, 9))))


def _arm(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    commands = [
        *_driven_by_waves(rng, subject, "waist", 1.5, (0.8, 4)),
        *_driven_by_waves(rng, subject, "shoulder", 1.2, (1.5, 8)),
        *_driven_by_waves(rng, subject, "motor", 0.025, (1.5, 8)),
    ]
    elbow = float(rng.uniform(-0.8, 0.8))
    states = [InitialJointState(joint="shoulder", position=float(rng.uniform(-1, 1)))]
    states += [InitialJointState(joint="elbow", position=elbow), InitialJointState(joint="motor", position=12.0 * elbow)]
    return _scenario(subject, name, initial_states=tuple(states), commands=tuple(commands))


def _free_body(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    return _scenario(
        subject,
        name,
        start=Pose(position=(0, 0, 1.0)),
        start_velocity=(*rng.uniform(-3, 3, 2).tolist(), float(rng.uniform(3, 5))),
        start_angular_velocity=tuple(rng.uniform(-1.5, 1.5, 3).tolist()),
        commands=tuple(_driven_by_waves(rng, subject, "spin", 0.08, (1, 6))),
    )


def _rover(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    """Off at once, then every 1.5 s other speeds of either side, other steering, now and then a stop or a turn on the spot."""
    wheels = [d.name for d in subject.rover.drives if d.mode == "speed"]
    steering = [d.name for d in subject.rover.drives if d.mode == "position"]
    commands, last = [], dict.fromkeys(wheels, 0.0)
    for time in np.arange(0.0, subject.duration, 1.5):
        speed, turn, angle = rng.uniform(0.6, 2.0), rng.uniform(-0.5, 0.5), rng.uniform(-0.3, 0.3)
        if rng.random() < 0.15:
            speed = 0.0
        if rng.random() < 0.2:
            turn = float(rng.choice([-1.2, 1.2]))
        for wheel in wheels:
            own = speed + (turn if "right" in wheel else -turn) + rng.uniform(-0.25, 0.25)
            for share in np.arange(1, RAMP + 1) / RAMP:
                value = last[wheel] + share * (float(np.clip(own, -2.8, 2.8)) - last[wheel])
                commands.append(Command(drive=wheel, time=float(time + HELD * RAMP * share), value=float(value)))
            last[wheel] = commands[-1].value
        for joint in steering:
            commands.append(Command(drive=joint, time=float(time) + 0.2, value=float(angle if "front" in joint else -angle)))
    x, y, heading = rng.uniform(-4, 1), rng.uniform(-3, 3), rng.uniform(-0.6, 0.6)
    return _scenario(
        subject,
        name,
        terrain="hills",
        placement="on_terrain",
        settle_time=5.0,
        start=Pose(position=(float(x), float(y), 0.0), rotation=(float(np.cos(heading / 2)), 0.0, 0.0, float(np.sin(heading / 2)))),
        commands=tuple(commands),
    )


def _bench(subject: Subject, name: str, rng: np.random.Generator) -> Scenario:
    return _scenario(subject, name, terrain="hills")


MANEUVERS = {"pendulum": _pendulum, "arm": _arm, "free_body": _free_body, "rover": _rover, "bench": _bench}
