"""What the machines are recorded with. Noise, rates, resolution and the recorder's step are drawn for every trial."""

import numpy as np
from subjects import Subject

from rille.model.recording import ANGLES, AXES, QUANTITIES, unit_of
from rille.recording.instrument import CommandLog, Instrument, Instruments, SampleClock

FINER = (0.25, 0.4, 0.5)  # step of the recorder, of the diagnosis'
Row = tuple[str, str, tuple[str, ...], str, float, float]  # quantity, target, components, frame, noise [SI], resolution [SI]

SETS: dict[str, tuple[Row, ...]] = {
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
POINT_NOISE = {"sinkage": 3e-4, "drawbar_pull": 0.25, "side_force": 0.25, "drive_torque": 0.05}  # [m], [N], [N], [N m]


def _rows(subject: Subject) -> list[Row]:
    rows = list(SETS.get(subject.name, ()))
    if subject.name == "rover":
        for drive in subject.rover.drives:
            kinds = WHEEL_ROWS if drive.mode == "speed" else WHEEL_ROWS[:1]
            rows += [(quantity, drive.joint, *rest) for quantity, _, *rest in kinds]  # type: ignore[misc]
        rows += [("joint.position", joint, (), "world", 1e-3, 0.0) for joint in ("rocker_left", "bogie_left", "bogie_right")]
    return rows


def instruments(subject: Subject, rng: np.random.Generator) -> tuple[Instruments, float, str]:
    """Instruments of a trial, the recorder's step [s], and what the manifest hides (comma-separated words).

    Every quantity has a clock of its own that is irregular by a few per cent of its period; a part of the noise is coloured; in one trial
    of three the manifest does not tell the noise.
    """
    clocks: dict[str, SampleClock] = {}
    sensors = []
    share = float(rng.uniform(0.0, 0.4))  # of the noise that is coloured
    level = float(np.exp(rng.uniform(np.log(0.7), np.log(1.5))))
    for quantity, target, components, frame, noise, resolution in _rows(subject):
        slow = quantity in ("part.position", "part.orientation")
        clock = quantity.replace(".", "_")
        if clock not in clocks:
            rate = float(rng.uniform(20, 30) if slow else rng.uniform(45, 55) if subject.name == "rover" else rng.uniform(90, 130))
            clocks[clock] = SampleClock(name=clock, rate=rate, jitter=0.04 / rate, phase=float(rng.uniform(0, 0.5 / rate)))
        size = noise * level
        coloured = (share * size, float(rng.uniform(0.1, 0.6))) if size > 0 and share > 0.1 else None
        word = quantity.partition(".")[2]
        label = components[0] if components else ""
        columns = tuple(f"{target}_{c if c in ANGLES else f'{word}_{c}'}" for c in components) or (f"{target}_{word}",)
        sensors.append(
            Instrument(
                columns=columns,
                quantity=quantity,
                target=target,
                clock=clock,
                unit=unit_of(QUANTITIES[quantity], label),
                components=components,
                frame=frame,  # type: ignore[arg-type]
                delay=0.03 if slow and subject.name == "rover" else 0.0,
                white=float(size * np.sqrt(1 - share**2)) if coloured else size,
                coloured=coloured,
                resolution=resolution * level,
            )
        )
    word = {"speed": "velocity", "position": "position", "torque": "effort"}
    logs = []
    for drive in subject.rover.drives:
        quantity = QUANTITIES[f"joint.{word[drive.mode]}"]
        logs.append(
            CommandLog(column=f"{drive.name}_command", drive=drive.name, quantity=quantity.name, target=drive.joint, unit=quantity.units[0])
        )
    made = Instruments(clocks=clocks, sensors=tuple(sensors), commands=tuple(logs), seed=int(rng.integers(1 << 31)))
    return made, subject.step * float(rng.choice(FINER)), "noise" if rng.random() < 1 / 3 else ""
