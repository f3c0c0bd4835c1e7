"""A difference as JSON, as a table in CSV and as text."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from rille.model.difference import ChannelDifference, Difference, RegimeDifference

COLUMNS = (
    *(
        "recording",
        "channel",
        "quantity",
        "component",
        "target",
        "unit",
        "windows",
        "n",
        "rms",
        "rms_low",
        "rms_high",
        "bias",
        "bias_error",
    ),
    *("noise", "noise_from", "normalised", "normalised_low", "normalised_high", "structure", "lag1", "lag1_error", "p_white"),
    *("delay", "delay_error", "gain", "gain_error", "p", "q", "differs", "verdict", "left_out"),
)


def difference_json(difference: Difference) -> dict[str, Any]:
    """Plain JSON values: the keys are the fields of ``rille.model.difference``, where their meaning and units are stated.

    Arrays become lists; what could not be told (NaN, infinite) becomes null. Top level: model, recordings, mode, differs, sentence,
    chi2_per_degree, false_discovery_rate, channels, windows (worst first), targets (worst first), regimes (strongest first), runs (per
    recording and channel), notes.
    """
    return _plain(difference)


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return [_plain(item) for item in value.tolist()]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def difference_csv(difference: Difference) -> str:
    """One row per channel over all recordings (recording = "*"), then, if there are several, one per recording and channel; SI."""
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n", restval="")
    writer.writeheader()
    several = len(difference.recordings) > 1
    known = {channel.name: channel for channel in difference.channels}
    for channel in difference.channels:
        writer.writerow(_row("*" if several else difference.recordings[0], channel))
    for run in [run for run in difference.runs if several]:
        channel = known[run.channel]
        same = {name: getattr(channel, name) for name in ("quantity", "component", "target", "unit", "left_out")}
        numbers = {"n": run.n, "rms": run.rms, "bias": run.bias, "normalised": run.normalised}
        writer.writerow({"recording": run.recording, "channel": run.channel} | same | {k: _cell(v) for k, v in numbers.items()})
    return out.getvalue()


def _row(recording: str, channel: ChannelDifference) -> dict[str, object]:
    row: dict[str, object] = {"recording": recording, "channel": channel.name}
    row |= {name: getattr(channel, name) for name in COLUMNS if hasattr(channel, name)}
    row |= {name: getattr(channel.lag_fit, name) for name in ("delay", "delay_error", "gain", "gain_error")}
    if channel.whiteness is not None:
        row |= {"lag1": channel.whiteness.lag1, "lag1_error": channel.whiteness.lag1_error, "p_white": channel.whiteness.p}
    return {name: _cell(value) for name, value in row.items()}


def _cell(value: object) -> object:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.9g}" if math.isfinite(value) else ""
    return value


def difference_lines(difference: Difference, most: int = 5) -> list[str]:
    """The table for people: verdict, channels, the ``most`` worst windows, targets and regimes; regimes that go in step are one row."""
    channels = difference.channels
    rows = [("channel", "of", "n", "RMS", "bias", "noise", "RMS/noise [95 %]", "lag 1", "delay [ms]", "gain", "verdict")]
    rows += [_cells(channel) for channel in channels]
    lines = [difference.sentence, "", *_aligned(rows, left={0, 1, 10})]
    if len(difference.windows) > 1 and any(window.n for window in difference.windows):
        points = difference.mode == "points"
        ends = ("first point", "last point") if points else ("start [s]", "stop [s]")
        rows = [("worst curves" if points else "worst windows", *ends, "RMS/noise", "q", "channel", "share", "start shift", "ended")]
        several = len(difference.recordings) > 1
        for window in difference.windows[:most]:
            name = f"{window.recording} {window.number}" if several else str(window.number)
            cells = (name, f"{window.start:.4g}", f"{window.stop:.4g}", _short(window.normalised), _p(window.q), window.channel)
            rows.append((*cells, _percent(window.share), _short(window.shift), window.ended))
        lines += ["", *_aligned(rows, left={0, 5, 8})]
    if difference.targets:
        rows = [("targets", "kind", "RMS/noise", "share of excess", "differs")]
        rows += [
            (target.name, target.kind, _short(target.normalised), _percent(target.share), "yes" if target.differs else "no")
            for target in difference.targets[:most]
        ]
        lines += ["", *_aligned(rows, left={0, 1})]
    alike: dict[tuple[str, str], list[RegimeDifference]] = {}
    for row in difference.regimes:
        if row.differs:
            alike.setdefault((row.channel, f"{row.explained:.3g} {abs(row.trend):.3g}"), []).append(row)
    if alike:
        rows = [("depends on", "channel", "explained", "trend [noise]", "growth [noise^2]", "q")]
        for row, *others in list(alike.values())[:most]:
            trend, growth = f"{_short(row.trend)} +- {_short(row.trend_error)}", f"{_short(row.growth)} +- {_short(row.growth_error)}"
            name = ", ".join(other.regime for other in (row, *others[:1])) + (f" and {len(others) - 1} more" if len(others) > 1 else "")
            rows.append((name, row.channel, _percent(row.explained), trend, growth, _p(row.q)))
        lines += ["", *_aligned(rows, left={0, 1})]
    return [line.rstrip() for line in lines]


def _cells(channel: ChannelDifference) -> tuple[str, ...]:
    lag, white = channel.lag_fit, channel.whiteness
    normalised = f"{_short(channel.normalised)} [{_short(channel.normalised_low)}, {_short(channel.normalised_high)}]"
    correlation = f"{white.lag1:.2f}" if white is not None else "-"
    delay = f"{_short(1e3 * lag.delay)} +- {_short(1e3 * lag.delay_error, 2)}" if math.isfinite(lag.delay) else "-"
    unit = "" if channel.unit == "1" else f" {channel.unit}"
    sizes = (f"{_short(channel.rms)}{unit}", f"{_short(channel.bias)}", _short(channel.noise))
    verdict = f"left out: {channel.left_out}" if channel.left_out else channel.verdict
    return (channel.name, channel.of, str(channel.n), *sizes, normalised, correlation, delay, _short(lag.gain, 4), verdict)


def _short(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %" if math.isfinite(value) else "-"


def _p(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return "< 1e-6" if value < 1e-6 else f"{value:.2g}"


def _aligned(rows: Sequence[tuple[str, ...]], left: set[int]) -> list[str]:
    width = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width[k]) if k in left else cell.rjust(width[k]) for k, cell in enumerate(row)) for row in rows]
