"""Picture of the statistics of a terrain: deviogram, slopes by baseline, size-frequency, depth over diameter."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused

Array = NDArray[np.float64]
Report = dict[str, Any]

THIS, OTHER, LAW, FOUND = "#1b6ca8", "#d1495b", "#8a8a8a", "#14213d"
ROCK = "#b5651d"


def draw_statistics(report: Report, path: Path) -> None:
    """Draw a report of :func:`rille.terrain.statistics.measure`, and under its key ``against`` another one beside it.

    Raises
    ------
    InputRefused : if the picture cannot be written.
    """
    if path.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise InputRefused(f"the picture '{path}' is no PNG, SVG or PDF; name it for example stats.png")
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 9.4), dpi=130, layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    against = report.get("against")
    for panel, axis in zip((_deviogram, _slopes, _size_frequency, _depth), axes, strict=True):
        panel(axis, report, against)
        plain_ticks(axis)
        axis.grid(which="major", alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    posting = " x ".join(f"{p:.4g}" for p in dict.fromkeys(report["posting_m"]))
    title = f"{report['name']}: {report['rows']} x {report['columns']} heights at {posting} m"
    figure.suptitle(title + (f", beside {against['name']}" if against else ""), fontsize=13)
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise InputRefused(f"the picture '{path}' could not be written: {error}") from None


def plain_ticks(axis: Any) -> None:
    """Ticks of a logarithmic x axis at 1, 2 and 5 times powers of ten, written out; over many decades at powers of ten alone."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if axis.get_xscale() != "log":
        return
    low, high = axis.get_xlim()
    if high / low < 1e4:
        axis.xaxis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0), numticks=15))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())


def _several(report: Report, against: Report | None) -> list[tuple[Report, str]]:
    return [(report, THIS)] + ([(against, OTHER)] if against else [])


def _deviogram(axis: Any, report: Report, against: Report | None) -> None:
    """nu over lag, the fitted line, and the base alone where a scene states it."""
    base = report.get("base")
    if base is not None:
        rough = base["deviogram"]
        label = f"base alone: {_exponents(rough)}, asked {base['asked']['hurst']:.2f}"
        axis.plot(rough["lag_m"], rough["nu_m"], "-", color=LAW, linewidth=1.2, label=label)
    for each, color in _several(report, against):
        rough = each["deviogram"]
        lag, nu = np.array(rough["lag_m"]), np.array(rough["nu_m"])
        if rough["hurst"] is None:
            axis.plot([], [], "o", color=color, label=f"{each['name']}: level")
            continue
        axis.plot(lag, nu, "o", color=color, markersize=4, label=f"{each['name']}: {_exponents(rough)}")
        low, high = rough["fit_m"]
        inside = (lag >= low) & (lag <= high)
        weight = 1 / lag[inside] ** 2
        level = np.average(np.log(nu[inside]) - rough["hurst"] * np.log(lag[inside]), weights=weight)
        ends = np.array([low, high])
        axis.plot(ends, np.exp(level) * ends ** rough["hurst"], "-", color=color, linewidth=1.5, alpha=0.7)
    axis.set(
        xscale="log", yscale="log", xlabel="lag L [m]", ylabel=r"RMS difference of height $\nu$(L) [m]", title=r"Deviogram, $\nu \sim L^H$"
    )
    axis.legend(frameon=False, fontsize=9, loc="upper left")


def _exponents(rough: Report) -> str:
    """H from second differences with its interval, and that of the line drawn."""
    second, (low, high) = rough["hurst_second"], rough["hurst_second_interval"]
    if second is None:
        return f"line {rough['hurst']:.3f}"
    spread = "" if low is None else f" ± {(high - low) / 2:.3f}"
    return f"H = {second:.3f}{spread} (line {rough['hurst']:.3f})"


def _slopes(axis: Any, report: Report, against: Report | None) -> None:
    """Median, quartiles and 5 to 95 % of slopes along profiles over the baseline, and the median of true slopes."""
    for each, color in _several(report, against):
        steep = each["slopes"]
        length = steep["baseline_m"]
        if len(length) == 0:
            continue
        axis.fill_between(length, steep["p5_deg"], steep["p95_deg"], color=color, alpha=0.12, linewidth=0)
        axis.fill_between(length, steep["p25_deg"], steep["p75_deg"], color=color, alpha=0.25, linewidth=0)
        axis.plot(length, steep["p50_deg"], "o-", color=color, markersize=4, linewidth=1.4, label=f"{each['name']}: median along profiles")
        axis.plot(length, steep["rms_deg"], ":", color=color, linewidth=1.2, label="RMS along profiles")
        axis.plot(length, each["true_slopes"]["p50_deg"], "s--", color=color, markersize=4, linewidth=1.2, label="median of true slopes")
    base = report.get("base")
    if base is not None:
        asked = base["asked"]
        axis.plot(asked["baseline_m"], asked["median_slope_deg"], "D", color=LAW, markersize=7, label="median asked of the base")
    axis.set(xscale="log", xlabel="baseline [m]", ylabel="slope [deg]", title="Slopes by baseline; bands 25-75 %, 5-95 % along profiles")
    axis.set_ylim(0, 1.2 * axis.get_ylim()[1])  # room for the legend
    axis.legend(frameon=False, fontsize=9)


def _size_frequency(axis: Any, report: Report, against: Report | None) -> None:
    """Cumulative number per km^2: laws with their Poisson bands, placed, found."""
    drawn = False
    for kind, color in (("craters", THIS), ("rocks", ROCK)):
        asked = [p for p in report.get("populations", []) if p["kind"] == kind]
        area = report[kind]["area_m2"] / 1e6
        if asked:
            _law(axis, asked, area, color, kind)
        drawn |= _cumulative(axis, report[kind], area, color, f"{kind} of {report['name']}" if against else kind) or bool(asked)
        if against is not None:
            marked = {"craters": OTHER, "rocks": "#e09f3e"}[kind]
            drawn |= _cumulative(axis, against[kind], against[kind]["area_m2"] / 1e6, marked, f"{kind} of {against['name']}")
    axis.set(xscale="log", yscale="log", xlabel="diameter D [m]", ylabel="number per km$^2$ of D and more")
    axis.set_title("Size-frequency, bars and bands 95 %")
    if drawn:
        axis.legend(frameon=False, fontsize=8, loc="lower left")
    else:
        axis.text(0.5, 0.5, "no crater or rock found", transform=axis.transAxes, ha="center", color=LAW)


def _law(axis: Any, asked: list[Report], area: float, color: str, kind: str) -> None:
    """What the populations of a kind ask for together, with the band that 95 of 100 drawings lie in."""
    from scipy.stats import poisson

    low = min(p["curve"]["diameter_m"][0] for p in asked)
    high = max(p["curve"]["diameter_m"][-1] for p in asked)
    diameter = np.geomspace(low, high, 200)[:-1]
    number = np.zeros_like(diameter)
    for p in asked:
        knots, values = np.array(p["curve"]["diameter_m"]), np.array(p["curve"]["number"])
        positive = np.maximum(values, 1e-9)
        number += np.where(diameter < knots[-1], np.exp(np.interp(np.log(diameter), np.log(knots), np.log(positive))), 0.0)
    seen = number > 0.05
    names = ", ".join(dict.fromkeys(p["law"].replace("_", " ") for p in asked))
    axis.plot(diameter[seen], number[seen] / area, "-", color=color, linewidth=1.2, alpha=0.8, label=f"{kind} asked: {names}")
    least, most = poisson.ppf(0.025, number[seen]), poisson.ppf(0.975, number[seen])
    axis.fill_between(diameter[seen], np.maximum(least, 0.3) / area, most / area, color=color, alpha=0.15, linewidth=0)


def _cumulative(axis: Any, forms: Report, area: float, color: str, name: str) -> bool:
    """Placed as crosses, found as circles with their intervals, at the lower border of each bin; False if there are none."""
    from scipy.stats import chi2

    low = np.array(forms["from_m"])
    if len(low) == 0:
        return False
    if forms["placed"] is not None and forms["placed_total"]:
        placed = np.cumsum(np.array(forms["placed"])[::-1])[::-1] / area
        axis.plot(low[placed > 0], placed[placed > 0], "x", color=color, markersize=5, label=f"{name} placed")
    searched, found = np.array(forms["searched_m2"]) / 1e6, np.array(forms["found"])
    known = (searched > 0) & (low >= forms["smallest_searched_m"] * 0.999)
    if not (known & (found > 0)).any():
        return bool(forms["placed_total"])
    density = np.cumsum(np.where(known, found / np.where(known, searched, 1.0), 0.0)[::-1])[::-1]
    number = np.cumsum(np.where(known, found, 0)[::-1])[::-1]
    shown = known & (number > 0)
    count = number[shown]
    bars = np.array([1 - chi2.ppf(0.025, 2 * count) / 2 / count, chi2.ppf(0.975, 2 * count + 2) / 2 / count - 1]) * density[shown]
    axis.errorbar(
        low[shown], density[shown], bars, fmt="o", color=color, mfc="white", markersize=5, linewidth=1.0, label=f"{name} found in the DEM"
    )
    return True


def _depth(axis: Any, report: Report, against: Report | None) -> None:
    """Depth over diameter of every crater found, medians of bins, and that of fresh craters."""
    seen, top = [], 0.25
    for each, color in _several(report, against):
        forms = each["craters"]
        diameter, ratio = np.array(forms["each"]["diameter_m"]), np.array(forms["each"]["depth_over_diameter"])
        if len(diameter) == 0:
            continue
        seen += [diameter.min(), diameter.max()]
        size, alpha = (3, 0.35) if len(diameter) > 200 else (8, 0.6)
        axis.plot(diameter, ratio, ".", color=color, markersize=size, alpha=alpha, markeredgewidth=0)
        top = max(top, 1.25 * float(np.quantile(ratio, 0.99)))
        middle = np.sqrt(np.array(forms["from_m"]) * np.array(forms["to_m"]))
        bins = [
            (m, q[1]) for m, q, n in zip(middle, forms["depth_over_diameter"]["quartiles"], forms["found"], strict=True) if q and n >= 5
        ]
        label = f"{each['name']}: {len(diameter)} craters, median {forms['depth_over_diameter']['median']:.3f}"
        axis.plot([m for m, _ in bins], [v for _, v in bins], "o-", color=color, markersize=5, linewidth=1.3, label=label)
    axis.set(xlabel="diameter [m]", ylabel="depth / diameter [-]", title="Depth of the craters found")
    if not seen:
        axis.text(0.5, 0.5, "no crater found", transform=axis.transAxes, ha="center", color=LAW)
        return
    axis.axhline(0.2178, color=LAW, linewidth=1.0, linestyle="--")
    place = {"xycoords": ("axes fraction", "data"), "xytext": (-4, 3), "textcoords": "offset points", "ha": "right"}
    axis.annotate("fresh (Fassett & Thomson 2014)", (1.0, 0.2178), fontsize=8, color=LAW, **place)
    axis.set_xscale("log")
    axis.set_ylim(0, top)
    axis.legend(frameon=False, fontsize=9, loc="upper left")
