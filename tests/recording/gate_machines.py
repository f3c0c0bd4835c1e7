"""Seeded machines for the tests of the data gate: motion is known in closed form, sensors and their faults are laid on it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]


class Motion:
    """A coordinate that moves, rests now and then, and moves on: position, velocity and acceleration at any time.

    q(t) = sum of A sin(w s(t) + p), s(t) a time that stands still in rests and starts and stops smoothly.
    """

    def __init__(self, rng: np.random.Generator, duration: float, scale: float, *, rests: bool) -> None:
        n = 5
        self.w = 2 * np.pi * rng.uniform(0.1, 2.5, n)
        self.a = scale * rng.normal(size=n) / self.w
        self.p = rng.uniform(0, 2 * np.pi, n)
        self.grid = np.arange(-1.0, duration + 1.0, 0.001)
        pace = np.ones(len(self.grid))
        if rests:
            for start in rng.uniform(0, duration * 0.8, 2):
                inside = (self.grid - start) / (0.12 * duration)
                pace *= np.where((inside > 0) & (inside < 1), 0.0, 1.0)
            kernel = np.hanning(301)
            pace = np.clip(np.convolve(pace, kernel / kernel.sum(), mode="same"), 0, None)
            pace[pace < 1e-12] = 0.0
        self.s = np.cumsum(pace) * 0.001
        self.pace = pace

    def position(self, t: Array) -> Array:
        s = np.interp(t, self.grid, self.s)
        return (self.a * np.sin(np.multiply.outer(s, self.w) + self.p)).sum(-1)

    def velocity(self, t: Array) -> Array:
        s, pace = np.interp(t, self.grid, self.s), np.interp(t, self.grid, self.pace)
        return pace * (self.a * self.w * np.cos(np.multiply.outer(s, self.w) + self.p)).sum(-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """How samples are taken: rate [Hz], jitter [of the interval], noise [of the signal's spread], resolution [of it]; 0: none."""

    rate: float = 200.0
    jitter: float = 0.0
    noise: float = 0.01
    resolution: float = 0.0


def stamps(rng: np.random.Generator, duration: float, sensing: Sensing) -> Array:
    """Sampling instants [s], increasing."""
    time = np.arange(0.0, duration, 1 / sensing.rate)
    return time + sensing.jitter / sensing.rate * rng.uniform(-0.5, 0.5, len(time))


def sensed(rng: np.random.Generator, truth: Array, sensing: Sensing) -> Array:
    """The true values with noise and quantisation."""
    spread = float(np.std(truth)) or 1.0
    value = truth + sensing.noise * spread * rng.normal(size=len(truth))
    if sensing.resolution:
        step = sensing.resolution * spread
        value = np.round(value / step) * step
    return value


def machine(seed: int, *, duration: float = 30.0, delay: float = 0.0) -> Recording:
    """A clean recording of a two-joint machine on a turning base: positions and rates on two clocks, commands that act late, torques, pose.

    delay : [s] by which the measured torque follows its command.
    """
    rng = np.random.default_rng(seed)
    rests = bool(rng.integers(2))
    fast = Sensing(
        rate=float(rng.choice([50.0, 100.0, 200.0, 500.0])),
        jitter=float(rng.choice([0.0, 0.3, 0.8])),
        noise=float(rng.choice([0.0, 0.001, 0.01, 0.05])),
        resolution=float(rng.choice([0.0, 0.002, 0.05])),
    )
    slow = replace(fast, rate=float(rng.choice([10.0, 20.0, 50.0])))
    t, u = stamps(rng, duration, fast), stamps(rng, duration, slow) + 0.003
    channels = []
    for joint in ("shoulder", "elbow"):
        motion = Motion(rng, duration, float(rng.choice([0.05, 1.0, 5.0])), rests=rests)
        channels += [
            _channel(f"{joint}_position", "joint.position", joint, "rad", t, sensed(rng, motion.position(t), fast)),
            _channel(f"{joint}_velocity", "joint.velocity", joint, "rad/s", t, sensed(rng, motion.velocity(t), fast)),
        ]
        torque = Motion(rng, duration, 3.0, rests=rests)
        at = stamps(rng, duration, replace(fast, jitter=0.0))
        command = torque.velocity(at)
        held = command[np.clip(np.searchsorted(at, t - delay, side="right") - 1, 0, len(at) - 1)]
        channels += [
            replace(_channel(f"{joint}_command", "joint.effort", joint, "N m", at, command), role="command", clock="commands"),
            _channel(f"{joint}_torque", "joint.effort", joint, "N m", t, sensed(rng, held, fast)),
        ]
    turn, way = Motion(rng, duration, 0.5, rests=rests), Motion(rng, duration, 0.3, rests=rests)
    channels += [
        replace(
            _channel("heading", "part.orientation", "base", "rad", u, sensed(rng, turn.position(u), slow)), component="yaw", clock="pose"
        ),
        replace(
            _channel("gyro", "part.angular_velocity", "base", "rad/s", t, sensed(rng, turn.velocity(t), fast)), component="z", frame="body"
        ),
        replace(_channel("east", "part.position", "base", "m", u, sensed(rng, way.position(u), slow)), component="x", clock="pose"),
        replace(_channel("speed", "part.linear_velocity", "base", "m/s", t, sensed(rng, way.velocity(t), fast)), component="x"),
    ]
    return Recording(name=f"machine/{seed}", channels=tuple(channels))


def _channel(name: str, quantity: str, target: str, unit: str, time: Array, value: Array) -> Channel:
    return Channel(name=name, quantity=quantity, target=target, unit=unit, time=time, value=value)


def changed(recording: Recording, name: str, **new: object) -> Recording:
    """The recording with fields of one channel replaced."""
    channels = tuple(replace(channel, **new) if channel.name == name else channel for channel in recording.channels)
    return replace(recording, channels=channels)
