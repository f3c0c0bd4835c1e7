"""The free numbers of a setting as one vector: logarithms where decades matter, bounds, weak priors, usual sizes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rille.diagnosis.evidence.evidence import Array
from rille.model.hypothesis import FreeNumber, Setting, Term

WIDE = 100.0  # [spread] prior of an amplitude
LOOSE = 3.0  # [spread] prior of a shape
DECADES = 1.5  # [ln] prior of a shape that is looked for over decades, at least: as far as its spread lies from its usual value
STRIDES = {"log": 1.1, "phase": 1.0}  # largest step of one iteration


@dataclass(frozen=True, slots=True)
class Unknown:
    """One number that is fitted. term : its place in the setting. log : the coordinate is its logarithm. centre, precision : prior."""

    term: int
    number: FreeNumber
    log: bool
    centre: float
    precision: float

    def coordinate(self, value: float) -> float:
        """What the fit works with."""
        return float(np.log(max(value, 1e-300))) if self.log else value

    def value(self, coordinate: float) -> float:
        """Back again, within the bounds; a phase within one turn."""
        if self.number.search == "phase":
            coordinate = float((coordinate + np.pi) % (2 * np.pi) - np.pi)
        return float(np.clip(np.exp(min(coordinate, 600.0)) if self.log else coordinate, self.number.lower, self.number.upper))

    @property
    def bounds(self) -> tuple[float, float]:
        """Of the coordinate; a phase has none."""
        if self.number.search == "phase":
            return -np.inf, np.inf
        return self.coordinate(self.number.lower) if self.number.lower > 0 or not self.log else -np.inf, self.coordinate(self.number.upper)

    @property
    def stride(self) -> float:
        """Largest step of one iteration."""
        if self.number.amplitude:
            return np.inf
        return STRIDES["log"] if self.log else STRIDES.get(self.number.search, 3.0 * max(self.number.spread, 1e-12))

    def size(self, coordinate: float) -> float:
        """How large the number is now, as far as the size of a trial change is concerned."""
        if self.log:
            return 1.0
        if self.number.amplitude:
            return max(abs(coordinate - self.number.absent), 1e-3 * self.number.spread, 1e-12)
        return 1.0 if self.number.search == "phase" else max(self.number.spread, 1e-12)


def unknowns_of(setting: Setting) -> tuple[Unknown, ...]:
    """All free numbers of a setting that can vary continuously; whole numbers stay as they are."""
    found = []
    for place, term in enumerate(setting):
        for number, value in zip(term.hypothesis.free, term.values, strict=True):
            if number.search == "order" or number.upper <= number.lower or (number.spread <= 0 and not number.amplitude):
                continue
            log = number.search == "scale" and number.lower >= 0 and not number.amplitude and min(value, number.start) > 0
            decades = max(DECADES, float(np.log(number.spread / number.start))) if log and number.spread > 0 else DECADES
            width = WIDE * number.spread if number.amplitude else decades if log else LOOSE * number.spread
            centre = number.absent if number.amplitude else value if number.search in ("place", "time", "phase") else number.start
            unknown = Unknown(place, number, log, 0.0, 1.0 / width**2 if width > 0 else 0.0)
            found.append(Unknown(place, number, log, unknown.coordinate(centre), 0.0 if number.search == "phase" else unknown.precision))
    return tuple(found)


def coordinates(setting: Setting, unknowns: Sequence[Unknown]) -> Array:
    """(k,) where a setting is."""
    return np.array([u.coordinate(setting[u.term].numbers[u.number.name]) for u in unknowns])


def setting_at(setting: Setting, unknowns: Sequence[Unknown], where: Array) -> Setting:
    """The setting with its free numbers put at coordinates (k,)."""
    values = [dict(term.numbers) for term in setting]
    for unknown, coordinate in zip(unknowns, where, strict=True):
        values[unknown.term][unknown.number.name] = unknown.value(float(coordinate))
    return tuple(
        Term(hypothesis=t.hypothesis, values=tuple(v[n.name] for n in t.hypothesis.free)) for t, v in zip(setting, values, strict=True)
    )
