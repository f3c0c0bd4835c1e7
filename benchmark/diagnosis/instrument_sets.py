"""What the machines are recorded with. Noise, rates, resolution and the recorder's step are drawn for every trial."""

import numpy as np

from rille.model.recording import ANGLES, QUANTITIES, unit_of
from rille.model.rover import COMMAND_QUANTITIES
from rille.proof.sensors import HIDES_NOISE, JITTER, TOLD_DELAY, sensor_rows
from rille.proof.subject import Subject
from rille.recording.instrument import CommandLog, Instrument, Instruments, SampleClock

FINER = (0.25, 0.4, 0.5)  # step of the recorder, of the diagnosis'


def instruments(subject: Subject, rng: np.random.Generator) -> tuple[Instruments, float, str]:
    """Instruments of a trial, the recorder's step [s], and what the manifest hides (comma-separated words).

    Every quantity has a clock of its own that is irregular by a few per cent of its period; a part of the noise is coloured; in one trial
    of three the manifest does not tell the noise.
    """
    clocks: dict[str, SampleClock] = {}
    sensors = []
    share = float(rng.uniform(0.0, 0.4))  # of the noise that is coloured
    level = float(np.exp(rng.uniform(np.log(0.7), np.log(1.5))))
    for quantity, target, components, frame, noise, resolution in sensor_rows(subject):
        slow = quantity in ("part.position", "part.orientation")
        clock = quantity.replace(".", "_")
        if clock not in clocks:
            rate = float(rng.uniform(20, 30) if slow else rng.uniform(45, 55) if subject.name == "rover" else rng.uniform(90, 130))
            clocks[clock] = SampleClock(name=clock, rate=rate, jitter=JITTER / rate, phase=float(rng.uniform(0, 0.5 / rate)))
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
                frame=frame,
                delay=TOLD_DELAY if slow and subject.name == "rover" else 0.0,
                white=float(size * np.sqrt(1 - share**2)) if coloured else size,
                coloured=coloured,
                resolution=resolution * level,
            )
        )
    logs = []
    for drive in subject.rover.drives:
        quantity = QUANTITIES[COMMAND_QUANTITIES[drive.mode]]
        logs.append(
            CommandLog(column=f"{drive.name}_command", drive=drive.name, quantity=quantity.name, target=drive.joint, unit=quantity.units[0])
        )
    made = Instruments(clocks=clocks, sensors=tuple(sensors), commands=tuple(logs), seed=int(rng.integers(1 << 31)))
    return made, subject.step * float(rng.choice(FINER)), "noise" if rng.random() < HIDES_NOISE else ""


def channels(subject: Subject) -> dict[str, str]:
    """Channel -> quantity of all that is observed of a machine."""
    made, _, _ = instruments(subject, np.random.default_rng(0))
    return {column: sensor.quantity for sensor in made.sensors for column in sensor.columns}
