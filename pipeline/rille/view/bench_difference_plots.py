"""Bench points measured and simulated: small multiples with the repeatability as band, for PNG and for the HTML report."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model.bench_curve import WORDS, conditions_of, curve_label, sweep_of
from rille.model.comparison import ComparedChannel, Comparison
from rille.view.page import Cell, Column, Section, figure, number, packed, table
from rille.view.plots import COLORS, empty_canvas

Array = NDArray[np.float64]
SHOWN = {"m": ("mm", 1e3), "rad": ("deg", 180 / np.pi)}  # unit for the eye
BAND = 1.96  # sigmas: 95 % of single points
CLOSE = 0.02  # of the range of the sweep: points that are averaged for line and band
MOST = 12  # curves in a figure of the page
COLUMNS = 8  # curves in a picture


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One channel on one curve. x, measured, simulated : (n,). at : (k,) middle of close points; mean, curve : (k,) means of both sides.

    sigma : noise. All in the units for the eye.
    """

    number: int
    label: str
    x: Array
    measured: Array
    simulated: Array
    at: Array
    mean: Array
    curve: Array
    sigma: float


def worst_curves(comparison: Comparison, most: int) -> list[int]:
    """Numbers of the curves, of more than ``most`` those whose residuals are largest against the noise, in the order of the curves."""
    sizes: dict[int, list[Array]] = {}
    for channel in comparison.channels:
        for window in np.unique(channel.window):
            sizes.setdefault(int(window), []).append((channel.residual[channel.window == window] / channel.noise) ** 2)
    return sorted(sorted(sizes, key=lambda window: -float(np.concatenate(sizes[window]).mean()))[:most])


def panels_of(channel: ComparedChannel, comparison: Comparison, curves: Sequence[int]) -> list[Panel]:
    """Panels of a channel on these curves, in their order."""
    regimes, sweep = comparison.regimes, sweep_of(comparison.regimes)
    conditions = conditions_of(regimes)
    place = np.searchsorted(regimes.time, channel.time)
    factor_x, factor = WORDS[sweep][2], SHOWN.get(channel.channel.unit, ("", 1.0))[1]
    close = CLOSE * max(float(np.ptp(conditions[sweep])), 1e-12)
    made = []
    for window in curves:
        here = channel.window == window
        if not here.any():
            continue
        x = conditions[sweep][place[here]]
        group = np.concatenate([[0], np.cumsum(np.diff(x) > close)])
        size = np.bincount(group)
        at, mean, curve = (np.bincount(group, v) / size for v in (x, channel.measured[here], channel.simulated[here]))
        whole = {name: values[regimes.window == window] for name, values in conditions.items()}
        made.append(
            Panel(
                number=window,
                label=curve_label(whole, sweep),
                x=factor_x * x,
                measured=factor * channel.measured[here],
                simulated=factor * channel.simulated[here],
                at=factor_x * at,
                mean=factor * mean,
                curve=factor * curve,
                sigma=factor * channel.noise,
            )
        )
    return made


def _name(channel: ComparedChannel) -> str:
    unit = SHOWN.get(channel.channel.unit, (channel.channel.unit, 1.0))[0]
    return f"{channel.channel.quantity.removeprefix('wheel.').replace('_', ' ')} [{'-' if unit == '1' else unit}]"


def _band_name(channels: Sequence[ComparedChannel]) -> str:
    return "95 % repeatability" if all(c.noise_from == "repeats" for c in channels) else "95 % of the noise"


def _sweep_title(comparison: Comparison) -> str:
    word, unit, _ = WORDS[sweep_of(comparison.regimes)]
    return f"{word} [{unit or '-'}]"


def plot_points(comparison: Comparison, path: Path, title: str = "") -> None:
    """One row per channel, one column per curve: dots measured, line simulated, band 1.96 sigma of single points about their means."""
    columns = worst_curves(comparison, COLUMNS)
    rows = [(channel, panels_of(channel, comparison, columns)) for channel in comparison.channels]
    canvas = empty_canvas(max(4.5, 1.2 + 2.3 * len(columns)), 1.1 + 2.3 * len(rows))
    axes = canvas.subplots(len(rows), len(columns), sharex=True, sharey="row", squeeze=False)
    titles = dict.fromkeys(range(len(columns)), "")
    for row, (channel, panels) in enumerate(rows):
        for panel in panels:
            axis = axes[row][columns.index(panel.number)]
            low, high = panel.mean - BAND * panel.sigma, panel.mean + BAND * panel.sigma
            axis.fill_between(panel.at, low, high, color=COLORS[0], alpha=0.22, linewidth=0)
            axis.plot(panel.x, panel.measured, "o", color=COLORS[0], markersize=3.2, markerfacecolor="none", markeredgewidth=0.9)
            axis.plot(panel.at, panel.curve, "-", color=COLORS[1], linewidth=1.4)
            titles[columns.index(panel.number)] = panel.label.replace(", ", "\n")
        axes[row][0].set_ylabel(_name(channel), fontsize=9)
    for column, text in titles.items():
        axes[0][column].set_title(text, fontsize=8)
    for axis in axes.ravel():
        axis.axhline(0, color="#888888", linewidth=0.6)
        axis.grid(alpha=0.3, linewidth=0.5)
        axis.tick_params(labelsize=8)
        axis.spines[["top", "right"]].set_visible(False)
    canvas.supxlabel(_sweep_title(comparison), fontsize=9)
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Line2D([], [], color=COLORS[0], marker="o", markerfacecolor="none", linestyle="", label="measured"),
        Patch(color=COLORS[0], alpha=0.22, label=_band_name(comparison.channels)),
        Line2D([], [], color=COLORS[1], label="simulated"),
    ]
    canvas.legend(handles=handles, loc="outside upper right", ncols=3, frameon=False, fontsize=9)
    known = len({int(window) for channel in comparison.channels for window in np.unique(channel.window)})
    title += f" (the worst {len(columns)} of {known} curves)" if known > len(columns) else ""
    if title:
        canvas.suptitle(title, fontsize=11, x=0.01, ha="left")
    canvas.savefig(path)


def points_section(comparison: Comparison, key: str = "points") -> Section:
    """The same as interactive figures, one per channel, and a table of curves."""
    curves = worst_curves(comparison, MOST)
    body = "".join(_figure_of(channel, comparison, curves, f"{key}-{k}") for k, channel in enumerate(comparison.channels))
    return Section(
        key=key,
        title=f"Points: {comparison.recording}",
        lead="Dots are measured, the line is simulated at the same conditions; the band holds 95 % of points that only the noise moves.",
        body=body + _table(comparison, key),
    )


def _figure_of(channel: ComparedChannel, comparison: Comparison, curves: Sequence[int], key: str) -> str:
    panels = panels_of(channel, comparison, curves)
    known = len(np.unique(channel.window))
    n_columns = min(4, len(panels))
    n_rows = -(-len(panels) // n_columns)
    traces: list[dict[str, object]] = []
    layout: dict[str, object] = {"showlegend": True, "legend": {"orientation": "h", "y": -0.12}, "margin": {"t": 40}}
    notes: list[dict[str, object]] = []
    for k, panel in enumerate(panels):
        row, column = divmod(k, n_columns)
        left, right = (column + 0.02) / n_columns, (column + 0.94) / n_columns
        top, bottom = 1 - (row + 0.10) / n_rows, 1 - (row + 0.90) / n_rows
        suffix = "" if k == 0 else str(k + 1)
        axes: dict[str, object] = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
        matched: dict[str, object] = {} if k == 0 else {"matches": "y"}
        last = k + n_columns >= len(panels)
        layout[f"xaxis{suffix}"] = {
            "domain": [left, right],
            "anchor": f"y{suffix}",
            "title": {"text": _sweep_title(comparison) if last else ""},
        }
        layout[f"xaxis{suffix}"] |= {} if k == 0 else {"matches": "x"}  # pyright: ignore[reportOperatorIssue]
        layout[f"yaxis{suffix}"] = {"domain": [bottom, top], "anchor": f"x{suffix}", "showticklabels": column == 0} | matched
        if column == 0:
            layout[f"yaxis{suffix}"] |= {"title": {"text": _name(channel)}}  # pyright: ignore[reportOperatorIssue]
        corner = {"xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom", "showarrow": False, "font": {"size": 11}}
        notes.append({"text": panel.label, "x": left, "y": top} | corner)
        around = np.concatenate([panel.at, panel.at[::-1]])
        band = np.concatenate([panel.mean + BAND * panel.sigma, (panel.mean - BAND * panel.sigma)[::-1]])
        quiet = {"hoverinfo": "skip", "mode": "lines", "line": {"width": 0}, "fill": "toself", "fillcolor": "var(--band)"}
        shown = {"showlegend": k == 0}
        dots = {"mode": "markers", "marker": {"color": "var(--measured)", "size": 6, "symbol": "circle-open"}}
        line = {"mode": "lines", "line": {"color": "var(--simulated)", "width": 2}}
        series: Sequence[tuple[str, Array, Array, dict[str, object]]] = (
            (_band_name([channel]), around, band, quiet),
            ("measured", panel.x, panel.measured, dots),
            ("simulated", panel.at, panel.curve, line),
        )
        for name, x, y, look in series:
            traces.append({"type": "scatter", "name": name, "legendgroup": name, "x": packed(x), "y": packed(y)} | look | axes | shown)
    layout["annotations"] = notes
    which = f"the worst {len(panels)} of {known}" if known > len(panels) else str(known)
    caption = f"{_name(channel)} of {channel.channel.target} over {_sweep_title(comparison)}, measured and simulated, {which} curves."
    return figure(key, traces, layout, caption=caption, height=120 + 240 * n_rows)


def _table(comparison: Comparison, key: str) -> str:
    columns = [Column(title="Curve")]
    columns += [
        Column(title=f"RMS of {_name(c)}", numeric=True, hint="bias in brackets; colour: beyond 2 sigma of the noise")
        for c in comparison.channels
    ]
    sweep, conditions = sweep_of(comparison.regimes), conditions_of(comparison.regimes)
    rows: list[list[str | Cell]] = []
    for window in comparison.windows:
        whole = {name: values[comparison.regimes.window == window.number] for name, values in conditions.items()}
        row: list[str | Cell] = [curve_label(whole, sweep)]
        for channel in comparison.channels:
            residual = channel.residual[channel.window == window.number] * SHOWN.get(channel.channel.unit, ("", 1.0))[1]
            if not len(residual):
                row.append(Cell(text="-", hint=window.ended))
                continue
            rms, bias = float(np.sqrt(np.mean(residual**2))), float(np.mean(residual))
            sigmas = rms / (channel.noise * SHOWN.get(channel.channel.unit, ("", 1.0))[1])
            text = f"{number(rms)} ({number(bias)})"
            row.append(Cell(text=text, value=rms, tone="bad" if sigmas > 2 else "", hint=f"{number(sigmas)} times the noise"))
        rows.append(row)
    return table(columns, rows, key=f"{key}-curves", caption="Residuals per curve: RMS (bias)")
