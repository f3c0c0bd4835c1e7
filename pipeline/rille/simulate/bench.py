"""The single-wheel bench in process, and effects in the form that the solver takes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from rille.model import BenchPoints, BenchWheel, Effect, EffectKind, InputRefused, Soil

EARTH = 9.80665  # [m/s^2]

Method = Literal["quasi_static", "dynamic"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchResult:
    """points : conditions and responses, NaN where the soil did not carry the load. status : ``done``, ``not_carried``, ``not_settled``."""

    points: BenchPoints
    status: tuple[str, ...]


def effect_rows(effects: Iterable[Effect], kinds: Sequence[EffectKind]) -> list[tuple]:
    """Effects completed by the catalogue (``store.effect_kinds()``); those without amplitude are left out, as the solver does."""
    known = {kind.name: kind for kind in kinds}
    rows = []
    for effect in effects:
        kind = known[effect.kind]
        values = {p.name: effect.parameters.get(p.name, 0.0 if p.amplitude else p.typical) for p in kind.parameters}
        numbers = {name: float(value) for name, value in values.items()}  # type: ignore[arg-type]
        if not any(numbers[p.name] != 0 for p in kind.parameters if p.amplitude):
            continue
        target = str(effect.parameters["target_kind"]) if kind.target == "any" else kind.target
        row: tuple = (kind.name, target, effect.target, numbers)
        if kind.name == "expression":
            constants = {k: (float(v[0]), str(v[1])) for k, v in dict(effect.parameters.get("constants", {})).items()}  # type: ignore[arg-type]
            row += (str(effect.parameters["formula"]), str(effect.parameters["output"]), constants)
        rows.append(row)
    return rows


def soil_numbers(soil: Soil, gravity: float = EARTH) -> dict[str, float]:
    """A soil as the solver takes it; gravity [m/s^2] makes its density a unit weight."""
    numbers = {name: float(value) for name in Soil.__dataclass_fields__ if isinstance(value := getattr(soil, name), int | float)}
    return numbers | {"unit_weight": soil.density * gravity}


def bench(
    law: str,
    soil: Soil,
    wheel: BenchWheel,
    *,
    load: ArrayLike,
    slip_ratio: ArrayLike,
    slip_angle: ArrayLike = 0.0,
    method: Method = "quasi_static",
    effects: Sequence[tuple] = (),
    gravity: float = EARTH,
    speed: float = 0.05,
    step: float = 1e-3,
    longest: float = 60.0,
    threads: int = 0,
) -> BenchResult:
    """Steady points of a wheel on a soil.

    Parameters
    ----------
    law : ``bekker``, ``bekker_wong`` or ``reece``.
    load [N], slip_ratio [-], slip_angle [rad] : scalars or arrays of one length, one point each.
    method : ``quasi_static``: root of the stress integrals; ``dynamic``: the rig in the solver until it has settled.
    effects : rows of ``effect_rows``. gravity : [m/s^2] of the soil's weight. speed : of the carriage [m/s].
    step, longest : [s] of the dynamic rig. threads : 0 = all cores.

    Raises
    ------
    InputRefused : for values that no rig could run.
    """
    from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

    asked = BenchPoints.at(load, slip_ratio, slip_angle)
    cases = np.ascontiguousarray(np.column_stack([asked.load, asked.slip_ratio, asked.slip_angle]))
    if not np.isfinite(cases).all():
        raise InputRefused("a load, slip ratio or slip angle of the bench is not a number; give finite values")
    shape = {
        "radius": wheel.radius,
        "width": wheel.width,
        "grouser_count": wheel.grouser_count,
        "grouser_height": wheel.grouser_height,
    }
    values, status = _solver.bench(law, soil_numbers(soil, gravity), shape, cases, method, list(effects), speed, step, longest, threads)
    values[np.array([word == "not_carried" for word in status], dtype=bool)] = np.nan
    points = replace(asked, sinkage=values[:, 0], drawbar_pull=values[:, 1], side_force=values[:, 2], drive_torque=values[:, 3])
    return BenchResult(points=points, status=tuple(status))


def bench_at(law: str, soil: Soil, wheel: BenchWheel, points: BenchPoints, **options: Any) -> BenchPoints:
    """The conditions of the points with calculated responses: what ``diagnosis.fit_soil`` takes. options : of ``bench``."""
    conditions = {"load": points.load, "slip_ratio": points.slip_ratio, "slip_angle": points.slip_angle}
    return bench(law, soil, wheel, **conditions, **options).points
