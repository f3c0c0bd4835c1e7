"""What a column's name says of its unit, against what the manifest says."""

import tomllib
from collections.abc import Mapping
from typing import Any

from rille.model.quantity import factor_of
from rille.model.recording import Channel, GateFinding, Recording
from rille.recording.gate.unit_names import spelt_unit


def check_header(recording: Recording) -> list[GateFinding]:
    """Columns, that of time included, whose name states another unit than the manifest does. Declared scales are believed."""
    try:
        manifest: Mapping[str, Any] = tomllib.loads(recording.manifest)
    except tomllib.TOMLDecodeError:
        return []
    time = manifest.get("time", {})
    entries = [entry for entry in manifest.get("channel", []) if isinstance(entry, dict)]
    stamps = [sheet.get(key) for key, sheets in (("column", [time]), ("time", entries)) for sheet in sheets]
    found = [f for column in dict.fromkeys(stamps) if isinstance(column, str) for f in _time(column, time.get("unit"))]
    for entry in entries:
        if "scale" in entry or entry.get("role") == "ignore":
            continue
        column = str(entry.get("column", ""))
        name = entry.get("name") or column
        for channel in recording.channels:
            if channel.name == name or channel.name.startswith(f"{name} ("):
                found += _compare(channel, column, entry.get("unit"))
                break
    return found


def _time(column: str, unit: object) -> list[GateFinding]:
    spelt, declared = spelt_unit(column, "s"), _factor(unit, "s")
    if spelt is None or declared is None or _equal(spelt[1], declared):
        return []
    said = f"the time column '{column}' is named for {spelt[0]}, but [time] says unit = \"{unit}\""
    message = f'{said}; state the right one, or accept "time_unit"'
    return [GateFinding(code="time_unit", severity="error", detail={"name": spelt[0], "declared": unit}, message=message)]


def _compare(channel: Channel, column: str, unit: object) -> list[GateFinding]:
    spelt, declared = spelt_unit(column, channel.unit), _factor(unit, channel.unit)
    if spelt is None or declared is None or _equal(spelt[1], declared):
        return []
    message = (
        f"column '{column}' is named for {spelt[0]}, but the manifest says unit = \"{unit}\"; state the right one, "
        'or accept "header" for this channel'
    )
    detail = {"name": spelt[0], "declared": unit, "factor": spelt[1] / declared}
    return [GateFinding(code="header", severity="error", channel=channel.name, detail=detail, message=message)]


def _factor(unit: object, si: str) -> float | None:
    """As ``factor_of``: a unit of another dimension may be mended by a scale, which import judges."""
    return factor_of(unit, si) if isinstance(unit, str) else None


def _equal(one: float, other: float) -> bool:
    return abs(one / other - 1) < 1e-6
