"""A trial as recordings: the generator runs the machine as it really is, sensors see it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, PhysicsFailed, Scenario
from rille.model.recording import Recording
from rille.proof.generator import simulate
from rille.proof.hidden import Hidden
from rille.proof.lookalikes import lookalikes
from rille.proof.points import points_recording
from rille.proof.sensors import readings, recording, sampling
from rille.proof.strength import Unreachable, find_size
from rille.proof.subject import near
from rille.proof.trials import TRAINING, Drawn

MOST_DRAWS = 12
NEAREST = 2  # of the laws that may stand for one, that are looked at closely
PROPORTIONS = 2  # steps to the size at which another law explains most


@dataclass(frozen=True, slots=True, kw_only=True)
class Misfit:
    """What the base model does not reproduce of a channel in short windows. z (n,) : residual over noise, NaN where there is none.
    degrees : of freedom.
    """

    z: NDArray[np.float64]
    degrees: float

    @property
    def square(self) -> float:
        """Mean square."""
        return float(np.nansum(self.z**2) / self.degrees)


Misfits = Callable[[Sequence[Recording]], Mapping[str, Misfit]]
"""Recordings -> channel -> what the base model does not reproduce of it."""


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


def make(drawn: Drawn, misfits: Misfits) -> Made:
    """The recordings of a trial, with each concealed thing so large that it alone is as strong as wanted in the first of them.

    The strength of a law for which others of the catalogue may stand (``lookalikes``) is that of what they do not explain: without it a
    friction that falls with speed is friction, and a law without a name is one that has a name.

    Raises
    ------
    Unreachable : if this draw cannot be made so strong.
    """
    first = next(scenario for scenario in drawn.scenarios if scenario.name == TRAINING[0])
    base = misfits([generate(drawn, first, [], rough=True)]) if drawn.hidden else {}
    pieces = tuple(_sized(drawn, hidden, first, misfits, base) for hidden in drawn.hidden)
    concealed = [(piece.hidden, piece.size) for piece in pieces]
    try:
        recordings = tuple(generate(drawn, scenario, concealed) for scenario in drawn.scenarios)
    except (PhysicsFailed, InputRefused) as error:
        raise Unreachable(str(error)) from error
    return Made(drawn=drawn, recordings=recordings, pieces=pieces)


def _sized(drawn: Drawn, hidden: Hidden, scenario: Scenario, misfits: Misfits, base: Mapping[str, Misfit]) -> Piece:
    """A concealed thing at the size that is as strong as wanted in the recording of a scenario. base : what that shows without it."""
    wanted = drawn.trial.strength

    def shown(one: Hidden, size: float) -> Mapping[str, Misfit] | None:
        try:
            return misfits([generate(drawn, scenario, [(one, size)], rough=True)])
        except (PhysicsFailed, InputRefused):
            return None

    def strength(one: Hidden) -> Callable[[float], tuple[float, str]]:
        return lambda size: excess(shown(one, size), base)

    size, found, channel = find_size(strength(hidden), wanted, hidden.first, hidden.most, hidden.least)
    others = []
    for other in lookalikes(drawn.machine, hidden, drawn.kinds):
        try:
            others.append((other, find_size(strength(other), wanted, other.first, other.most)[0]))
        except Unreachable:
            continue
    here = shown(hidden, size) if others else None
    if here is not None:
        left = [_left_by(here, base, shown, other, begin)[0] for other, begin in others]
        nearest = [others[k] for k in np.argsort(left, kind="stable")[:NEAREST]]

        def unexplained(size: float) -> tuple[float, str]:
            here = shown(hidden, size)
            if here is None:
                return np.inf, ""
            return min((_left_by(here, base, shown, other, begin) for other, begin in nearest), key=lambda one: one[0])

        size, found, channel = find_size(unexplained, wanted, size, hidden.most, hidden.least)
    return Piece(hidden=hidden, size=size, strength=found, channel=channel)


def excess(here: Mapping[str, Misfit] | None, base: Mapping[str, Misfit]) -> tuple[float, str]:
    """sqrt(normalised^2 - that without the concealed thing, if above 1) of the channel where it is largest, and that channel: values at
    rest are all rounded alike. here : what is shown; None: physics ended the run, which is infinitely much. base : without it.
    """
    if here is None:
        return np.inf, ""
    beyond = {name: one.square - max(1.0, base[name].square if name in base else 1.0) for name, one in here.items()}
    worst = max(beyond, key=lambda name: beyond[name])
    return float(np.sqrt(max(0.0, beyond[worst]))), worst


def _left_by(
    here: Mapping[str, Misfit],
    base: Mapping[str, Misfit],
    shown: Callable[[Hidden, float], Mapping[str, Misfit] | None],
    other: Hidden,
    size: float,
) -> tuple[float, str]:
    """Of what is shown that [noise] which another law leaves at the size that explains most, and the channel where it leaves most.

    That size is found in proportion from the given one, then once more from there. One under which the recording lasts otherwise in every
    channel explains nothing.
    """
    left = excess(here, base)
    change = _change(here, base)
    for _ in range(PROPORTIONS):
        there = shown(other, size)
        if there is None:
            break
        own = _change(there, base)
        names = sorted(change.keys() & own.keys())
        if not names:
            break
        power = sum(float(own[name] @ own[name]) for name in names)
        factor = max(0.0, sum(float(own[name] @ change[name]) for name in names) / power) if power > 0 else 0.0
        rest = {name: float(np.sum((change[name] - factor * own[name]) ** 2)) / here[name].degrees for name in names}
        worst = max(rest, key=lambda name: rest[name])
        left = min(left, (float(np.sqrt(rest[worst])), worst), key=lambda one: one[0])
        if not 0 < factor * size < other.most:
            break
        size *= factor
    return left


def _change(here: Mapping[str, Misfit], base: Mapping[str, Misfit]) -> dict[str, NDArray[np.float64]]:
    """Of each channel what its residuals change by, 0 where either has none."""
    return {name: np.nan_to_num(one.z - base[name].z) for name, one in here.items() if name in base and len(base[name].z) == len(one.z)}


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
