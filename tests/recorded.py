"""Recordings made in memory from simulations: irregular clocks, gaps, delay and noise that the test chooses."""

from collections.abc import Sequence

import numpy as np
from rille._solver import Simulation

from rille.model import Scenario
from rille.model.recording import Channel, Recording
from rille.simulate.observe import observer, steady


def record(
    path: object,
    sensors: Sequence[Channel],
    *,
    duration: float,
    rate: float,
    seed: int,
    jitter: float = 0.0,
    gaps: Sequence[tuple[float, float]] = (),
    model: object = None,
    settle: bool = True,
) -> Recording:
    """A recording of one run. ``sensors`` without samples say what to measure, with which noise, delay and resolution.

    jitter : [s] 1 sigma of the sampling instants about their nominal ones; the stamps are true. gaps : (from, to) [s] without samples.
    """
    rng = np.random.default_rng(seed)
    simulation = Simulation(model if model is not None else str(path))
    if settle:
        simulation.settle()
    step = simulation_step(path, model)
    reader = observer(sensors)
    needs = list(reader.needs)
    steps = steady(simulation.sample(round(duration / step), 1, needs, from_start=True)[None], needs)
    channels = []
    clocks: dict[str, np.ndarray] = {}
    for number, sensor in enumerate(sensors):
        if sensor.clock not in clocks:
            time = np.arange(0.02 + 2 * step, duration - 2 / rate, 1 / rate)
            time = np.sort(time + np.clip(rng.normal(0, jitter, len(time)), -0.45 / rate, 0.45 / rate))
            for first, last in gaps:
                time = time[(time < first) | (time > last)]
            clocks[sensor.clock] = time
        time = clocks[sensor.clock]
        value = reader.read(number, steps, np.zeros(len(time), dtype=np.int64), (time - sensor.delay) / step)
        value = value + rng.normal(0, sensor.noise or 0.0, len(time))
        if sensor.resolution:
            value = np.round(value / sensor.resolution) * sensor.resolution
        channels.append(_with(sensor, time, value))
    return Recording(name="run", channels=tuple(channels))


def simulation_step(path: object, model: object) -> float:
    """Step [s] of the model."""
    from rille._solver import Model

    return (model if model is not None else Model(str(path))).step  # type: ignore[attr-defined]


def _with(sensor: Channel, time: np.ndarray, value: np.ndarray) -> Channel:
    from dataclasses import replace

    return replace(sensor, time=time, value=value)


def commanded(recording: Recording, scenario: Scenario, quantity: str = "joint.effort") -> Recording:
    """The recording with the scenario's commands as command channels."""
    from dataclasses import replace

    drives = sorted({command.drive for command in scenario.commands})
    logs = []
    for drive in drives:
        own = [c for c in scenario.commands if c.drive == drive]
        logs.append(
            Channel(
                name=f"cmd_{drive}",
                quantity=quantity,
                target=drive,
                unit="N m",
                role="command",
                clock=f"cmd_{drive}",
                time=np.array([c.time for c in own]),
                value=np.array([c.value for c in own]),
            )
        )
    return replace(recording, channels=(*recording.channels, *logs))
