"""A study: what varies, by which design, what is asked of every case, and what came out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Design = Literal["grid", "latin_hypercube", "sobol"]
Spread = Literal["uniform", "log", "normal", "values"]
ChangeKind = Literal["parameter", "effect", "scenario", "start", "command", "ground"]
Reducer = Literal["mean", "max", "min", "final", "rms"]
Status = Literal["waiting", "done", "stopped", "left_terrain", "wheel_buried", "diverged", "refused", "error", "worker_died"]

CLEARLY = 0.02  # an index below this moves nothing that anybody would see
WHOLE: tuple[Status, ...] = ("done", "stopped")  # a case that went as its scenario says; its outcomes may be compared with others


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One thing that a factor changes.

    kind, name, number : ``parameter``: name of the solver's parameter. ``effect``: law, number; ``target``: its target. ``scenario``:
        step, duration, gravity. ``start``: x, y, heading. ``command``: drive, place of the command in its list. ``ground``: name of a
        landform (or ``base``), its key.
    relative : the value is a factor of what the model has.
    """

    kind: ChangeKind
    name: str
    target: str = ""
    number: str = ""
    relative: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Factor:
    """What varies.

    spread : ``uniform`` or ``log`` between low and high; ``normal`` about ``mean``, with the standard deviation ``sigma``; ``values``.
    All in SI, of ``unit``. relative : values are factors of what the model has, without unit. changes : what a value is given to.
    """

    name: str
    unit: str
    spread: Spread
    relative: bool = False
    changes: tuple[Change, ...] = ()
    low: float = 0.0
    high: float = 0.0
    mean: float = 0.0
    sigma: float = 0.0
    values: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """A number that is asked of every case. unit : SI. meaning : in words. main : shown first, and in figures."""

    name: str
    unit: str
    meaning: str
    main: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelMeasure:
    """A channel reduced to one number. quantity, target, component : as of a sensor. after : samples before that time [s] do not count."""

    name: str
    quantity: str
    target: str
    component: int
    reduce: Reducer
    after: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TracedChannel:
    """A channel that is kept over time."""

    name: str
    unit: str
    quantity: str
    target: str
    component: int


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyPlan:
    """A study before its first case.

    samples : base samples of a design that is drawn; 0 of a grid. seed : of its draws. second_order : pairs of factors, too (sobol).
    sheet, model : SHA-256 of what is asked, and of the model with scenario and terrain. model_file : the model's name.
    trace_time : (n,) [s] common times of traces; empty if none are kept.
    """

    name: str
    design: Design
    samples: int
    seed: int
    second_order: bool
    factors: tuple[Factor, ...]
    measures: tuple[Measure, ...]
    traced: tuple[TracedChannel, ...] = ()
    trace_time: tuple[float, ...] = ()
    model_file: str = ""
    sheet: str = "0" * 64
    model: str = "0" * 64
    version: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One case: a value [SI] for each factor, in their order."""

    number: int
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResult:
    """What came of a case.

    status : ``done``, ``stopped`` (by a watch); physics that ended it early; ``refused`` (model or value cannot be), ``error`` (an
        exception), ``worker_died``. reason : in a sentence, empty if it went as planned. outcomes : by name [SI]; what has no value is
        left out. traces : (channels, times), NaN after the case has ended. seconds : it took.
    """

    number: int
    status: Status
    reason: str = ""
    outcomes: Mapping[str, float] = field(default_factory=dict)
    traces: Array | None = None
    seconds: float = 0.0


def lost_case(case: Case, why: str) -> CaseResult:
    """The row of a case that takes its worker along."""
    return CaseResult(number=case.number, status="worker_died", reason=why)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyTable:
    """A study with what is known of its cases.

    values : (cases, factors) [SI]. outcomes : (cases, measures) [SI], NaN where there is none. status, reason : of each case.
    """

    plan: StudyPlan
    values: Array
    outcomes: Array
    status: tuple[Status, ...]
    reason: tuple[str, ...]

    @property
    def whole(self) -> NDArray[np.bool_]:
        """(cases,) cases that went as planned."""
        return np.array([status in WHOLE for status in self.status], dtype=bool)

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """(cases,) cases that were not run yet."""
        return np.array([status == "waiting" for status in self.status], dtype=bool)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(cases,) cases that were run and did not go as planned."""
        return ~self.whole & ~self.waiting

    def outcome(self, name: str) -> Array:
        """(cases,) an outcome; NaN for cases that did not go as planned."""
        names = [measure.name for measure in self.plan.measures]
        return np.where(self.whole, self.outcomes[:, names.index(name)], np.nan)

    def main_measures(self) -> tuple[Measure, ...]:
        """Measures that are shown first; all if none is marked."""
        return tuple(m for m in self.plan.measures if m.main) or self.plan.measures


@dataclass(frozen=True, slots=True, kw_only=True)
class Indices:
    """How much of an outcome's variance each factor brings.

    method : in words. first, first_confidence : (factors,) share that goes with the factor alone, and half its 95 % interval. total,
    total_confidence : with all that it does together with others; None where the method has none. second : (factors, factors) shares
    that pairs bring beyond both, NaN on and below the diagonal. used, dropped : cases that counted, and that could not. are_shares :
    whether these are shares of the variance at all.
    """

    outcome: str
    method: str
    first: Array
    first_confidence: Array | None
    total: Array | None = None
    total_confidence: Array | None = None
    second: Array | None = None
    used: int
    dropped: int
    are_shares: bool = True

    @property
    def strength(self) -> Array:
        """What a factor does in all, (factors,): with others where the method tells that, else alone."""
        return self.first if self.total is None else self.total

    def ranked(self) -> list[int]:
        """All factors, the strongest first; one whose strength is not known counts as 0."""
        return np.argsort(-np.nan_to_num(self.strength), kind="stable").tolist()

    def movers(self, most: int) -> list[int]:
        """The factors that clearly move the outcome, the strongest first."""
        return [k for k in self.ranked()[:most] if self.strength[k] > CLEARLY]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bands:
    """Percentiles over the cases of a channel over time. time : (n,) [s]. levels : percentiles. values : (levels, n). cases : how many."""

    channel: TracedChannel
    time: Array
    levels: tuple[float, ...]
    values: Array
    cases: int
