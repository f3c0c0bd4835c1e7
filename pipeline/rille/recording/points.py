"""Recordings of a wheel bench: what the manifest says of the rig, and the conditions of the points as the bench takes them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rille.model import BenchPoints, InputRefused
from rille.model.quantity import to_si
from rille.model.recording import Channel, Recording
from rille.model.sheet import Sheet, validate_sheet

Array = NDArray[np.float64]
Number = float | int | str
CONDITIONS = {"load": "wheel.normal_load", "slip_ratio": "wheel.slip_ratio", "slip_angle": "wheel.slip_angle"}
UNITS = {"load": "N", "slip_ratio": "1", "slip_angle": "rad"}


class BenchSheet(Sheet):
    """Table ``[bench]`` of a manifest. Lengths, forces, angles and speeds: SI numbers or quantities.

    radius, width : of the rim; not needed if the database has the wheel. grousers : ``"24 x 10 mm"``, or grouser_count and grouser_height.
    soil : name in the database or the library. soil_values : the soil's numbers, all of them or, with ``soil``, those that differ.
    soil_known : the soil was fitted to other points before, and diagnosis leaves its numbers as they are.
    law : bekker, bekker_wong or reece. gravity : moon, mars, earth or a number. speed : of the carriage.
    load, slip_ratio, slip_angle : where one value was the same for all points and there is no channel of it.
    load_error : 1 sigma of the load relative to it, where it is not known well ("10 %").
    unknown_zero : columns of observed channels whose zero is not known (sinkage from some mark).
    slip_speed : the speed over ground that the recorded slip ratio means: along the wheel's heading, or along the carriage's travel.
    """

    radius: Number | None = None
    width: Number | None = None
    grousers: str | None = None
    grouser_count: int | None = None
    grouser_height: Number | None = None
    soil: str | None = None
    soil_values: dict[str, Any] | None = None
    soil_known: bool = False
    law: Literal["bekker", "bekker_wong", "reece"] = "bekker_wong"
    gravity: Number = "earth"
    speed: Number = 0.05
    load: Number | None = None
    slip_ratio: Number | None = None
    slip_angle: Number | None = None
    slip_speed: Literal["heading", "travel"] = "heading"
    load_error: Number | None = None
    unknown_zero: list[str] | None = None


def bench_setup(table: Mapping[str, object], what: str) -> dict[str, object]:
    """The table ``[bench]`` of a manifest as ``Recording.setup``: plain JSON values, SI. ``what`` names the manifest in sentences.

    Raises
    ------
    InputRefused : for an unknown key, a value that is no such quantity, or a wheel that cannot be.
    """
    sheet = validate_sheet(table, BenchSheet, f"{what}, [bench]")
    setup: dict[str, object] = {"wheel": _wheel(sheet, what), "law": sheet.law, "gravity": sheet.gravity, "slip_speed": sheet.slip_speed}
    setup["speed"] = _positive(to_si(sheet.speed, "speed", f"speed in [bench] of {what}"), "speed", "m/s", what)
    if sheet.soil is not None:
        setup["soil"] = sheet.soil
    if sheet.soil_values is not None:
        setup["soil_values"] = dict(sheet.soil_values)
    if sheet.soil_known:
        setup["soil_known"] = True
    for name, unit in UNITS.items():
        value = getattr(sheet, name)
        if value is not None:
            setup[name] = to_si(value, "dimensionless" if unit == "1" else unit, f"{name} in [bench] of {what}")
    if sheet.load_error is not None:
        error = to_si(sheet.load_error, "dimensionless", f"load_error in [bench] of {what}")
        if not 0 < error < 1:
            raise InputRefused(f"load_error in [bench] of {what} is {error:g}; it is a share of the load, above 0 and below 1")
        setup["load_error"] = error
    if sheet.unknown_zero:
        setup["unknown_zero"] = list(sheet.unknown_zero)
    if "load" in setup:
        _positive(setup["load"], "load", "N", what)  # pyright: ignore[reportArgumentType]
    return setup


def _wheel(sheet: BenchSheet, what: str) -> dict[str, object]:
    if sheet.radius is None and sheet.width is None and sheet.grousers is None and sheet.grouser_height is None:
        return {}
    if sheet.radius is None or sheet.width is None:
        raise InputRefused(f"[bench] of {what} states half a wheel; give both radius and width, or leave the wheel to the model")
    wheel: dict[str, object] = {
        name: _positive(to_si(value, "length", f"{name} in [bench] of {what}"), name, "m", what)
        for name, value in (("radius", sheet.radius), ("width", sheet.width))
    }
    count, height = sheet.grouser_count or 0, sheet.grouser_height or 0.0
    if sheet.grousers is not None:
        text, cross, height = sheet.grousers.partition("x")
        if not cross or not text.strip().isdigit():
            raise InputRefused(f'grousers in [bench] of {what} are "{sheet.grousers}"; write their number and height, "24 x 10 mm"')
        count = int(text)
    size = to_si(height.strip() if isinstance(height, str) else height, "length", f"height of the grousers in [bench] of {what}")
    if count < 0 or size < 0:
        raise InputRefused(f"[bench] of {what} states {count} grousers of {size:g} m; both must be 0 or more")
    return wheel | {"grouser_count": count, "grouser_height": size}


def _positive(value: float, name: str, unit: str, what: str) -> float:
    if not value > 0:
        raise InputRefused(f"{name} in [bench] of {what} is {value:g} {unit}; it must be above 0")
    return value


def along_heading(slip_ratio: ArrayLike, slip_angle: ArrayLike) -> Array:
    """Slip ratio along the wheel's heading from the one that was formed with the speed of travel.

    With u = r w / V, V the speed of travel at the slip angle b: u = 1/(1 - s) for s >= 0, else 1 + s; along the heading the ground passes
    with V cos b, so that s' = 1 - cos(b) / u where u >= cos(b), else u / cos(b) - 1. (n,), (n,) -> (n,).
    """
    slip, angle = np.broadcast_arrays(np.asarray(slip_ratio, dtype=float), np.asarray(slip_angle, dtype=float))
    along = np.abs(np.cos(angle))
    with np.errstate(divide="ignore", invalid="ignore"):
        rim = np.where(slip >= 0, 1 / (1 - np.minimum(slip, 1.0)), 1 + slip)
        return np.where(rim >= along, 1 - along / rim, rim / along - 1)


def bench_target(recording: Recording) -> str:
    """The one wheel that the points were measured of.

    Raises
    ------
    InputRefused : if there is none, or several.
    """
    targets = sorted({c.target for c in recording.channels if c.role != "ignore" and c.quantity.startswith("wheel.")})
    if not targets:
        raise InputRefused(f"recording '{recording.name}' has no channel of a wheel; bench points need wheel.slip_ratio and a response")
    if len(targets) > 1:
        raise InputRefused(
            f"recording '{recording.name}' has points of {len(targets)} wheels ({', '.join(targets)}); "
            "give every wheel a recording of its own, with `where` in the manifest"
        )
    return targets[0]


def condition_channel(recording: Recording, name: str) -> Channel | None:
    """The channel of a condition (``load``, ``slip_ratio``, ``slip_angle``): a command before what was measured, None if there is none."""
    found = [c for c in recording.channels if c.quantity == CONDITIONS[name] and c.role != "ignore"]
    return min(found, key=lambda c: c.role != "command", default=None)


def bench_conditions(recording: Recording) -> BenchPoints:
    """Conditions of all points as recorded, (n,) each, NaN where one is missing; slip ratios beyond 1 by 2 % at most are clipped.

    Single points without load (a wheel in the air) count as missing. The slip ratio is that of ``setup["slip_speed"]``; ``along_heading``
    makes what the bench takes of ``travel``.

    Raises
    ------
    InputRefused : without slip ratio or load, or for values that no wheel can have.
    """
    given: dict[str, Any] = {}
    for name in CONDITIONS:
        channel = condition_channel(recording, name)
        if channel is not None:
            given[name] = channel.value
        elif name in recording.setup:
            given[name] = float(recording.setup[name])  # pyright: ignore[reportArgumentType]
        elif name == "slip_angle":
            given[name] = 0.0
        else:
            example = {"load": 'load = "30 N"', "slip_ratio": "slip_ratio = 0.2"}[name]
            raise InputRefused(
                f"recording '{recording.name}' does not say the {name.replace('_', ' ')} of its points; "
                f"give it a channel {CONDITIONS[name]}, or state {example} in [bench]"
            )
    n = max((len(c.value) for c in recording.channels), default=0)
    points = BenchPoints.at(**{name: np.broadcast_to(value, n).astype(float) for name, value in given.items()})
    if np.count_nonzero(points.load > 0) > np.count_nonzero(points.load <= 0):
        points = replace(points, load=np.where(points.load > 0, points.load, np.nan))
    _refuse_outside(recording.name, points)
    return replace(points, slip_ratio=np.clip(points.slip_ratio, -1, 1))


def _refuse_outside(name: str, points: BenchPoints) -> None:
    bounds = {
        "slip_ratio": (np.abs(points.slip_ratio) > 1.02, "", "must lie in -1 to 1 (percent? state the unit)"),
        "slip_angle": (np.abs(points.slip_angle) > np.pi / 2 + 1e-6, " rad", "must lie within a quarter turn (degrees? state the unit)"),
        "load": (points.load <= 0, " N", "must be above 0 (measured downward negative? scale = -1)"),
    }
    for quantity, (outside, unit, rule) in bounds.items():
        if outside.any():
            k = int(np.argmax(outside))
            value = getattr(points, quantity)[k]
            raise InputRefused(f"the {quantity.replace('_', ' ')} of point {k} of recording '{name}' is {value:g}{unit}; it {rule}")
