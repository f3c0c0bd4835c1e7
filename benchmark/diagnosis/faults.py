"""What is wrong in a trial: an effect that the model lacks, a number that it has wrong, a sensor that lies; of any size."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rille.proof import hidden
from rille.proof.hidden import Hidden
from rille.proof.subject import Subject
from rille.recording.instrument import Instrument, Instruments

# Where the usual values of the catalogue do not fit the machines here: kind -> parameter -> value.
OWN: Mapping[str, Mapping[str, float]] = {
    **hidden.OWN,
    "backlash": {"stiffness": 2000.0, "damping": 1.0, "rotor_inertia": 1e-4},
    "joint_elasticity": {"damping": 0.05, "rotor_inertia": 1e-4},
}


def hidden_number(kind: str, target: str, rng: np.random.Generator) -> Hidden:
    """A number of the model that is really larger or smaller, in proportion."""
    fault = hidden.hidden_number(kind, target, rng)
    return replace(fault, most=0.8 if fault.direction[kind] < 0 else 4.0)


def real_machine(fault: Hidden | None, subject: Subject, size: float) -> Subject:
    """The machine as it really is."""
    if fault is None:
        return subject
    if fault.cause == "parameter":
        return fault.machine(subject, size)
    return replace(subject, effects=(*subject.effects, *fault.laws(size)))


def real_instruments(fault: Hidden | None, made: Instruments, size: float) -> Instruments:
    """The instruments as they really are."""
    if fault is None or fault.cause != "sensor":
        return made
    owner = next(one for one in made.sensors if fault.target in one.columns)
    value = size * next(iter(fault.direction.values()))
    if fault.kind == "clock_skew":
        clock = made.clocks[owner.clock]
        return replace(made, clocks={**made.clocks, clock.name: replace(clock, skew=value)})
    number = owner.columns.index(fault.target)
    wrong = replace(_part(owner, (number,)), **_sensor_change(fault.kind, value))
    rest = tuple(k for k in range(len(owner.columns)) if k != number)
    pieces = [wrong] + ([_part(owner, rest)] if rest else [])
    return replace(made, sensors=tuple(piece for one in made.sensors for piece in (pieces if one is owner else [one])))


def _part(one: Instrument, chosen: Sequence[int]) -> Instrument:
    """An instrument of some of the components of another."""
    return replace(
        one,
        columns=tuple(one.columns[k] for k in chosen),
        components=tuple(one.components[k] for k in chosen) if one.components else (),
    )


def _sensor_change(kind: str, value: float) -> dict[str, object]:
    return {
        "bias": {"bias": value},
        "scale": {"scale": 1.0 + value},
        "delay": {"delay": value},
        "drift": {"trend": value},
        "saturation": {"lower": -1.0 / value, "upper": 1.0 / value} if value else {},
        "wrong_sign": {"scale": -1.0},
    }[kind]
