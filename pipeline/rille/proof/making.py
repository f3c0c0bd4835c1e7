"""A trial as recordings: the generator runs the machine as it really is, sensors see it."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rille.model import Effect, InputRefused, PhysicsFailed, Scenario
from rille.model.recording import Recording
from rille.proof.generator import simulate
from rille.proof.hidden import Hidden
from rille.proof.lookalikes import lookalikes
from rille.proof.points import points_recording
from rille.proof.sensors import readings, recording, sampling
from rille.proof.strength import UNSEEN, Measure, Unreachable, find_size
from rille.proof.subject import near
from rille.proof.trials import TRAINING, Drawn

MOST_DRAWS = 12
NEAREST = 2  # of the laws that may stand for one, that are looked at closely
FARTHER = 6.0  # times the first size of a law, where that shows nothing
APART = 0.3  # in logarithms: the first two sizes of another law that are tried
CLOSE = 0.005  # relative, of that logarithm: so close to the size at which it explains most,
MOST_STEPS = 8  # in as many steps
FAILED = 1e18  # sum of squares of a law that explains nothing


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


Misfits = Callable[[Sequence[Recording], Sequence[Effect]], Mapping[str, Misfit]]
"""Recordings, effects on top of the base model -> channel -> what that does not reproduce of it."""


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
    base = misfits([generate(drawn, first, [])], ()) if drawn.hidden else {}
    return _with_pieces(drawn, tuple(_sized(drawn, hidden, first, misfits, base) for hidden in drawn.hidden))


def make_again(drawn: Drawn, truth: Mapping[str, Any]) -> Made:
    """The recordings of a trial whose truth is known: at the sizes that were found when it was made first, so that none is looked for.

    drawn : of the draw that the truth states.

    Raises
    ------
    Unreachable : if this draw does not conceal what the truth says, or cannot be run: it was made by another version.
    """
    said = truth["pieces"]
    if [(h.cause, h.kind, h.target) for h in drawn.hidden] != [(p["cause"], p["kind"], p["target"]) for p in said]:
        raise Unreachable(f"the draw of trial {drawn.trial.number} does not conceal what its truth says")
    sized = zip(drawn.hidden, said, strict=True)
    return _with_pieces(drawn, tuple(Piece(hidden=h, size=p["size"], strength=p["strength"], channel=p["channel"]) for h, p in sized))


def _with_pieces(drawn: Drawn, pieces: tuple[Piece, ...]) -> Made:
    """All recordings of a trial with things concealed at their sizes."""
    concealed = [(piece.hidden, piece.size) for piece in pieces]
    try:
        recordings = tuple(generate(drawn, scenario, concealed) for scenario in drawn.scenarios)
    except (PhysicsFailed, InputRefused) as error:
        raise Unreachable(str(error)) from error
    return Made(drawn=drawn, recordings=recordings, pieces=pieces)


def _sized(drawn: Drawn, hidden: Hidden, scenario: Scenario, misfits: Misfits, base: Mapping[str, Misfit]) -> Piece:
    """A concealed thing at the size that is as strong as wanted in the recording of a scenario. base : what that shows without it."""
    wanted = drawn.trial.strength

    def shown(one: Hidden, size: float) -> Recording | None:
        try:
            return generate(drawn, scenario, [(one, size)])
        except (PhysicsFailed, InputRefused):
            return None

    def beside(recording: Recording | None, effects: Sequence[Effect] = ()) -> Mapping[str, Misfit] | None:
        try:
            return misfits([recording], effects) if recording is not None else None
        except (PhysicsFailed, InputRefused):
            return None

    def strength(one: Hidden) -> Callable[[float], tuple[float, str]]:
        return lambda size: excess(beside(shown(one, size)), base)

    size, found, channel = find_size(strength(hidden), wanted, hidden.first, hidden.most, hidden.least)
    begun = [(other, _about_as_strong(strength(other), wanted, other)) for other in lookalikes(drawn.machine, hidden, drawn.kinds)]
    others = [(other, begin) for other, begin in begun if begin > 0]

    def left_by(recording: Recording | None, other: Hidden, begin: float) -> tuple[float, str]:
        return least_left(lambda size: beside(recording, other.laws(size)), excess(beside(recording), base), base, begin, other.most)

    if others:
        here, first = shown(hidden, size), size
        left = [excess(beside(here, other.laws(begin)), base)[0] for other, begin in others]
        nearest = [others[k] for k in np.argsort(left, kind="stable")[:NEAREST]]

        def unexplained(size: float) -> tuple[float, str]:
            here = shown(hidden, size)
            if here is None:
                return np.inf, ""
            return min((left_by(here, other, begin * size / first) for other, begin in nearest), key=lambda one: one[0])

        size, found, channel = find_size(unexplained, wanted, size, hidden.most, hidden.least)
    return Piece(hidden=hidden, size=size, strength=found, channel=channel)


def _about_as_strong(measure: Measure, wanted: float, one: Hidden) -> float:
    """A size at which something is about as strong as wanted, in proportion to the first at which it shows; 0 if it shows nothing."""
    for size in sorted({one.first, min(FARTHER * one.first, one.most), one.most}):
        found, _ = measure(size)
        if UNSEEN < found < np.inf:
            return min(size * wanted / found, one.most)
    return 0.0


def excess(here: Mapping[str, Misfit] | None, base: Mapping[str, Misfit]) -> tuple[float, str]:
    """sqrt(normalised^2 - that without the concealed thing, if above 1) of the channel where it is largest, and that channel: values at
    rest are all rounded alike. here : what is shown; None: physics ended the run, which is infinitely much. base : without it.
    """
    if here is None:
        return np.inf, ""
    beyond = {name: one.square - max(1.0, base[name].square if name in base else 1.0) for name, one in here.items()}
    worst = max(beyond, key=lambda name: beyond[name])
    return float(np.sqrt(max(0.0, beyond[worst]))), worst


def least_left(
    beside: Callable[[float], Mapping[str, Misfit] | None],
    without: tuple[float, str],
    base: Mapping[str, Misfit],
    begin: float,
    most: float,
) -> tuple[float, str]:
    """What a law leaves of a recording [noise] at the size that explains most of it, and the channel where it leaves most.

    Brent's method on the logarithm of the size. A size at which the model does not reach all that the base model does explains nothing.

    Parameters
    ----------
    beside : size -> misfits of the recording beside the base model with that law. without : excess beside the base model alone. base :
        misfits of a recording with nothing concealed. begin : a size to begin with. most : bound of the size.
    """
    tried: dict[float, tuple[float, tuple[float, str]]] = {}

    def square(logarithm: float) -> float:
        size = min(float(np.exp(logarithm)), most)
        if size not in tried:
            here = beside(size)
            reached = here is not None and all(
                np.isfinite(here[n].z).sum() >= np.isfinite(one.z).sum() for n, one in base.items() if n in here
            )
            whole = sum(float(np.nansum(one.z**2)) for one in here.values()) if here is not None and reached else FAILED
            tried[size] = whole, excess(here, base) if reached else (np.inf, "")
        return tried[size][0]

    last = float(np.log(min(begin, most)))
    with suppress(RuntimeError):  # no size explains more than its neighbours on both sides: the best of those tried stands
        minimize_scalar(square, bracket=(last - APART, last), options={"xtol": CLOSE, "maxiter": MOST_STEPS})
    return min(without, min(tried.values())[1], key=lambda one: one[0])


def generate(drawn: Drawn, scenario: Scenario, concealed: Sequence[tuple[Hidden, float]]) -> Recording:
    """One recording of a machine with things concealed at these sizes.

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
    truth = simulate(machine, replace(scenario, gravity=machine.gravity), laws, readings(sensors, when))
    return recording(machine, scenario, sensors, when, truth, seed)
