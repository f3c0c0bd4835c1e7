"""Names and units of a study as a reader sees them."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.study import Factor, Indices, Measure, StudyTable

Array = NDArray[np.float64]
GROUPS = (
    "soil",
    "body",
    "wheel",
    "drive",
    "effect",
    "gravity",
    "landform",
    "base",
    "start",
    "scenario",
    "command",
)  # first words of factors
REDUCERS = ("mean", "max", "min", "final", "rms")
QUANTITIES = {
    *(f"joint.{word}" for word in ("position", "velocity", "effort")),
    *(f"part.{word}" for word in ("position", "orientation", "linear_velocity", "angular_velocity")),
    *(f"wheel.{word}" for word in ("slip_ratio", "slip_angle", "sinkage", "normal_load", "drawbar_pull", "side_force", "drive_torque")),
    *(f"motor.{word}" for word in ("current", "voltage")),
}


def label(name: str) -> str:
    """``soil.lunar.friction_angle`` -> ``friction angle (lunar)``, ``effect.slip_sinkage.*.slip_gain`` -> ``slip gain (slip sinkage)``,
    ``wheel.sinkage.front.max`` -> ``max sinkage (front)``, ``mean_slip_ratio.front`` -> ``mean slip ratio (front)``.
    """
    first, *between, last = name.split(".") if "." in name else ("", name)
    if ".".join([first, *between[:1]]) in QUANTITIES:
        reduced = [last] if last in REDUCERS else []
        of = ".".join([*between[1:], *([] if reduced else [last])])
        between, last = [of], " ".join([*reduced, between[0]])
    elif first and first not in GROUPS:
        between, last = [*between, last], first
    of = between[0] if first == "effect" and between else ".".join(between)
    if first in ("base", "start", "scenario", "command") and not of:
        of = {"base": "ground", "start": "start", "scenario": "", "command": "command"}[first]
    words = last.replace("_", " ")
    return f"{words} ({of.replace('_', ' ')})" if of and of != "*" else words


def scale(unit: str, largest: float) -> tuple[float, str]:
    """Factor and unit that such numbers are read in: degrees, millimetres where all is small, kilo-pascals where all is large."""
    if unit.startswith("rad"):
        return 180 / math.pi, "deg" + unit[3:]
    if unit == "m" and largest < 0.5:
        return 1e3, "mm"
    if unit == "Pa" and largest >= 1e4:
        return 1e-3, "kPa"
    return 1.0, unit


def titled(what: Factor | Measure, factor_unit: str) -> str:
    """Title of an axis."""
    return label(what.name) if factor_unit in ("-", "") else f"{label(what.name)} [{factor_unit}]"


def factor_axis(table: StudyTable, k: int) -> tuple[Array, str]:
    """Values of a factor in the unit that is shown, (cases,), and the title of its axis."""
    one, values = table.plan.factors[k], table.values[:, k]
    by, unit = scale(one.unit, float(np.abs(values).max(initial=0)))
    return by * values, titled(one, "of the model's" if one.relative else unit)


def outcome_axis(table: StudyTable, measure: Measure) -> tuple[Array, str]:
    """Values of an outcome in the unit that is shown, (cases,) with NaN, and the title of its axis."""
    values = table.outcome(measure.name)
    known = np.abs(values[np.isfinite(values)])
    by, unit = scale(measure.unit, float(known.max(initial=0)))
    return by * values, titled(measure, unit)


def order_of(table: StudyTable, results: Mapping[str, Indices | None]) -> list[int]:
    """Factors, the one that moves most of any outcome first."""
    shares = [one.strength for one in results.values() if one is not None]
    if not shares:
        return list(range(len(table.plan.factors)))
    return np.argsort(-np.nan_to_num(np.max(shares, axis=0)), kind="stable").tolist()


def strongest(one: Indices | None, count: int, order: Sequence[int]) -> list[int]:
    """The factors that move an outcome most; those of ``order`` where that is not known."""
    return list(order if one is None else one.ranked())[:count]


def part_of(table: StudyTable) -> str:
    """That numbers are of a part of the design only; '' when every case was run."""
    left, cases = int(table.waiting.sum()), len(table.status)
    return f"of a part of the design ({cases - left} of {cases} cases)" if left else ""
