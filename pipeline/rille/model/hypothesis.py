"""What may be wrong: a physical effect that the model lacks, a number that it has wrong, a sensor that lies. Values only."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Cause = Literal["effect", "parameter", "sensor"]
Search = Literal["local", "scale", "phase", "order", "place", "time"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeNumber:
    """A number that a hypothesis leaves open.

    amplitude : the hypothesis changes nothing where all amplitudes are ``absent`` (0 of an effect, the model's value of a parameter).
    lower, upper : bounds. start : first guess. spread : 1 sigma of what is usual, and the size of a trial change. All in ``unit``.
    search : how it is looked for if it is no amplitude; ``local`` from ``start``, ``scale`` over decades (or octaves) about it, ``phase``
    around the circle, ``order`` over whole numbers, ``place`` over where the machine was, ``time`` over when it was.
    tries : values of an amplitude that are tried beside: what shifts in time fits again and again where a signal repeats.
    believed : distance of an amplitude from ``absent`` beyond which it is believed last of all: half of gravity is another planet. None:
    any is believed.
    """

    name: str
    unit: str
    amplitude: bool
    lower: float
    upper: float
    start: float
    spread: float
    absent: float = 0.0
    search: Search = "local"
    tries: tuple[float, ...] = ()
    believed: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """One thing that may be wrong.

    cause : ``effect`` of the catalogue, ``parameter`` of the model, or ``sensor`` fault. kind : name of the effect or fault, or what the
    parameter is ("cohesion", "mass", "track_width"). target : name of what it acts on ('*': all of its kind; of a sensor fault the name
    of the recorded channel). target_kind : wheel, joint, body, terrain, world, soil, drive, channel, machine.
    free : numbers that are left open. fixed : others of the effect, SI. moves : of a parameter, (free number, parameter of the solver,
    factor): the solver's parameter becomes its value in the model + factor (number - absent).
    words : what is no number of an effect: formula, output, constants and target_kind of an expression.
    memory : what it does now depends on what was before the window (ruts, sloshing): windows must be run one after the other.
    passive : it can only take energy out.
    """

    cause: Cause
    kind: str
    target: str
    target_kind: str
    free: tuple[FreeNumber, ...]
    fixed: Mapping[str, float] = field(default_factory=dict)
    moves: tuple[tuple[str, str, float], ...] = ()
    words: Mapping[str, object] = field(default_factory=dict)
    memory: bool = False
    passive: bool = False

    @property
    def title(self) -> str:
        """In words: "coulomb_friction of hub_fl"."""
        return self.kind if self.target == "" else f"{self.kind} of {'all' if self.target == '*' else self.target}"

    @property
    def is_local(self) -> bool:
        """Whether it is about a moment or a place: it begins or ends there."""
        return any(number.search in ("time", "place") for number in self.free)

    def at(self, values: Mapping[str, float] | None = None) -> "Term":
        """The hypothesis with these numbers; others at their first guess, amplitudes absent."""
        given = values or {}
        return Term(hypothesis=self, values=tuple(float(given.get(n.name, n.absent if n.amplitude else n.start)) for n in self.free))


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """A hypothesis with numbers: ``values`` in the order of ``hypothesis.free``."""

    hypothesis: Hypothesis
    values: tuple[float, ...]

    @property
    def numbers(self) -> dict[str, float]:
        """All numbers by name, the fixed ones too."""
        return dict(self.hypothesis.fixed) | {n.name: v for n, v in zip(self.hypothesis.free, self.values, strict=True)}

    @property
    def moment(self) -> tuple[float, float] | None:
        """Begin and end [s] of the time in which it acts; None: at all times."""
        numbers = self.numbers
        begin = [numbers[n.name] for n in self.hypothesis.free if n.search == "time"]
        if not begin:
            return None
        length = [numbers[n.name] for n in self.hypothesis.free if n.search == "scale" and n.unit == "s"]
        return min(begin), max(begin) + sum(length) if length else math.inf

    @property
    def is_far_fetched(self) -> bool:
        """Whether an amplitude is farther from absence than is believed."""
        free = zip(self.hypothesis.free, self.values, strict=True)
        return any(n.amplitude and n.believed is not None and abs(value - n.absent) > n.believed for n, value in free)


Setting = tuple[Term, ...]
"""What is assumed together, on top of the base model and the recording as it is; () is the base model."""
