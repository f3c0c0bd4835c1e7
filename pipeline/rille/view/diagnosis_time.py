"""Time line of a diagnosis: the residual of every window, the spans that differ, the short pushes."""

import html
import math
from collections.abc import Sequence

import numpy as np

from rille.model.diagnosis import Diagnosis, Span, Transient
from rille.model.difference import Difference
from rille.view.page import figure
from rille.view.traced import percent

DRAWN = 5  # recordings with a time line each; more become rows of one picture
ROWS = 60
TICKS = (1, 3, 10, 30, 100, 300, 1000, 10_000)  # of an axis of powers


def time_line(diagnosis: Diagnosis, difference: Difference | None) -> str:
    """RMS over noise of every window, marked spans and transients."""
    recordings = list(dict.fromkeys(difference.recordings if difference is not None else (s.recording for s in diagnosis.location.spans)))
    if not recordings or (difference is not None and difference.mode == "points"):
        return ""
    if len(recordings) > DRAWN:
        return _strip(diagnosis, difference, recordings) if difference is not None else ""
    traces: list[dict[str, object]] = []
    layout: dict[str, object] = {
        "showlegend": False,
        "bargap": 0,
        "margin": {"l": 62, "r": 16, "t": 26, "b": 44},
        "grid": {"rows": len(recordings), "columns": 1, "pattern": "independent", "roworder": "top to bottom"},
    }
    shapes: list[dict[str, object]] = []
    notes: list[dict[str, object]] = []
    for k, recording in enumerate(recordings):
        axis = "" if k == 0 else str(k + 1)
        windows = [] if difference is None else sorted((w for w in difference.windows if w.recording == recording), key=lambda w: w.start)
        values = [max(w.normalised, 0.5) if math.isfinite(w.normalised) else math.nan for w in windows]
        spans = [span for span in diagnosis.location.spans if span.recording == recording]
        pulses = [pulse for pulse in diagnosis.transients if pulse.recording == recording]
        top = max([3.0, *(v for v in values if math.isfinite(v)), *(span.size for span in spans if math.isfinite(span.size))])
        if windows:
            traces.append(
                {
                    "type": "bar",
                    "x": [(w.start + w.stop) / 2 for w in windows],
                    "width": [w.stop - w.start for w in windows],
                    "y": values,
                    "base": 0,
                    "marker": {"color": ["var(--bad)" if w.differs else "var(--heat1)" for w in windows], "line": {"width": 0}},
                    "text": [_of_window(w.channel, w.share) for w in windows],
                    "textposition": "none",
                    "hovertemplate": "%{x:.2f} s: %{y:.2f} \u00d7 noise%{text}<extra></extra>",
                    "xaxis": f"x{axis}",
                    "yaxis": f"y{axis}",
                }
            )
        shapes += [_marked(span, axis) for span in spans]
        shapes.append({**_line(axis, 1.0), "line": {"color": "var(--good)", "width": 1.5, "dash": "dash"}})
        notes += [_pulse(pulse, axis, top) for pulse in pulses]
        notes.append(_name(f"{recording} (held out)" if recording in diagnosis.held_out else recording, axis))
        log = top > 8
        layout[f"yaxis{axis}"] = {
            "title": {"text": "residual / noise"},
            "type": "log" if log else "linear",
            "range": [math.log10(0.5), math.log10(1.3 * top)] if log else [0, 1.15 * top],
            **({"tickvals": TICKS, "ticktext": [f"{t:g}" for t in TICKS]} if log else {}),
        }
        layout[f"xaxis{axis}"] = {"title": {"text": "time [s]" if k == len(recordings) - 1 else ""}}
        if not windows and spans:  # an axis needs a trace to exist
            ends = [min(span.start for span in spans), max(span.stop for span in spans)]
            traces.append(
                {"type": "scatter", "x": ends, "y": [1.0, 1.0], "mode": "markers", "opacity": 0, "xaxis": f"x{axis}", "yaxis": f"y{axis}"}
            )
    layout |= {"shapes": shapes, "annotations": notes}
    caption = "RMS of the residual over the noise, window by window; red: beyond chance; dashed: the noise floor."
    if diagnosis.location.spans:
        caption += " Shaded: the spans in which the recordings differ."
    if diagnosis.transients:
        caption += " ▼: a short push."
    return figure("time-line", traces, layout, caption=caption, height=90 + 190 * len(recordings))


def _of_window(channel: str, share: float) -> str:
    return f", mostly {html.escape(channel)} ({percent(share)})" if channel else ""


def _line(axis: str, y: float) -> dict[str, object]:
    return {"type": "line", "xref": f"x{axis} domain", "yref": f"y{axis}", "x0": 0, "x1": 1, "y0": y, "y1": y}


def _marked(span: Span, axis: str) -> dict[str, object]:
    edges = {"x0": span.start, "x1": span.stop, "y0": 0, "y1": 1}
    fill = {"fillcolor": "var(--worst)", "line": {"width": 0}, "layer": "below"}
    return {"type": "rect", "xref": f"x{axis}", "yref": f"y{axis} domain", **edges, **fill}


def _pulse(pulse: Transient, axis: str, top: float) -> dict[str, object]:
    return {
        "text": f"▼ {html.escape(pulse.component)} at {html.escape(pulse.target)}",
        "x": pulse.peak_time,
        "y": 1.0,
        "xref": f"x{axis}",
        "yref": f"y{axis} domain",
        "yanchor": "top",
        "showarrow": False,
        "font": {"color": "var(--notice)", "size": 11},
        "hovertext": f"{pulse.amplitude:.3g} from {pulse.start:.2f} s for {pulse.duration:.2f} s",
    }


def _name(recording: str, axis: str) -> dict[str, object]:
    place = {"xref": f"x{axis} domain", "yref": f"y{axis} domain", "x": 0, "y": 1, "yanchor": "bottom", "xanchor": "left"}
    return {"text": html.escape(recording), **place, "showarrow": False, "font": {"size": 12}}


def _strip(diagnosis: Diagnosis, difference: Difference, recordings: Sequence[str]) -> str:
    """One row per recording, worst first; colour is the residual over the noise."""
    worst: dict[str, float] = dict.fromkeys(recordings, 0.0)
    for window in difference.windows:
        if math.isfinite(window.normalised):
            worst[window.recording] = max(worst[window.recording], window.normalised)
    rows = sorted(recordings, key=lambda name: -worst[name])[:ROWS]
    first = {
        name: min(w.start for w in difference.windows if w.recording == name)
        for name in rows
        if any(w.recording == name for w in difference.windows)
    }
    rows = [name for name in rows if name in first]
    lengths = [w.stop - w.start for w in difference.windows if w.recording in first]
    if not rows or not lengths:
        return ""
    length = float(np.median(lengths))
    last = max(w.stop - first[w.recording] for w in difference.windows if w.recording in first)
    columns = int(min(400, max(1, math.ceil(last / length))))
    cells = np.full((len(rows), columns), np.nan)
    places = {name: k for k, name in enumerate(rows)}
    for window in difference.windows:
        if window.recording in places and math.isfinite(window.normalised):
            row, column = places[window.recording], min(columns - 1, int((window.start - first[window.recording]) / last * columns))
            cells[row, column] = np.fmax(cells[row, column], math.log10(max(window.normalised, 1.0)))
    highest = max(math.log10(3.0), float(np.nanmax(cells)) if np.isfinite(cells).any() else 0.0)
    ticks = [t for t in (1, 2, 3, 5, 10, 20, 50, 100, 1000) if math.log10(t) <= highest]
    heat = {
        "type": "heatmap",
        "z": [[None if not math.isfinite(v) else round(v, 3) for v in row] for row in cells.tolist()],
        "x0": last / columns / 2,
        "dx": last / columns,
        "y": rows,
        "zmin": 0,
        "zmax": highest,
        "colorscale": [[0, "var(--heat0)"], [0.3, "var(--heat1)"], [0.55, "var(--heat2)"], [0.8, "var(--heat3)"], [1, "var(--heat4)"]],
        "colorbar": {
            "title": {"text": "\u00d7 noise"},
            "tickvals": [math.log10(t) for t in ticks],
            "ticktext": [str(t) for t in ticks],
            "thickness": 12,
        },
        "hovertemplate": "%{y}, %{x:.1f} s after its start<extra></extra>",
    }
    pulses = [p for p in diagnosis.transients if p.recording in first]
    marks = {
        "type": "scatter",
        "mode": "markers",
        "x": [p.peak_time - first[p.recording] for p in pulses],
        "y": [p.recording for p in pulses],
        "marker": {"symbol": "triangle-down", "size": 10, "color": "var(--ink)"},
        "hovertext": [f"{p.component} at {p.target}: {p.amplitude:.3g}" for p in pulses],
        "hoverinfo": "text",
    }
    layout = {
        "showlegend": False,
        "yaxis": {"autorange": "reversed", "title": {"text": ""}, "type": "category"},
        "xaxis": {"title": {"text": "time after the start of the recording [s]"}},
        "margin": {"l": 140, "r": 16, "t": 10, "b": 44},
    }
    more = f"; the {len(rows)} worst of {len(recordings)} recordings" if len(rows) < len(recordings) else ""
    caption = f"RMS of the residual over the noise, one row per recording, worst first{more}." + (" ▼: a short push." if pulses else "")
    return figure("time-line", [heat, *([marks] if pulses else [])], layout, caption=caption, height=100 + 20 * len(rows))
