"""A trial as recordings: the generator runs the machine as it really is, sensors see it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np

from rille.model import InputRefused, PhysicsFailed, Scenario
from rille.model.recording import Recording
from rille.proof.generator import simulate
from rille.proof.hidden import Hidden
from rille.proof.points import points_recording
from rille.proof.sensors import readings, recording, sampling
from rille.proof.strength import Unreachable, find_size
from rille.proof.subject import near
from rille.proof.trials import TRAINING, Drawn

Excess = Callable[[Sequence[Recording]], Mapping[str, float]]
"""Recordings -> channel -> normalised^2: mean square of what the base model does not reproduce in short windows, in units of the noise."""

MOST_DRAWS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """One concealed thing at its size. strength : its excess, alone [noise]. channel : where that is largest."""

    hidden: Hidden
    size: float
    strength: float
    channel: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """A trial as recordings, and its truth."""

    drawn: Drawn
    recordings: tuple[Recording, ...]
    pieces: tuple[Piece, ...]

    @property
    def truth(self) -> dict[str, Any]:
        """Plain JSON values: what is concealed, and what the score needs to know of the machine."""
        trial = self.drawn.trial
        pieces = [
            {
                "cause": p.hidden.cause,
                "kind": p.hidden.kind,
                "target": p.hidden.target,
                "numbers": p.hidden.numbers(p.size),
                "amplitudes": sorted(p.hidden.direction),
                "size": p.size,
                "strength": p.strength,
                "channel": p.channel,
                "near": near(self.drawn.machine, p.hidden.target),
                "reference": p.hidden.reference(self.drawn.machine),
            }
            for p in self.pieces
        ]
        return {**asdict(trial), "hides_noise": self.drawn.hides_noise, "pieces": pieces}


def make(drawn: Drawn, excess: Excess) -> Made:
    """The recordings of a trial, with each concealed thing so large that it alone is as strong as wanted in the first of them.

    Raises
    ------
    Unreachable : if this draw cannot be made so strong.
    """
    first = next(scenario for scenario in drawn.scenarios if scenario.name == TRAINING[0])
    floor = excess([generate(drawn, first, [], rough=True)]) if drawn.hidden else {}
    pieces = tuple(_sized(drawn, hidden, first, excess, floor) for hidden in drawn.hidden)
    concealed = [(piece.hidden, piece.size) for piece in pieces]
    try:
        recordings = tuple(generate(drawn, scenario, concealed) for scenario in drawn.scenarios)
    except (PhysicsFailed, InputRefused) as error:
        raise Unreachable(str(error)) from error
    return Made(drawn=drawn, recordings=recordings, pieces=pieces)


def _sized(drawn: Drawn, hidden: Hidden, scenario: Scenario, excess: Excess, floor: Mapping[str, float]) -> Piece:
    """A concealed thing at the size that is as strong as wanted in the recording of a scenario, beyond what ``floor`` shows without it."""

    def measure(size: float) -> tuple[float, str]:
        try:
            found = excess([generate(drawn, scenario, [(hidden, size)], rough=True)])
        except (PhysicsFailed, InputRefused):
            return np.inf, ""
        beyond = {name: square - max(1.0, floor.get(name, 1.0)) for name, square in found.items()}
        worst = max(beyond, key=lambda name: beyond[name])
        return float(np.sqrt(max(0.0, beyond[worst]))), worst

    size, strength, channel = find_size(measure, drawn.trial.strength, hidden.first, hidden.most, hidden.least)
    return Piece(hidden=hidden, size=size, strength=strength, channel=channel)


def generate(drawn: Drawn, scenario: Scenario, concealed: Sequence[tuple[Hidden, float]], *, rough: bool = False) -> Recording:
    """One recording of a machine with things concealed at these sizes. rough : good enough to see how strong they are.

    Raises
    ------
    PhysicsFailed : where a run does not reach its end.
    """
    machine, sensors = drawn.machine, drawn.sensors
    for hidden, size in concealed:
        machine = hidden.machine(machine, size)
        sensors = hidden.sensors(sensors, size) if sensors is not None else None
    laws = [law for hidden, size in concealed for law in hidden.laws(size)]
    seed = crc32(f"{drawn.trial.random('noise').integers(1 << 62)}/{scenario.name}".encode())
    if sensors is None:
        rng = np.random.default_rng([int(drawn.trial.random("maneuver").integers(1 << 31)), crc32(scenario.name.encode())])
        return points_recording(machine, scenario.name, laws, rng, np.random.default_rng(seed))
    when = sampling(sensors, scenario.duration, seed)
    truth = simulate(machine, replace(scenario, gravity=machine.gravity), laws, readings(sensors, when), rough=rough)
    return recording(machine, scenario, sensors, when, truth, seed)
