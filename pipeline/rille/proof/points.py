"""Points of a wheel bench: conditions drawn at random, each twice, with noise.

A law of width or speed does what another number of the soil does where neither of them changes. So a bench has two wheels and two speeds,
and each recording has one of both: three to learn from, in which either changes alone, and the fourth pair held out.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import BenchWheel, Effect, Soil, Wheel
from rille.model.recording import Channel, Recording, Role
from rille.proof.generator.wheel_bench import bench_points
from rille.proof.subject import Subject

LAW = "bekker_wong"
DESIGN: Mapping[str, tuple[int, int]] = {  # recording -> number of its wheel, and of its speed
    "training_1": (0, 0),
    "training_2": (1, 0),
    "training_3": (0, 1),
    "held_out": (1, 1),
}
SLIPS, SLIPS_EACH = (-0.1, 0.8), 5  # of slip ratios; how many a recording has
CONDITIONS = {"load": ("wheel.normal_load", "N"), "slip_ratio": ("wheel.slip_ratio", "1"), "slip_angle": ("wheel.slip_angle", "rad")}
MEASURED = {  # word -> (quantity, unit, 1 sigma)
    "sinkage": ("wheel.sinkage", "m", 3e-4),
    "drawbar_pull": ("wheel.drawbar_pull", "N", 0.25),
    "side_force": ("wheel.side_force", "N", 0.25),
    "drive_torque": ("wheel.drive_torque", "N m", 0.05),
}


def conditions(rng: np.random.Generator, slips: int) -> dict[str, NDArray[np.float64]]:
    """Two loads x so many slip ratios x three slip angles, each point twice; every array (12 slips,)."""
    loads = np.exp(rng.uniform(np.log(25), np.log(110), 2))
    ratios = np.sort(rng.uniform(*SLIPS, slips))
    angles = np.array([0.0, rng.uniform(0.08, 0.2), rng.uniform(0.25, 0.4)])
    grid = np.meshgrid(loads, ratios, angles, [0, 1], indexing="ij")
    return {word: array.ravel() for word, array in zip(CONDITIONS, grid[:3], strict=True)}


def rim(wheel: Wheel) -> BenchWheel:
    """A wheel as a bench takes it."""
    lugs = wheel.grouser
    count, height = (lugs.count, lugs.height) if lugs is not None else (0, 0.0)
    return BenchWheel(radius=wheel.radius, width=wheel.width, grouser_count=count, grouser_height=height)


def points_recording(
    machine: Subject, name: str, laws: Sequence[Effect], rng: np.random.Generator, noise: np.random.Generator
) -> Recording:
    """What a bench measures of the wheel of that recording under ``laws``.

    rng : draws the conditions, the same at every size of what is concealed.
    """
    assert machine.terrain is not None
    where, soil = conditions(rng, SLIPS_EACH), machine.terrain.soils[0]
    which, pace = DESIGN[name]
    wheel, speed = machine.rover.wheels[which], machine.speeds[pace]
    made = bench_points(rim(wheel), soil, LAW, **where, laws=(*machine.effects, *laws), gravity=abs(machine.gravity[2]), speed=speed)
    return as_measured(soil, name, wheel.name, speed, where, made, noise)


def as_measured(
    soil: Soil,
    name: str,
    wheel: str,
    speed: float,
    where: Mapping[str, NDArray[np.float64]],
    made: Mapping[str, NDArray[np.float64]],
    noise: np.random.Generator,
) -> Recording:
    """The recording of what a bench would measure without noise (``made``, words as in ``MEASURED``) of the wheel of that name at a speed
    [m/s] under conditions ``where``.
    """
    channels = [_channel(wheel, word, *CONDITIONS[word], where[word], "command", None) for word in CONDITIONS]
    for word, (quantity, unit, sigma) in MEASURED.items():
        said = made[word] + sigma * noise.standard_normal(len(made[word]))
        channels.append(_channel(wheel, word, quantity, unit, said, "observed", sigma))
    setup = {"wheel": {}, "law": LAW, "gravity": "earth", "slip_speed": "heading", "speed": speed, "soil": soil.name}
    return Recording(name=name, kind="points", setup=setup, channels=tuple(channels))


def _channel(target: str, word: str, quantity: str, unit: str, value: NDArray[np.float64], role: Role, sigma: float | None) -> Channel:
    number = np.arange(len(value), dtype=float)
    return Channel(name=word, quantity=quantity, target=target, unit=unit, role=role, noise=sigma, time=number, value=value)
