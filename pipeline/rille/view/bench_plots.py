"""Figures of the single-wheel bench: drawbar-pull coefficient, torque and sinkage against slip."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import BenchPoints
from rille.view.plots import COLORS, empty_canvas

Array = NDArray[np.float64]
STYLES = ("-", "--", "-.", ":")
SAME_LOAD = 0.1  # share by which a bench misses its load


def plot_bench(
    curves: Sequence[tuple[str, BenchPoints]], path: Path, measured: BenchPoints | None = None, title: str = "", dots: str = "measured"
) -> None:
    """Lines of calculated series, one colour a load, one line style a series; ``measured`` as dots in the colour of their load.

    Panels: drawbar pull per load, side force per load (where there is any), drive torque, sinkage; those without a number are left out.
    dots : what the dots are, for the legend.
    """
    loads = sorted({round(float(v), 6) for _, points in curves for v in points.load})
    panels = [("drawbar pull / load [-]", lambda p: p.drawbar_pull / p.load)]
    shown = [points for _, points in curves] + ([measured] if measured is not None else [])
    if any(np.abs(p.slip_angle).max(initial=0) > 1e-6 for p in shown):
        panels.append(("side force / load [-]", lambda p: p.side_force / p.load))
    panels.append(("drive torque [N m]", lambda p: p.drive_torque))
    panels.append(("sinkage [mm]", lambda p: 1e3 * p.sinkage))
    figure = empty_canvas(4.4 * len(panels), 4.6)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    at = _loads_of(measured, loads) if measured is not None else np.empty(0)  # of measured points
    every = [*loads, *(float(load) for load in np.unique(at) if load not in loads)]
    colors = {load: COLORS[k % len(COLORS)] for k, load in enumerate(every)}
    for axis, (label, value) in zip(axes, panels, strict=True):
        for k, (_, points) in enumerate(curves):
            for load in loads:
                chosen = points.where(np.isclose(points.load, load))
                order = np.argsort(chosen.slip_ratio)
                axis.plot(chosen.slip_ratio[order], value(chosen)[order], STYLES[k % len(STYLES)], color=colors[load], linewidth=1.5)
        if measured is not None:
            for load in np.unique(at):
                chosen = measured.where(at == load)
                axis.plot(
                    chosen.slip_ratio, value(chosen), "o", color=colors[load], markersize=4, markerfacecolor="none", markeredgewidth=1.0
                )
        axis.set_xlabel("slip ratio [-]")
        axis.set_title(label, fontsize=10, loc="left")
        axis.axhline(0, color="#888888", linewidth=0.6)
        axis.grid(alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colors[load], linewidth=3, label=f"{load:.3g} N") for load in every]
    handles += [Line2D([], [], color="#333333", linestyle=STYLES[k % len(STYLES)], label=name) for k, (name, _) in enumerate(curves)]
    if measured is not None:
        handles.append(Line2D([], [], color="#333333", marker="o", markerfacecolor="none", linestyle="", label=dots))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(8, len(handles)), frameon=False, fontsize=9)
    if title:
        figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    figure.savefig(path)


def _loads_of(points: BenchPoints, loads: Sequence[float]) -> Array:
    """The load (n,) [N] that each point belongs to: the nearest of those given, or of smaller ones that were measured, within 10 %."""
    known = list(loads)
    found = np.empty(len(points))
    for k in np.argsort(points.load):
        own = float(points.load[k])
        nearest = min(known, key=lambda load: abs(load - own), default=np.inf)
        if not abs(nearest - own) <= SAME_LOAD * own:
            known.append(nearest := own)
        found[k] = nearest
    return found
