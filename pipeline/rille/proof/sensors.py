"""What a machine is recorded with: clocks that jitter, noise that is coloured, values that are quantised; drawn for every trial."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from rille.model import Scenario
from rille.model.recording import ANGLES, AXES, QUANTITIES, Channel, Frame, Recording, unit_of
from rille.model.rover import COMMAND_QUANTITIES
from rille.proof.generator.reading import Reading
from rille.proof.subject import Subject

Array = NDArray[np.float64]
JITTER = 0.04  # of a period, 1 sigma
HIDES_NOISE = 1 / 3  # share of trials whose manifest does not tell the noise


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """Samples ``rate`` [Hz] times a second, first at ``phase`` [s], each off by ``jitter`` [s], 1 sigma. Its stamps are t (1 + skew)."""

    name: str
    rate: float
    phase: float
    jitter: float
    skew: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """One channel.

    It says limit(scale y(t - delay - late) + bias + trend t + slow noise + white noise), rounded to ``resolution``.

    noise : 1 sigma [unit] of both noises; slow_share : of it that is slow, with the time constant slow_time [s]. delay : [s], which the
    manifest tells; late : [s], which it does not. limit : end of its range [unit].
    """

    channel: str
    quantity: str
    target: str
    component: str
    frame: Frame
    clock: str
    noise: float
    resolution: float
    slow_share: float = 0.0
    slow_time: float = 0.3
    delay: float = 0.0
    late: float = 0.0
    scale: float = 1.0
    bias: float = 0.0
    trend: float = 0.0
    limit: float = np.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """All that is recorded of a machine. hides_noise : the manifest does not tell the noise."""

    clocks: Mapping[str, Clock]
    sensors: tuple[Sensor, ...]
    hides_noise: bool


Row = tuple[str, str, tuple[str, ...], Frame, float, float]  # quantity, target, components, frame, noise [SI], resolution [SI]
SETS: Mapping[str, tuple[Row, ...]] = {
    "pendulum": (
        ("joint.position", "shoulder", (), "world", 0.0, 1e-3),
        ("joint.position", "elbow", (), "world", 1.2e-3, 0.0),
        ("joint.velocity", "shoulder", (), "world", 0.02, 0.0),
        ("joint.velocity", "elbow", (), "world", 0.02, 0.0),
    ),
    "arm": (
        ("joint.position", "waist", (), "world", 0.0, 6e-4),
        ("joint.position", "shoulder", (), "world", 8e-4, 0.0),
        ("joint.position", "elbow", (), "world", 8e-4, 0.0),
        ("joint.velocity", "waist", (), "world", 0.01, 0.0),
        ("joint.velocity", "shoulder", (), "world", 0.015, 0.0),
        ("joint.velocity", "motor", (), "world", 0.1, 0.0),
        ("joint.effort", "waist", (), "world", 0.02, 0.0),
        ("joint.effort", "motor", (), "world", 0.002, 0.0),
    ),
    "free_body": (
        ("part.position", "body", AXES, "world", 3e-3, 0.0),
        ("part.orientation", "body", ANGLES, "world", 3e-3, 0.0),
        ("part.angular_velocity", "body", AXES, "body", 2e-3, 0.0),
        ("part.linear_acceleration", "body", AXES, "body", 0.02, 0.0),
        ("joint.velocity", "spin", (), "world", 0.03, 0.0),
        ("joint.position", "spin", (), "world", 2e-3, 0.0),
    ),
    "rover": (
        ("part.position", "chassis", AXES, "world", 4e-3, 0.0),
        ("part.orientation", "chassis", ANGLES, "world", 2e-3, 0.0),
        ("part.angular_velocity", "chassis", AXES, "body", 3e-3, 0.0),
    ),
}
WHEEL_ROWS: tuple[Row, ...] = (
    ("joint.position", "", (), "world", 0.0, 1.5e-3),
    ("joint.velocity", "", (), "world", 0.01, 0.0),
    ("joint.effort", "", (), "world", 0.08, 0.0),
)
SUSPENSION_ROWS: tuple[Row, ...] = tuple(
    ("joint.position", joint, (), "world", 1e-3, 0.0) for joint in ("rocker_left", "bogie_left", "bogie_right")
)
TOLD_DELAY = 0.03  # [s] of a rover's localisation, which the manifest tells


def sensor_rows(machine: Subject) -> list[Row]:
    """What a machine is recorded with."""
    rows = list(SETS.get(machine.name, ()))
    if machine.kind == "time" and machine.rover.wheels:
        for drive in machine.rover.drives:
            kinds = WHEEL_ROWS if drive.mode == "speed" else WHEEL_ROWS[:1]
            rows.extend((row[0], drive.joint, *row[2:]) for row in kinds)
        rows.extend(SUSPENSION_ROWS)
    return rows


def draw_sensors(machine: Subject, rng: np.random.Generator) -> Sensors:
    """Sensors of a trial: every quantity has a clock of its own; level, colour and rates are drawn."""
    clocks: dict[str, Clock] = {}
    sensors: list[Sensor] = []
    share, slow_time = float(rng.uniform(0.0, 0.4)), float(rng.uniform(0.1, 0.6))
    level = float(np.exp(rng.uniform(np.log(0.7), np.log(1.5))))
    wheeled = bool(machine.rover.wheels)
    for quantity, target, components, frame, noise, resolution in sensor_rows(machine):
        located = quantity in ("part.position", "part.orientation")
        clock = quantity.replace(".", "_")
        if clock not in clocks:
            rate = float(rng.uniform(20, 30) if located else rng.uniform(45, 55) if wheeled else rng.uniform(90, 130))
            clocks[clock] = Clock(name=clock, rate=rate, phase=float(rng.uniform(0, 0.5 / rate)), jitter=JITTER / rate)
        word = quantity.partition(".")[2]
        for component in components or ("",):
            sensors.append(
                Sensor(
                    channel=f"{target}_{component if component in ANGLES else f'{word}_{component}'.rstrip('_')}",
                    quantity=quantity,
                    target=target,
                    component=component,
                    frame=frame,
                    clock=clock,
                    noise=noise * level,
                    resolution=resolution * level,
                    slow_share=share if noise and share > 0.1 else 0.0,
                    slow_time=slow_time,
                    delay=TOLD_DELAY if located and wheeled else 0.0,
                )
            )
    return Sensors(clocks=clocks, sensors=tuple(sensors), hides_noise=bool(rng.random() < HIDES_NOISE))


def sampling(sensors: Sensors, duration: float, seed: int) -> dict[str, Array]:
    """Instants (n,) [s] at which each clock really samples, within ``duration`` [s]."""
    found = {}
    for name, clock in sensors.clocks.items():
        nominal = np.arange(clock.phase, duration, 1.0 / clock.rate)
        off = np.clip(clock.jitter * _random(seed, name).standard_normal(len(nominal)), -0.4 / clock.rate, 0.4 / clock.rate)
        latest = max(s.delay + s.late for s in sensors.sensors if s.clock == name)
        true = nominal + off
        found[name] = true[(true >= latest) & (true <= duration)]
    return found


def readings(sensors: Sensors, when: Mapping[str, Array]) -> list[Reading]:
    """What the sensors read of the machine, in their order."""
    return [
        Reading(quantity=s.quantity, target=s.target, component=s.component, frame=s.frame, times=when[s.clock] - s.delay - s.late)
        for s in sensors.sensors
    ]


def recording(
    machine: Subject, scenario: Scenario, sensors: Sensors, when: Mapping[str, Array], truth: Sequence[Array], seed: int
) -> Recording:
    """The recording that the sensors make.

    Parameters
    ----------
    when : of ``sampling``. truth : for each sensor (n,) [SI], what ``readings`` asked for. seed : of the noise.
    """
    channels = []
    for sensor, value in zip(sensors.sensors, truth, strict=True):
        clock, true = sensors.clocks[sensor.clock], when[sensor.clock]
        channels.append(
            Channel(
                name=sensor.channel,
                quantity=sensor.quantity,
                target=sensor.target,
                unit=unit_of(QUANTITIES[sensor.quantity], sensor.component),
                component=sensor.component,
                frame=sensor.frame,
                clock=sensor.clock,
                noise=sensor.noise or None,
                slow_noise=sensor.noise * sensor.slow_share or None,
                delay=sensor.delay,
                resolution=sensor.resolution or None,
                time=true * (1.0 + clock.skew),
                value=_said(sensor, true, value, _random(seed, sensor.channel)),
            )
        )
    return Recording(name=scenario.name, scenario=scenario.name, channels=(*channels, *_commands(machine, scenario)))


def _said(sensor: Sensor, time: Array, value: Array, rng: np.random.Generator) -> Array:
    slow = sensor.noise * sensor.slow_share
    said = sensor.scale * value + sensor.bias + sensor.trend * time
    said = said + np.sqrt(sensor.noise**2 - slow**2) * rng.standard_normal(len(time))
    if slow:
        said = said + slow * _wandering(rng, time, sensor.slow_time)
    if sensor.component in ("roll", "yaw"):
        said = np.pi - np.mod(np.pi - said, 2 * np.pi)
    said = np.clip(said, -sensor.limit, sensor.limit)
    return sensor.resolution * np.rint(said / sensor.resolution) + 0.0 if sensor.resolution else said


def _wandering(rng: np.random.Generator, time: Array, constant: float) -> Array:
    """Ornstein-Uhlenbeck noise of unit variance with a time constant [s] (Uhlenbeck & Ornstein 1930, Phys. Rev. 36)."""
    kept = np.exp(-np.diff(time) / constant)
    draw = rng.standard_normal(len(time))
    values = draw.copy()
    for k in range(1, len(time)):
        values[k] = kept[k - 1] * values[k - 1] + np.sqrt(1.0 - kept[k - 1] ** 2) * draw[k]
    return values


def _commands(machine: Subject, scenario: Scenario) -> list[Channel]:
    """Set values of all drives, stamped whenever one of them changes, and at the end."""
    stamps = np.unique([0.0, scenario.duration, *(c.time for c in scenario.commands if c.time <= scenario.duration)])
    channels = []
    for drive in machine.rover.drives:
        own = sorted(((c.time, c.value) for c in scenario.commands if c.drive == drive.name), key=lambda one: one[0])
        times, values = np.array([0.0, *(t for t, _ in own)]), np.array([0.0, *(v for _, v in own)])
        quantity = QUANTITIES[COMMAND_QUANTITIES[drive.mode]]
        channels.append(
            Channel(
                name=f"{drive.name}_command",
                quantity=quantity.name,
                target=drive.joint,
                unit=quantity.units[0],
                role="command",
                clock="commands",
                time=stamps,
                value=values[np.searchsorted(times, stamps, side="right") - 1],
            )
        )
    return channels


def _random(seed: int, name: str) -> np.random.Generator:
    """Random numbers of one channel or clock: adding another leaves them as they are."""
    return np.random.default_rng([seed, crc32(name.encode())])
