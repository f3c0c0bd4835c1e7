"""Maneuvers drawn at random that move everything a machine has: each recording of a trial has its own."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Command, InitialJointState, Pose, Scenario
from rille.proof.subject import Subject

HELD = 0.02  # [s] between two set values
RAMP = 10  # set values in which a wheel's speed changes
LEG = 1.5  # [s] between two changes of mind of a driver
REACH = {"shoulder": 0.8, "elbow": 0.8}  # [rad] start angles of joints that hang


def maneuver(machine: Subject, name: str, rng: np.random.Generator) -> Scenario:
    """A scenario of that name, as diagnosis will know it."""
    return _MAKERS[machine.name](machine, name, rng)


def scenario_of(machine: Subject, name: str, **more: Any) -> Scenario:
    """A scenario of a machine's own length, step and gravity."""
    return Scenario(name=name, duration=machine.duration, step=machine.step, gravity=machine.gravity, **more)


def waves(rng: np.random.Generator, time: NDArray[np.float64], size: float, slowest: float, fastest: float) -> NDArray[np.float64]:
    """Sum of four sines of random pace [rad/s] and phase, with ``size`` as its largest value."""
    paces, phases = np.exp(rng.uniform(np.log(slowest), np.log(fastest), 4)), rng.uniform(0, 2 * np.pi, 4)
    wave = np.sin(paces[:, None] * time + phases[:, None]).sum(axis=0)
    return size * wave / np.abs(wave).max()


def _driven_by_waves(rng: np.random.Generator, machine: Subject, drive: str) -> list[Command]:
    time = np.arange(0, machine.duration, HELD)
    wave = waves(rng, time, machine.efforts[drive], float(rng.uniform(0.8, 1.6)), float(rng.uniform(4, 9)))
    return [Command(drive=drive, time=float(t), value=float(v)) for t, v in zip(time, wave, strict=True)]


def _pendulum(machine: Subject, name: str, rng: np.random.Generator) -> Scenario:
    states = tuple(
        InitialJointState(joint=joint, position=float(rng.uniform(-1, 1) * REACH[joint]), velocity=float(rng.uniform(-1, 1)))
        for joint in ("shoulder", "elbow")
    )
    commands = [c for drive in machine.efforts for c in _driven_by_waves(rng, machine, drive)]
    return scenario_of(machine, name, initial_states=states, commands=tuple(commands))


def _arm(machine: Subject, name: str, rng: np.random.Generator) -> Scenario:
    commands = [c for drive in machine.efforts for c in _driven_by_waves(rng, machine, drive)]
    elbow = float(rng.uniform(-1, 1) * REACH["elbow"])
    states = (
        InitialJointState(joint="shoulder", position=float(rng.uniform(-1, 1) * REACH["shoulder"])),
        InitialJointState(joint="elbow", position=elbow),
        InitialJointState(joint="motor", position=machine.rover.gears[0].ratio * elbow),
    )
    return scenario_of(machine, name, initial_states=states, commands=tuple(commands))


def _free_body(machine: Subject, name: str, rng: np.random.Generator) -> Scenario:
    return scenario_of(
        machine,
        name,
        start=Pose(position=(0, 0, 1.0)),
        start_velocity=(*rng.uniform(-3, 3, 2).tolist(), float(rng.uniform(3, 5))),
        start_angular_velocity=tuple(rng.uniform(-1.5, 1.5, 3).tolist()),
        commands=tuple(_driven_by_waves(rng, machine, "spin")),
    )


def drive_about(machine: Subject, name: str, rng: np.random.Generator) -> Scenario:
    """Off at once, then every 1.5 s other speeds of either side, other steering, now and then a stop or a turn on the spot."""
    wheels = list(machine.efforts)
    steering = [d.name for d in machine.rover.drives if d.mode == "position"]
    commands, last = [], dict.fromkeys(wheels, 0.0)
    for time in np.arange(0.0, machine.duration, LEG):
        speed, turn, angle = rng.uniform(0.6, 2.0), rng.uniform(-0.5, 0.5), rng.uniform(-0.3, 0.3)
        if rng.random() < 0.15:
            speed = 0.0
        if rng.random() < 0.2:
            turn = float(rng.choice([-1.2, 1.2]))
        for wheel in wheels:
            fastest = machine.efforts[wheel]
            own = float(np.clip(speed + (turn if "right" in wheel else -turn) + rng.uniform(-0.25, 0.25), -fastest, fastest))
            for share in np.arange(1, RAMP + 1) / RAMP:
                value = last[wheel] + share * (own - last[wheel])
                commands.append(Command(drive=wheel, time=float(time + HELD * RAMP * share), value=float(value)))
            last[wheel] = own
        for joint in steering:
            commands.append(Command(drive=joint, time=float(time) + 0.2, value=float(angle if "front" in joint else -angle)))
    x, y, heading = rng.uniform(-4, 1), rng.uniform(-3, 3), rng.uniform(-0.6, 0.6)
    turned = (float(np.cos(heading / 2)), 0.0, 0.0, float(np.sin(heading / 2)))
    return scenario_of(
        machine,
        name,
        terrain=machine.terrain.name if machine.terrain is not None else None,
        placement="on_terrain",
        settle_time=5.0,
        start=Pose(position=(float(x), float(y), 0.0), rotation=turned),
        commands=tuple(commands),
    )


def _bench(machine: Subject, name: str, rng: np.random.Generator) -> Scenario:
    return scenario_of(machine, name, terrain=machine.terrain.name if machine.terrain is not None else None)


_MAKERS: Mapping[str, Callable[[Subject, str, np.random.Generator], Scenario]] = {
    "pendulum": _pendulum,
    "arm": _arm,
    "free_body": _free_body,
    "rover": drive_about,
    "bench": _bench,
}
