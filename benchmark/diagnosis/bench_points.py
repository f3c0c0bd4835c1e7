"""Points of a wheel bench with noise, as a recording and as a file."""

from pathlib import Path

import numpy as np
from instrument_sets import POINT_NOISE
from subjects import EARTH, Subject

from rille import simulate, store
from rille.model import BenchWheel
from rille.model.recording import Channel, Recording

LAW = "bekker_wong"
CONDITION_QUANTITIES = {"load": "wheel.normal_load", "slip_ratio": "wheel.slip_ratio", "slip_angle": "wheel.slip_angle"}
UNITS = {"load": "N", "slip_ratio": "1", "slip_angle": "rad", "sinkage": "m", "drawbar_pull": "N", "side_force": "N", "drive_torque": "N m"}


def points_recording(machine: Subject, name: str, seed: int, rng: np.random.Generator) -> Recording:
    """Loads x slip ratios x slip angles, each point twice; every recording has its own conditions.

    rng : draws the conditions, the same at every size of the fault. seed : of the noise.
    """
    own = np.random.default_rng([*name.encode(), int(rng.integers(1 << 31))])
    loads = np.exp(own.uniform(np.log(25), np.log(110), 2))
    slips = np.sort(own.uniform(-0.1, 0.8, 8))
    angles = np.array([0.0, own.uniform(0.08, 0.2), own.uniform(0.25, 0.4)])
    grid = [array.ravel() for array in np.meshgrid(loads, slips, angles, [0, 1], indexing="ij")]
    soil = machine.terrain.soils[0]  # type: ignore[union-attr]
    made = machine.rover.wheels[0]
    count, height = (made.grouser.count, made.grouser.height) if made.grouser else (0, 0.0)
    wheel = BenchWheel(radius=made.radius, width=made.width, grouser_count=count, grouser_height=height)
    effects = simulate.effect_rows(machine.effects, store.effect_kinds())
    result = simulate.bench(
        LAW, soil, wheel, load=grid[0], slip_ratio=grid[1], slip_angle=grid[2], effects=effects, gravity=EARTH, threads=1
    )
    noise = np.random.default_rng(seed)
    channels = [
        _channel(machine, word, quantity, grid[k], "command", None) for k, (word, quantity) in enumerate(CONDITION_QUANTITIES.items())
    ]
    for word, sigma in POINT_NOISE.items():
        value = getattr(result.points, word) + sigma * noise.standard_normal(len(grid[0]))
        channels.append(_channel(machine, word, f"wheel.{word}", value, "observed", sigma))
    setup = {"wheel": {}, "law": LAW, "gravity": "earth", "slip_speed": "heading", "speed": 0.05, "soil": soil.name}
    return Recording(name=name, kind="points", setup=setup, channels=tuple(channels))


def _channel(machine: Subject, word: str, quantity: str, value: np.ndarray, role: str, sigma: float | None) -> Channel:
    return Channel(
        name=word,
        quantity=quantity,
        target=machine.rover.wheels[0].name,
        unit=UNITS[word],
        role=role,  # type: ignore[arg-type]
        noise=sigma,
        time=np.arange(len(value), dtype=float),
        value=np.asarray(value, dtype=float),
    )


def write_points(recording: Recording, folder: Path, hidden: str) -> Path:
    """CSV and manifest; returns the manifest."""
    file = folder / f"{recording.name}.csv"
    header = ",".join(channel.name for channel in recording.channels)
    np.savetxt(file, np.column_stack([c.value for c in recording.channels]), delimiter=",", header=header, comments="", fmt="%.12g")
    lines = [f'name = "{recording.name}"', f'file = "{file.name}"', 'kind = "points"', "", "[bench]"]
    lines += [f'soil = "{recording.setup["soil"]}"', f'law = "{LAW}"', 'gravity = "earth"']
    for channel in recording.channels:
        lines += ["", "[[channel]]", f'column = "{channel.name}"', f'quantity = "{channel.quantity}"', f'target = "{channel.target}"']
        lines += [f'unit = "{channel.unit}"', f'role = "{channel.role}"']
        if channel.noise and hidden != "noise":
            lines.append(f'noise = "{channel.noise!r} {channel.unit}"')
    manifest = file.with_suffix(".toml")
    manifest.write_text("\n".join(lines) + "\n")
    return manifest
