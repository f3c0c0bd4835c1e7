"""A bench that a recording of points was made on, as diagnosis runs it: conditions, wheel, soil, and the simulator of the rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from rille.model import BenchPoints, BenchWheel, Effect, Soil
from rille.model.hypothesis import Setting, Term
from rille.model.recording import Channel, Recording

LUGS = 0.25  # [-] N h / (2 pi r) of the grousers that a wheel without known ones is given for effects of grousers; the base laws feel none
LOG = "log_factor"  # free number of a parameter that is looked for by its logarithm: value x exp(log_factor)
LOAD = "load"  # kind of the parameter hypothesis that the load is another than the manifest says


class RigSimulator(Protocol):
    """Points of a rig. Effects come on top of those of the model."""

    def __call__(
        self, points: BenchPoints, soil: Soil, wheel: BenchWheel, effects: Sequence[Effect]
    ) -> tuple[BenchPoints, Sequence[str]]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRig:
    """recording : of kind points. conditions : of all its points, as recorded. wheel : its name; shape : its size. speed : [m/s].
    own_soil : whether the soil is the model's, so that a diagnosis can be put into it.
    """

    recording: Recording
    conditions: BenchPoints
    wheel: str
    shape: BenchWheel
    soil: Soil
    speed: float
    run: RigSimulator
    own_soil: bool = True

    @property
    def load_error(self) -> float:
        """1 sigma of the load relative to it, where the manifest says that it is not known well; 0: known."""
        return float(self.recording.setup.get("load_error", 0.0))  # pyright: ignore[reportArgumentType]

    @property
    def stated_load(self) -> str:
        """The load of the manifest in words; '' where every point has its own. Rigs of one stated load have one error of it."""
        return f"{float(self.recording.setup['load']):.6g} N" if "load" in self.recording.setup else ""  # pyright: ignore[reportArgumentType]

    @property
    def unknown_zeros(self) -> tuple[str, ...]:
        """Names of the channels whose zero the manifest calls unknown."""
        return tuple(self.recording.setup.get("unknown_zero", ()))  # pyright: ignore[reportArgumentType]

    def of(self, term: Term) -> bool:
        """Whether a term acts on this rig."""
        hypothesis = term.hypothesis
        if hypothesis.cause == "sensor":
            recording, _, channel = hypothesis.target.rpartition("/")
            return recording in ("", self.recording.name) and any(c.name == channel for c in self.recording.channels)
        here = {"soil": self.soil.name, "load": self.stated_load}.get(hypothesis.target_kind, self.wheel)
        return hypothesis.target in ("*", here)


def parameter_factors(term: Term) -> dict[str, float]:
    """Solver parameter -> what its value is multiplied by, of a parameter hypothesis whose number is a ``log_factor``."""
    values = term.numbers
    return {parameter: float(np.exp(values[number])) for number, parameter, _ in term.hypothesis.moves if number == LOG}


def parameter_offsets(term: Term) -> dict[str, float]:
    """Solver parameter -> what is added to its value, of a parameter hypothesis whose number is that of the parameter itself."""
    values, absent = term.numbers, {n.name: n.absent for n in term.hypothesis.free}
    return {parameter: factor * (values[n] - absent[n]) for n, parameter, factor in term.hypothesis.moves if n != LOG}


def changed_soil(soil: Soil, setting: Setting) -> Soil:
    """The soil with the parameters that a setting moves."""
    values: dict[str, float] = {}
    for term in setting:
        if term.hypothesis.target_kind == "soil" and term.hypothesis.target in ("*", soil.name):
            for parameter, factor in parameter_factors(term).items():
                name = parameter.rpartition(".")[2]
                values[name] = values.get(name, float(getattr(soil, name))) * factor
            for parameter, offset in parameter_offsets(term).items():
                name = parameter.rpartition(".")[2]
                # An offset that reaches a bound must not pass it by a rounding: the solver refuses that.
                values[name] = round(values.get(name, float(getattr(soil, name))) + offset, 14)
    return replace(soil, **values) if values else soil  # pyright: ignore[reportArgumentType]


def with_lugs(wheel: BenchWheel) -> BenchWheel:
    """A wheel without known grousers with ``LUGS``, so that effects of grousers can be tried on it."""
    if wheel.grouser_count:
        return wheel
    count = 16
    return replace(wheel, grouser_count=count, grouser_height=LUGS * 2 * np.pi * wheel.radius / count)


def responses(rig: BenchRig, points: BenchPoints, setting: Setting) -> tuple[BenchPoints, Sequence[str]]:
    """What the rig gives at these points under a setting; sensor faults are none of its business."""
    terms = [term for term in setting if rig.of(term)]
    effects = [Effect(kind=t.hypothesis.kind, target="*", parameters=t.numbers) for t in terms if t.hypothesis.cause == "effect"]
    loads = [t.numbers for t in terms if t.hypothesis.cause == "parameter" and t.hypothesis.kind == LOAD]
    asked = points
    for numbers in loads:
        asked = replace(asked, load=asked.load * np.exp(numbers[LOG]))
    soil = changed_soil(rig.soil, setting)
    if soil.cohesive_modulus / rig.shape.width + soil.frictional_modulus <= 0:  # no ground at all, which a fit may ask for
        return BenchPoints.at(points.load, points.slip_ratio, points.slip_angle), ["not_carried"] * len(points)
    found, status = rig.run(asked, soil, with_lugs(rig.shape) if effects else rig.shape, effects)
    return replace(found, load=points.load), status


def faulty(channel: Channel, values: np.ndarray, setting: Setting, rig: BenchRig) -> np.ndarray:
    """What a channel says of the true values (n,), with the sensor faults of a setting on it."""
    for term in setting:
        hypothesis = term.hypothesis
        if hypothesis.cause == "sensor" and rig.of(term) and hypothesis.target.rpartition("/")[2] == channel.name:
            values = FAULTS[hypothesis.kind](values, term.numbers)
    return values


def _saturated(values: np.ndarray, numbers: Mapping[str, float]) -> np.ndarray:
    inverse = numbers["inverse_range"]
    return np.clip(values, -1 / inverse, 1 / inverse) if inverse > 0 else values


FAULTS = {  # of single points: what has to do with time is not among them
    "bias": lambda values, numbers: values + numbers["offset"],
    "scale": lambda values, numbers: values * (1 + numbers["relative_error"]),
    "saturation": _saturated,
    "wrong_sign": lambda values, numbers: values * (1 - 2 * numbers["flip"]),
}
WHOLE = {"wrong_sign": {"flip": 1.0}}  # faults that are there or not, with their numbers
