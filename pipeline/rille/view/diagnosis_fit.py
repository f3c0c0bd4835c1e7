"""How much better recordings are reproduced: gap closed, channels before and after, series of the worst held-out window."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.comparison import ComparedChannel, Comparison
from rille.model.diagnosis import ChannelFit, Diagnosis, Proof
from rille.view.page import Cell, Column, Section, figure, packed, table
from rille.view.thinning import thinned
from rille.view.traced import percent, percent_at, traced, value_at

Array = NDArray[np.float64]

SHOWN = 12
DRAWN = 24  # rows of the picture of channels
NOT_PROVEN = (
    "How much better unseen recordings are reproduced is not known: nothing was held out, or what was is at the noise already. "
    "Hold recordings out with <code>--held-out</code>, or record for longer."
)
CURVES = 4  # channels before and after
TICKS = (0.5, 1, 1.5, 2, 3, 5, 7, 10, 20, 30, 50, 100, 200, 500, 1000, 10_000)
POINTS = 1500
AROUND = 3.0  # [s] shown on either side of the worst window


def fit_section(diagnosis: Diagnosis, base: Sequence[Comparison] = (), improved: Sequence[Comparison] = ()) -> Section | None:
    """Before and after on what the fit has not seen; None if nothing was proved.

    base, improved : recordings under the present and the improved model, for curves; of one name the first counts.
    """
    proof = diagnosis.proof
    if proof is None:
        return None
    proven = math.isfinite(proof.gap_closed)
    body = _gauge(proof) if proven else f"<p>{NOT_PROVEN}</p>"
    if proof.channels:
        body += _channels_figure(proof)
    body += _curves(base, improved)
    if proof.channels:
        body += _channel_table(proof)
    if proof.ablation:
        body += _ablation(proof)
    lead = f"Held out: {proof.held_out}. The fit has not seen it." if proof.held_out and proven else ""
    return Section(key="fit", title="The fit", lead=lead, body=body)


def _gauge(proof: Proof) -> str:
    def at(value: float) -> float:
        return 100 * min(max(value, 0.0), 1.0) if math.isfinite(value) else 0.0

    g, low, high = at(proof.gap_closed), at(proof.low), at(proof.high)
    return (
        '<div class="gauge"><div class="big">'
        f"{percent_at(proof.gap_closed, 'proof.gap_closed')}</div><div><div class='track' role='img' aria-label='gap closed: "
        f"{percent(proof.gap_closed)}'><i class='done' style='width:{g:.1f}%'></i>"
        f"<i class='range' style='left:{low:.1f}%;width:{max(high - low, 0.4):.1f}%'></i></div>"
        "<p>of the gap to the noise floor is closed "
        f"(95 %: {percent_at(proof.low, 'proof.low')} to {percent_at(proof.high, 'proof.high')}). "
        f"Residual over noise: {value_at(proof.before, 'proof.before')} before, <b>{value_at(proof.after, 'proof.after')}</b> after, "
        f"{value_at(proof.floor, 'proof.floor')} at the floor.</p></div></div>"
    )


def _over_floor(fit: ChannelFit) -> tuple[float, float]:
    return (fit.rms_before / fit.floor, fit.rms_after / fit.floor) if fit.floor > 0 else (math.nan, math.nan)


def _channels_figure(proof: Proof) -> str:
    """A line per channel from before to after, in units of its floor."""
    kept = [fit for fit in proof.channels if all(math.isfinite(v) and v > 0 for v in _over_floor(fit))]
    kept = sorted(kept, key=lambda fit: (-fit.held_out, -_over_floor(fit)[0]))
    several = len({fit.recording for fit in kept}) > 2
    names, seen = [], set()
    for fit in kept:  # of many recordings only the worst of each channel
        if (fit.channel, fit.held_out) not in seen:
            seen.add((fit.channel, fit.held_out))
            names.append(fit)
    shown = names[:DRAWN]
    if not shown:
        return ""
    labels = [f"{fit.channel}{' · held out' if fit.held_out else ' · training'}" for fit in shown]
    lines: dict[str, list[object]] = {"x": [], "y": []}
    for fit, label in zip(shown, labels, strict=True):
        before, after = _over_floor(fit)
        lines["x"] += [before, after, None]
        lines["y"] += [label, label, None]
    dots = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "x": [_over_floor(fit)[k] for fit in shown],
            "y": labels,
            "marker": {"size": 11, "color": color, "symbol": symbol, "line": {"width": 2, "color": color}},
            "hovertemplate": "%{y}: %{x:.2f} \u00d7 floor<extra>" + name + "</extra>",
        }
        for k, (name, color, symbol) in enumerate(
            (("present model", "var(--bad)", "circle-open"), ("improved model", "var(--good)", "circle"))
        )
    ]
    line = {"type": "scatter", "mode": "lines", "line": {"color": "var(--muted)", "width": 2}, "hoverinfo": "skip", "showlegend": False}
    layout = {
        "xaxis": {
            "type": "log",
            "title": {"text": "RMS of the residual over the noise floor"},
            "tickvals": TICKS,
            "ticktext": [f"{t:g}" for t in TICKS],
        },
        "yaxis": {"autorange": "reversed", "type": "category"},
        "margin": {"l": 190, "r": 20, "t": 34, "b": 46},
        "shapes": [
            {
                "type": "line",
                "x0": 1,
                "x1": 1,
                "yref": "paper",
                "y0": 0,
                "y1": 1,
                "line": {"color": "var(--good)", "dash": "dash", "width": 1.5},
            }
        ],
    }
    caption = "Every channel before and after; dashed: the noise floor, the best that any model could reach."
    if several:
        caption += " Of each channel the worst recording."
    return figure("channels", [{**line, **lines}, *dots], layout, caption=caption, height=120 + 26 * len(shown))


def _curves(base: Sequence[Comparison], improved: Sequence[Comparison]) -> str:
    """Measured, present and improved, around the window that was worst, of the channels that gained most."""
    better = {comparison.recording: comparison for comparison in reversed(improved)}
    pairs = [(a, better[a.recording]) for a in base if a.recording in better]
    found = [(*best, a) for a, b in pairs for best in _gains(a, b)]
    found.sort(key=lambda item: -item[0])
    if not found:
        return ""
    parts = []
    for k, (_, old, new, at, comparison) in enumerate(found[: min(CURVES, max(1, len(found) // 2 * 2))]):  # two a row
        parts.append(_curve(k, old, new, at, comparison.recording))
    return f'<div class="columns">{"".join(parts)}</div>'


def _gains(a: Comparison, b: Comparison) -> list[tuple[float, ComparedChannel, ComparedChannel, float]]:
    """Of every channel what was gained in sigma^2, its two replays, and the time of the worst window before."""
    after = {c.channel.name: c for c in b.channels}
    middles = {w.number: (w.start + w.stop) / 2 for w in a.windows}
    gains = []
    for old in a.channels:
        new = after.get(old.channel.name)
        if new is None or old.left_out or not old.noise > 0:
            continue
        known = np.isfinite(old.residual)
        sums = np.bincount(old.window[known], (old.residual[known] / old.noise) ** 2) if known.any() else np.zeros(0)
        later = np.isfinite(new.residual)
        if not len(sums) or not later.any():
            continue
        gain = float(np.mean((old.residual[known] / old.noise) ** 2) - np.mean((new.residual[later] / old.noise) ** 2))
        if gain > 0:
            gains.append((gain, old, new, middles.get(int(np.argmax(sums)), 0.0)))
    return gains


def _curve(k: int, old: ComparedChannel, new: ComparedChannel, at: float, recording: str) -> str:
    """Above measured, present and improved; below the residuals with twice the noise."""
    measured = {"mode": "markers", "marker": {"size": 3.5, "color": "var(--measured)"}}
    present = {"mode": "lines", "line": {"width": 1.8, "color": "var(--bad)"}}
    improved = {"mode": "lines", "line": {"width": 1.8, "color": "var(--good)"}}
    below = {"yaxis": "y2", "showlegend": False}
    traces = [
        {"name": "measured", **_near(old, old.measured, at), **measured},
        {"name": "present model", **_near(old, old.simulated, at, lines=True), **present},
        {"name": "improved model", **_near(new, new.simulated, at, lines=True), **improved},
        {"name": "measured - present", **_near(old, old.residual, at, lines=True), **present, **below},
        {"name": "measured - improved", **_near(new, new.residual, at, lines=True), **improved, **below},
    ]
    unit = "" if old.channel.unit == "1" else f" [{old.channel.unit}]"
    band = {"type": "rect", "xref": "paper", "yref": "y2", "x0": 0, "x1": 1, "y0": -2 * old.noise, "y1": 2 * old.noise}
    layout = {
        "xaxis": {"title": {"text": "time [s]"}, "anchor": "y2"},
        "yaxis": {"title": {"text": f"{old.channel.name}{unit}"}, "domain": [0.45, 1]},
        "yaxis2": {"title": {"text": f"residual{unit}"}, "domain": [0, 0.38]},
        "margin": {"l": 70, "r": 10, "t": 30, "b": 84},
        "legend": {"y": -0.17, "yanchor": "top"},
        "shapes": [{**band, "fillcolor": "var(--band)", "line": {"width": 0}, "layer": "below"}],
    }
    caption = f"{old.channel.of} in {recording}, around the window that was worst. Band: twice the noise."
    return figure(f"curve-{k}", traces, layout, caption=caption, height=420)


def _near(channel: ComparedChannel, values: Array, at: float, *, lines: bool = False) -> dict[str, object]:
    """A series of ``channel`` around the time ``at``; lines break where a window begins anew."""
    part = slice(int(np.searchsorted(channel.time, at - AROUND)), int(np.searchsorted(channel.time, at + AROUND)))
    time, shown = channel.time[part], values[part].astype(float)
    if lines:
        jumps = np.flatnonzero(np.diff(channel.window[part])) + 1
        time, shown = np.insert(time, jumps, time[jumps]), np.insert(shown, jumps, np.nan)
    kept = thinned(POINTS, shown)
    return {"type": "scatter", "x": packed(time[kept], exact=True), "y": packed(shown[kept])}


def _channel_table(proof: Proof) -> str:
    columns = (
        Column(title="channel"),
        Column(title="recording"),
        Column(title="part"),
        Column(title="RMS before", numeric=True),
        Column(title="RMS after", numeric=True),
        Column(title="noise floor", numeric=True),
        Column(title="unit"),
        Column(title="gap closed", numeric=True, hint="(before - after) / (before - floor)"),
    )
    rows = []
    for k, fit in enumerate(proof.channels):
        gap = fit.rms_before - fit.floor
        closed = (fit.rms_before - fit.rms_after) / gap if gap > 0.05 * fit.floor else math.nan
        rows.append(
            [
                fit.channel,
                fit.recording,
                "held out" if fit.held_out else "training",
                Cell(text=value_at(fit.rms_before, f"proof.channels[{k}].rms_before"), value=fit.rms_before),
                Cell(text=value_at(fit.rms_after, f"proof.channels[{k}].rms_after"), value=fit.rms_after),
                Cell(text=value_at(fit.floor, f"proof.channels[{k}].floor"), value=fit.floor),
                "" if fit.unit == "1" else fit.unit,
                Cell(text=percent(closed), value=closed, tone="bad" if closed < 0 else ""),
            ]
        )
    return table(columns, rows, key="fit-table", shown=SHOWN)


def _ablation(proof: Proof) -> str:
    columns = (
        Column(title="without"),
        Column(title="gap closed", numeric=True, hint="on the held-out part, the rest fitted as before"),
        Column(title="loses", numeric=True),
    )
    rows = [
        [
            name,
            Cell(text=traced(percent(value), f"proof.ablation[{k}][1]"), value=value),
            Cell(text=percent(proof.gap_closed - value), value=proof.gap_closed - value),
        ]
        for k, (name, value) in enumerate(proof.ablation)
    ]
    return table(columns, rows, key="ablation-table", caption="Every term earns its place: what is left of the gap closed without it")
