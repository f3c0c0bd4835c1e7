"""Figures of a study: which factor moves what, maps over two factors, outcomes against every factor, envelopes over time."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model.study import Bands, Indices, Measure, StudyTable
from rille.view.plots import COLORS, empty_canvas
from rille.view.study_words import factor_axis, label, order_of, outcome_axis, part_of, scale, strongest

Array = NDArray[np.float64]
MOST_OUTCOMES = 6
MOST_FACTORS = 8
BINS = 8  # of the running median
LETTERS = 11.5  # of a title, per inch
MOST_TICKS = 8  # of the map of a grid
FEW_CASES = 20  # with fewer, percentiles lie between cases
DOTS = (  # how cases are drawn while they are fewer than so many
    (100, {"markersize": 6.0, "alpha": 0.8}),
    (1000, {"markersize": 4.0, "alpha": 0.5}),
    (np.inf, {"markersize": 2.2, "alpha": 0.35}),
)


def draw_study(folder: Path, table: StudyTable, results: Mapping[str, Indices | None], envelopes: Sequence[Bands]) -> list[Path]:
    """Draw what can be drawn: ``indices.png``, ``maps.png``, ``effects.png``, ``envelopes.png``; returns the files.

    results : indices by outcome. envelopes : of traced channels.
    """
    shown = [m for m in table.main_measures() if np.isfinite(table.outcome(m.name)).any()][:MOST_OUTCOMES]
    drawn = []
    if any(results.get(m.name) is not None for m in shown):
        drawn.append(_indices(folder / "indices.png", table, [m for m in shown if results.get(m.name) is not None], results))
    if shown and len(table.plan.factors) > 1:
        drawn.append(_maps(folder / "maps.png", table, shown, results))
    if shown:
        drawn.append(_effects(folder / "effects.png", table, shown, order_of(table, results)[:MOST_FACTORS]))
    known = [one for one in envelopes if np.isfinite(one.values).any()]
    if known:
        drawn.append(_envelopes(folder / "envelopes.png", table, known))
    return drawn


def _name(table: StudyTable) -> str:
    """The study's name, as the beginning of a title."""
    part = part_of(table)
    return f"{table.plan.name}, {part}" if part else table.plan.name


def _entitle(figure: Any, text: str) -> None:
    """The title, in as many lines as the figure's width asks for."""
    lines = textwrap.wrap(text, int(LETTERS * figure.get_figwidth()), break_long_words=True)
    figure.suptitle("\n".join(lines), fontsize=11, x=0.01, ha="left")


def _logarithmic(axis: Any, which: str) -> None:
    """A logarithmic axis "x" or "y" whose numbers are read as they stand: 0.1, 0.2, 0.5, 1."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set(**{f"{which}scale": "log"})
    one = getattr(axis, f"{which}axis")
    one.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    one.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    one.set_minor_formatter(NullFormatter())


def _plain(axis: Any) -> None:
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(alpha=0.3, linewidth=0.5)
    axis.set_axisbelow(True)


def _indices(path: Path, table: StudyTable, shown: Sequence[Measure], results: Mapping[str, Indices | None]) -> Path:
    order = order_of(table, results)[:MOST_FACTORS]
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = empty_canvas(3.0 + 3.2 * columns, 1.1 + rows * (0.8 + 0.42 * len(order)))
    axes = figure.subplots(rows, columns, sharey=True, sharex=True, squeeze=False)
    place = np.arange(len(order))
    for axis in axes.flat[len(shown) :]:
        axis.set_visible(False)
    for axis, measure in zip(axes.flat, shown, strict=False):
        one = results[measure.name]
        assert one is not None
        style = {"ecolor": "#333333", "elinewidth": 0.9, "capsize": 2}
        if one.total is not None:
            spread = None if one.total_confidence is None else one.total_confidence[order]
            axis.barh(place + 0.2, one.total[order], 0.38, xerr=spread, color="#9dbfdb", error_kw=style, label="with others (total)")
        spread = None if one.first_confidence is None else one.first_confidence[order]
        away = -0.2 if one.total is not None else 0.0
        axis.barh(place + away, one.first[order], 0.38, xerr=spread, color=COLORS[0], error_kw=style, label="alone (first order)")
        axis.axvline(0, color="#888888", linewidth=0.6)
        axis.set_title(label(measure.name), fontsize=10, loc="left")
        _plain(axis)
        axis.tick_params(labelsize=8.5)
    axes[0, 0].set_yticks(place, [label(table.plan.factors[k].name) for k in order])
    axes[0, 0].invert_yaxis()
    left, right = axes[0, 0].get_xlim()
    axes[0, 0].set_xlim(max(-0.2, min(-0.02, left)), min(1.15, max(1.0, right)))
    first = next(one for m in shown if (one := results[m.name]) is not None)
    figure.supxlabel("share of the variance" if first.are_shares else "index", fontsize=9.5)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if len(labels) > 1:
        figure.legend(handles, labels, loc="outside lower right", ncols=2, frameon=False, fontsize=9)
    bars = "; bars: 95 %" if first.first_confidence is not None else ""
    _entitle(figure, f"{_name(table)}: {first.method}{bars}")
    figure.savefig(path)
    return path


def _maps(path: Path, table: StudyTable, shown: Sequence[Measure], results: Mapping[str, Indices | None]) -> Path:
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = empty_canvas(4.3 * columns, 0.5 + 3.5 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat[len(shown) :]:
        axis.set_visible(False)
    order, out = order_of(table, results), table.failed
    for axis, measure in zip(axes.flat, shown, strict=False):
        i, j = strongest(results.get(measure.name), 2, order)
        (x, x_title), (y, y_title) = factor_axis(table, i), factor_axis(table, j)
        z, title = outcome_axis(table, measure)
        if table.plan.design == "grid":
            drawn = _heat(axis, x, y, z)
        else:
            known = np.isfinite(z)
            drawn = axis.scatter(x[known], y[known], c=z[known], s=20, cmap="viridis", linewidths=0)
            axis.plot(x[out], y[out], "x", color="#c1121f", markersize=4, markeredgewidth=0.9)
            for k, which in ((i, "x"), (j, "y")):
                if table.plan.factors[k].spread == "log":
                    _logarithmic(axis, which)
        axis.set_xlabel(x_title, fontsize=9)
        axis.set_ylabel(y_title, fontsize=9)
        axis.set_title(title, fontsize=10, loc="left")
        axis.tick_params(labelsize=8)
        axis.spines[["top", "right"]].set_visible(False)
        figure.colorbar(drawn, ax=axis, aspect=30).ax.tick_params(labelsize=8)
    over = "the two factors that move it most"
    if table.plan.design == "grid":
        over += ("; means over the others" if len(table.plan.factors) > 2 else "") + ("; grey: no value" if out.any() else "")
    elif out.any():
        over += f"; {out.sum()} case{'s' if out.sum() > 1 else ''} that did not go as planned: x"
    _entitle(figure, f"{_name(table)}: each outcome over {over}")
    figure.savefig(path)
    return path


def _heat(axis: Any, x: Array, y: Array, z: Array) -> Any:
    """Means of z over the cells of a grid: one as large as the other, at the values that were run."""
    across, at_x = np.unique(x, return_inverse=True)
    up, at_y = np.unique(y, return_inverse=True)
    total, count = np.zeros((len(up), len(across))), np.zeros((len(up), len(across)))
    known = np.isfinite(z)
    np.add.at(total, (at_y[known], at_x[known]), z[known])
    np.add.at(count, (at_y[known], at_x[known]), 1)
    mean = np.ma.masked_invalid(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))
    axis.set_facecolor("#e5e5e5")
    for levels, which in ((across, axis.set_xticks), (up, axis.set_yticks)):
        shown = np.arange(0, len(levels), -(-len(levels) // MOST_TICKS))
        which(shown, [f"{levels[k]:.4g}" for k in shown])
    return axis.pcolormesh(np.arange(len(across)), np.arange(len(up)), mean, cmap="viridis", shading="nearest")


def _effects(path: Path, table: StudyTable, shown: Sequence[Measure], order: Sequence[int]) -> Path:
    """Every outcome against every factor, with the running median and half of all cases."""
    rows, columns = len(shown), len(order)
    figure = empty_canvas(1.2 + 2.0 * columns, 0.7 + 1.65 * rows)
    axes = figure.subplots(rows, columns, sharex="col", sharey="row", squeeze=False)
    for r, measure in enumerate(shown):
        z, title = outcome_axis(table, measure)
        known = np.isfinite(z)
        dots = next(style for fewer, style in DOTS if known.sum() < fewer)
        for c, k in enumerate(order):
            axis = axes[r, c]
            x, x_title = factor_axis(table, k)
            axis.plot(x[known], z[known], ".", color=COLORS[0], markeredgewidth=0, **dots)
            middle, low, median, high = _running(x[known], z[known])
            axis.fill_between(middle, low, high, color=COLORS[1], alpha=0.25, linewidth=0)
            axis.plot(middle, median, color=COLORS[1], linewidth=1.6)
            if table.plan.factors[k].spread == "log":
                _logarithmic(axis, "x")
            _plain(axis)
            axis.tick_params(labelsize=7.5)
            if r == rows - 1:
                axis.set_xlabel(x_title.replace(" (", "\n("), fontsize=8.5)
        axes[r, 0].set_ylabel(title.replace(" [", "\n["), fontsize=8.5)
    _entitle(figure, f"{_name(table)}: every case; median and middle half along each factor")
    figure.savefig(path)
    return path


def _running(x: Array, z: Array) -> tuple[Array, Array, Array, Array]:
    """Middle of x, and quartiles of z, in bins of equally many cases; of few distinct values at each of them."""
    levels = np.unique(x)
    if len(levels) <= 2 * BINS:
        groups = [x == level for level in levels]
    else:
        edges = np.quantile(x, np.linspace(0, 1, BINS + 1))
        which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
        groups = [which == k for k in range(BINS)]
    groups = [group for group in groups if group.any()]
    quartiles = np.array([np.quantile(z[group], [0.25, 0.5, 0.75]) for group in groups]).reshape(-1, 3)
    low, middle, high = quartiles.T
    return np.array([np.median(x[group]) for group in groups]), low, middle, high


def _envelopes(path: Path, table: StudyTable, envelopes: Sequence[Bands]) -> Path:
    figure = empty_canvas(9.0, 0.9 + 2.3 * len(envelopes))
    axes = figure.subplots(len(envelopes), 1, sharex=True, squeeze=False)[:, 0]
    for axis, one in zip(axes, envelopes, strict=True):
        by, unit = scale(one.channel.unit, float(np.nanmax(np.abs(one.values))))
        low, lower, median, upper, high = by * one.values
        axis.fill_between(
            one.time, low, high, color=COLORS[0], alpha=0.18, linewidth=0, label="9 of 10 cases" if one.cases >= FEW_CASES else "5 to 95 %"
        )
        axis.fill_between(
            one.time,
            lower,
            upper,
            color=COLORS[0],
            alpha=0.35,
            linewidth=0,
            label="half of them" if one.cases >= FEW_CASES else "25 to 75 %",
        )
        axis.plot(one.time, median, color=COLORS[0], linewidth=1.6, label="median")
        axis.set_ylabel(unit if unit != "-" else "")
        axis.set_title(label(one.channel.name), fontsize=10, loc="left")
        _plain(axis)
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(envelopes[0].time[0], envelopes[0].time[-1])
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower right", ncols=3, frameon=False, fontsize=9)
    _entitle(figure, f"{_name(table)}: {envelopes[0].cases} cases over time")
    figure.savefig(path)
    return path
