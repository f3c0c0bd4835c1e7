"""HTML page of what the data gate found: a table of findings, and a picture of each where there is something to see."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding, Recording
from rille.model.severity import SEVERITIES
from rille.view.page import Cell, Column, Html, Page, Section, Tone, badge, figure, packed, table, write_page
from rille.view.thinning import thinned

Array = NDArray[np.float64]
Load = Callable[[str, str, tuple[float, float] | None], Channel]  # recording, channel, span [s] -> channel with samples

TONES: Mapping[str, Tone] = {"error": "bad", "warning": "notice", "note": "quiet"}
PICTURES = 40  # in one page
POINTS = 3000  # of one curve
MARGIN = 1.0  # part of an interval that is shown before and after it
WINDOW = 10.0  # [s] of two channels that are compared, unless they are slow
MEANING = {
    "spike": "single samples far off",
    "noise": "scatters more than stated",
    "wrapped": "jumps by full turns",
    "missing": "no value",
    "missing_single": "single values missing",
    "not_finite": "infinite values",
    "stuck": "holds a value while the machine moves",
    "constant": "never changes",
    "saturation": "cut off at an extreme value",
    "quantised": "smallest step",
    "clock_backwards": "stamps out of order",
    "clock_duplicates": "stamps twice",
    "clock_not_finite": "stamps that are no numbers",
    "clock_gap": "gaps in time",
    "clock_lost": "single samples lost",
    "clock_jitter": "irregular stamps",
    "clock_skew": "runs at another pace than a second clock",
    "clocks_apart": "has no time in common with a second clock",
    "time_unit": "time in another unit",
    "unit": "value in another unit",
    "sign": "turned sign",
    "frame": "measures about other axes",
    "axes": "mounted otherwise, or columns mixed up",
    "quaternion": "numbers in another order, or inverse",
    "gravity": "does not feel the gravity that it is under",
    "rollover": "begins anew after another angle than a full turn",
    "gain": "another scale than a redundant channel",
    "bias": "offset against a redundant channel",
    "delay": "later than another channel",
    "header": "named for another unit",
    "range": "beyond what there is",
    "bad_channel": "tells nothing of the motion",
    "disagreement": "two channels contradict each other",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """A finding and the recordings that have it, by number."""

    finding: GateFinding
    recordings: tuple[int, ...]


def write_gate_report(path: Path, recordings: Sequence[Recording], *, source: str, load: Load | None = None) -> Path:
    """Write the page. Findings that several recordings share (parts of one import) stand once.

    Parameters
    ----------
    recordings : with their findings; samples in memory, or read by ``load`` as far as pictures need them.
    source : database or file, for the head of the page.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    rows = _merged(recordings)
    counts = {severity: sum(row.finding.severity == severity for row in rows) for severity in SEVERITIES}
    worst = next((severity for severity in SEVERITIES if counts[severity]), None)
    return write_page(
        path,
        Page(
            title="Data gate",
            subtitle=source,
            verdict=_verdict(counts),
            tone="good" if worst in (None, "note") else TONES[worst],
            facts={
                "recordings": str(len(recordings)),
                "channels": str(len({channel.name for recording in recordings for channel in recording.channels})),
                "errors": str(counts["error"]),
                "warnings": str(counts["warning"]),
                "notes": str(counts["note"]),
            },
            sections=_sections(rows, recordings, load),
        ),
    )


def _verdict(counts: Mapping[str, int]) -> str:
    if counts["error"]:
        return f"{counts['error']} error{'s' if counts['error'] > 1 else ''}: the data must not be used as they are."
    if counts["warning"]:
        return f"{counts['warning']} warning{'s' if counts['warning'] > 1 else ''}: usable with care."
    return "Nothing is wrong with these data as far as they can tell themselves."


def _merged(recordings: Sequence[Recording]) -> list[_Row]:
    """Findings of the same channel and kind; the message is that of the first recording."""
    found: dict[tuple[str, str, str], tuple[GateFinding, list[int]]] = {}
    for k, recording in enumerate(recordings):
        for finding in recording.findings:
            key = (finding.code, finding.severity, f"{finding.channel}/{finding.detail.get('first')}/{finding.detail.get('side')}")
            found.setdefault(key, (finding, []))[1].append(k)
    rows = [_Row(finding=finding, recordings=tuple(of)) for finding, of in found.values()]
    return sorted(rows, key=lambda row: SEVERITIES.index(row.finding.severity))


def _sections(rows: Sequence[_Row], recordings: Sequence[Recording], load: Load | None) -> list[Section]:
    columns = (
        Column(title="severity"),
        Column(title="code", hint="as in `accepted` of a manifest"),
        Column(title="channel or clock"),
        Column(title="recordings", numeric=True, hint="that have this finding"),
        Column(title="what"),
    )
    lines = [
        (
            Cell(text=row.finding.severity, value=float(SEVERITIES.index(row.finding.severity)), tone=TONES[row.finding.severity]),
            Cell(text=row.finding.code, hint=MEANING.get(row.finding.code, "")),
            row.finding.channel,
            Cell(text=str(len(row.recordings)), value=float(len(row.recordings))),
            row.finding.message,
        )
        for row in rows
    ]
    sections = [Section(key="findings", title="Findings", body=table(columns, lines, key="findings-table") if lines else "<p>None.</p>")]
    pictures = [picture for k, row in enumerate(rows[: 4 * PICTURES]) if (picture := _picture(k, row, recordings, load))][:PICTURES]
    if pictures:
        lead = "Shaded: the stretches in question. Of several recordings the first is shown."
        sections.append(Section(key="pictures", title="Pictures", body="".join(pictures), lead=lead))
    sections.append(Section(key="channels", title="Channels", body=_channels(recordings, rows)))
    return sections


def _channels(recordings: Sequence[Recording], rows: Sequence[_Row]) -> str:
    columns = tuple(Column(title=title) for title in ("channel", "quantity", "role", "unit", "clock", "findings"))
    seen: dict[str, Channel] = {}
    for recording in recordings:
        for channel in recording.channels:
            seen.setdefault(channel.name, channel)
    lines = []
    for name, channel in seen.items():
        codes = [badge(row.finding.code, TONES[row.finding.severity]) for row in rows if row.finding.channel == name]
        lines.append((name, channel.of, channel.role, channel.unit, channel.clock, Html(" ".join(dict.fromkeys(codes)))))
    return table(columns, lines, key="channels-table")


def _picture(k: int, row: _Row, recordings: Sequence[Recording], load: Load | None) -> str:
    finding, recording = row.finding, recordings[row.recordings[0]]
    names = {channel.name for channel in recording.channels}
    first, second = finding.detail.get("first"), finding.detail.get("second")
    if isinstance(first, str) and isinstance(second, str) and {first, second} <= names:
        return _two(f"picture-{k}", finding, recording, first, second, load)
    if finding.channel in names and finding.severity != "note":
        return _one(f"picture-{k}", finding, recording, finding.channel, load)
    clock = next((channel.name for channel in recording.channels if channel.clock == finding.channel and channel.role != "ignore"), None)
    if clock is not None and finding.code.startswith("clock_"):
        return _stamps(f"picture-{k}", finding, recording, clock, load)
    return ""


def _samples(recording: Recording, name: str, load: Load | None, span: tuple[float, float] | None) -> tuple[Array, Array]:
    channel = recording.channel(name)
    if not len(channel.time) and load is not None:
        channel = load(recording.name, name, span)
    time, value = channel.time, channel.value
    if span is None:
        return time, value
    inside = (time >= span[0]) & (time <= span[1])
    return time[inside], value[inside]


def _intervals(finding: GateFinding) -> list[tuple[float, float]]:
    found = finding.detail.get("intervals")
    return [(float(begin), float(end)) for begin, end in found] if isinstance(found, list) else []


def _one(key: str, finding: GateFinding, recording: Recording, name: str, load: Load | None) -> str:
    intervals = _intervals(finding)
    span = None
    if intervals:
        begin, end = max(intervals, key=lambda interval: interval[1] - interval[0])
        margin = max(MARGIN * (end - begin), 0.5)
        span = (begin - margin, end + margin)
    witnesses = finding.detail.get("witnesses")
    witness = witnesses[0] if isinstance(witnesses, list) and witnesses else None
    traces = [_line(*_samples(recording, name, load, span), name, "var(--measured)")]
    unit = recording.channel(name).unit
    layout: dict[str, object] = {"xaxis": {"title": {"text": "time [s]"}}, "yaxis": {"title": {"text": f"{name} [{unit}]"}}}
    if witness is not None:
        traces.append(_line(*_samples(recording, witness, load, span), witness, "var(--simulated)") | {"yaxis": "y2"})
        other = {"title": {"text": f"{witness} [{recording.channel(witness).unit}]"}, "overlaying": "y", "side": "right", "showgrid": False}
        layout["yaxis2"] = other
    layout["shapes"] = _shades(intervals, span)
    return figure(key, traces, layout, caption=f"{recording.name}: {finding.message}", height=280)


def _two(key: str, finding: GateFinding, recording: Recording, first: str, second: str, load: Load | None) -> str:
    """Both channels over the stretch on which the second varies most; the first as its rate where rates are compared."""
    time, value = _samples(recording, second, load, None)
    if len(time) < 3:
        return ""
    span = _liveliest(time, value)
    a, b = _samples(recording, first, load, span), _samples(recording, second, load, span)
    label = first
    if finding.detail.get("order") == 1 and len(a[0]) > 2:
        middle, step = 0.5 * (a[0][1:] + a[0][:-1]), np.diff(a[0])
        a, label = (middle[step > 0], np.diff(a[1])[step > 0] / step[step > 0]), f"rate of {first}"
    traces = [_line(*a, label, "var(--simulated)"), _line(*b, second, "var(--measured)")]
    unit = recording.channel(second).unit
    layout = {"xaxis": {"title": {"text": "time [s]"}}, "yaxis": {"title": {"text": f"[{unit}]"}}}
    return figure(key, traces, layout, caption=f"{recording.name}: {finding.message}", height=280)


def _liveliest(time: Array, value: Array) -> tuple[float, float]:
    """Times [s] of the 10 s, or hundred samples if they last longer, on which a channel varies most."""
    length = max(WINDOW, 100 * float(np.median(np.diff(time))))
    if time[-1] - time[0] <= length:
        return float(time[0]), float(time[-1])
    edges = np.unique(np.searchsorted(time, np.arange(time[0], time[-1], length / 2)))
    filled = np.where(np.isfinite(value), value, np.nanmean(value) if np.isfinite(value).any() else 0.0)
    spread = np.maximum.reduceat(filled, edges) - np.minimum.reduceat(filled, edges)
    begin = float(time[edges[int(np.argmax(spread))]])
    return begin, begin + length


def _stamps(key: str, finding: GateFinding, recording: Recording, name: str, load: Load | None) -> str:
    """Intervals between stamps over time."""
    time, _ = _samples(recording, name, load, None)
    if len(time) < 3:
        return ""
    at, interval = time[1:], np.diff(time)
    kept = thinned(POINTS, interval)
    at, interval = at[kept], interval[kept]
    trace = {"x": packed(at, exact=True), "y": packed(interval), "mode": "markers", "type": "scattergl" if len(at) > 5000 else "scatter"}
    trace |= {"marker": {"size": 4, "color": "var(--measured)"}, "name": "interval", "showlegend": False}
    layout = {
        "xaxis": {"title": {"text": "time [s]"}},
        "yaxis": {"title": {"text": "interval to the stamp before [s]"}, "rangemode": "tozero"},
    }
    return figure(key, [trace], layout, caption=f"{recording.name}: {finding.message}", height=240)


def _line(time: Array, value: Array, name: str, colour: str) -> dict[str, object]:
    kept = thinned(POINTS, value)
    line: dict[str, object] = {"x": packed(time[kept], exact=True), "y": packed(value[kept]), "mode": "lines", "name": name}
    return line | {"line": {"color": colour, "width": 1.3}}


def _shades(intervals: Iterable[tuple[float, float]], span: tuple[float, float] | None) -> list[dict[str, object]]:
    shown = [pair for pair in intervals if span is None or (pair[1] >= span[0] and pair[0] <= span[1])]
    shade: dict[str, object] = {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "y0": 0,
        "y1": 1,
        "line": {"width": 0},
        "fillcolor": "var(--worst)",
    }
    return [shade | {"x0": begin, "x1": end} for begin, end in shown[:60]]
