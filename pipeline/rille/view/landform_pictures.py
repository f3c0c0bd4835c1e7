"""Pictures of landforms: plan with contours beside the profile, and a sheet of many."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GROUND, INK, LINE, SECOND = "#b9a58b", "#2b2b2b", "#8c3b1b", "#1b6ca8"
DARK, MIDDLE, BRIGHT = "#15120f", "#a8957c", "#fdf8ee"  # of the hill-shade
SUN = np.radians([135.0, 35.0])  # direction it comes from (from x towards y: north-west), height
SHADES = 80  # colours of the file: small files, no visible steps
SIZE = (9.6, 4.1)  # of a picture [inch]
EXAGGERATIONS = (1, 2, 3, 5, 10, 20, 30, 50, 100, 200, 300, 500, 1000)
BUSY = 12  # turning points of a profile beyond which contours only cover what they should show


class Shown(Protocol):
    """What is drawn, see :class:`rille.terrain.exhibit.Exhibit`."""

    @property
    def name(self) -> str: ...
    @property
    def meaning(self) -> str: ...
    @property
    def drivers(self) -> tuple[tuple[str, str], ...]: ...
    @property
    def x(self) -> Array: ...
    @property
    def y(self) -> Array: ...
    @property
    def heights(self) -> Array: ...
    @property
    def cut_x(self) -> tuple[Array, Array, float]: ...
    @property
    def cut_y(self) -> tuple[Array, Array, float]: ...


def draw_landform(shown: Shown, path: Path) -> None:
    """Hill-shade with contours on the left, profiles along x (and y where it differs) with dimensions on the right; a PNG.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    figure = _figure(*SIZE)
    lines = _wrapped([f"{name} {value}" for name, value in shown.drivers], 165)
    bottom = 0.135 + 0.038 * len(lines)
    plan = figure.add_axes((0.07, bottom, 0.365, 0.89 - bottom), anchor="C")
    profile = figure.add_axes((0.515, bottom, 0.475, 0.89 - bottom))
    _plan(plan, shown)
    plan.set_xlabel("x [m]", fontsize=8.5)
    plan.set_ylabel("y [m]", fontsize=8.5)
    _contours(plan, shown)
    _profile(profile, shown, width=0.475 * SIZE[0], height=(0.89 - bottom) * SIZE[1])
    name = figure.text(0.012, 0.97, shown.name, fontsize=12, weight="bold", va="top")
    plan.annotate(shown.meaning, (1, 0), (10, 1), xycoords=name, textcoords="offset points", fontsize=9.5, color="#444444", va="bottom")
    figure.text(0.012, 0.018, "\n".join(lines), fontsize=7.5, color="#444444", va="bottom", linespacing=1.4)
    _save(figure, path)


def draw_register(shown: Sequence[Shown], path: Path) -> None:
    """All landforms on one sheet, each in its own scale, which its bar gives.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    count = max(len(shown), 1)
    columns = min((5, 6, 7), key=lambda n: (-count % n, n)) if count > 7 else count
    rows = -(-count // columns)
    side, title, gap = 1.9, 0.27, 0.08  # [inch]
    width, height = columns * (side + gap) + gap, rows * (side + title) + gap
    figure = _figure(width, height)
    for k, one in enumerate(shown):
        row, column = divmod(k, columns)
        left, bottom = gap + column * (side + gap), height - (row + 1) * (side + title)
        axis = figure.add_axes((left / width, bottom / height, side / width, side / height))
        _plan(axis, one)
        reach = max(one.x[-1], one.y[0])
        axis.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=[], yticks=[])
        axis.set_title(one.name, fontsize=9, pad=3)
        _scale_bar(axis, float(reach))
    _save(figure, path)


def _figure(width: float, height: float) -> Any:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=100)


def _save(figure: Any, path: Path) -> None:
    import io

    from PIL import Image

    from rille.model import InputRefused

    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    picture = Image.open(buffer).convert("RGB").quantize(SHADES, dither=Image.Dither.NONE)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        picture.save(path, optimize=True)
    except (OSError, ValueError) as error:
        raise InputRefused(f"the picture '{path}' could not be written: {error}") from None


def _plan(axis: Any, shown: Shown) -> None:
    """Hill-shade by Lambert's law. Low forms are lit as if they were steeper, so that they are seen; the profile shows their height."""
    from matplotlib.colors import LinearSegmentedColormap

    step_x, step_y = shown.x[1] - shown.x[0], shown.y[0] - shown.y[1]
    fall, rise = np.gradient(shown.heights, step_y, step_x)
    slopes = np.hypot(fall, rise)
    typical = float(np.percentile(slopes[slopes > 0], 90)) if (slopes > 0).any() else 1.0
    steeper = float(np.clip(0.6 / typical, 0.5, 60.0))
    azimuth, height = SUN
    facing = np.sin(height) - steeper * np.cos(height) * (np.cos(azimuth) * rise - np.sin(azimuth) * fall)
    shade = np.clip(facing / np.sqrt(1 + (steeper * slopes) ** 2), 0.0, 1.0)
    colors = LinearSegmentedColormap.from_list("regolith", [DARK, MIDDLE, BRIGHT])
    extent = (shown.x[0] - step_x / 2, shown.x[-1] + step_x / 2, shown.y[-1] - step_y / 2, shown.y[0] + step_y / 2)
    axis.imshow(shade, cmap=colors, extent=extent, vmin=0.0, vmax=1.08, interpolation="bilinear")
    axis.set_facecolor(colors(float(np.sin(height)) / 1.08))
    axis.set_aspect("equal")
    axis.tick_params(labelsize=7.5, width=0.6)
    for spine in axis.spines.values():
        spine.set_linewidth(0.6)


def _contours(axis: Any, shown: Shown) -> None:
    low, high = float(shown.heights.min()), float(shown.heights.max())
    turns = max(_turns(shown.cut_x[1]), _turns(shown.cut_y[1]))
    levels = _levels(low, high, 9)
    if not levels or turns > BUSY:
        return
    lines = axis.contour(shown.x, shown.y, shown.heights, levels=levels, colors=LINE, linewidths=0.7, negative_linestyles="solid")
    axis.clabel(lines, levels=levels[:: max(1, len(levels) // 4)], fontsize=6.5, fmt=lambda v: f"{v:g}", inline_spacing=2)


def _turns(z: Array) -> int:
    """How often a profile turns between rising and falling."""
    slope = np.diff(z)
    slope = slope[np.abs(slope) > 1e-3 * max(float(np.abs(slope).max()), 1e-300)]
    return int((np.diff(np.sign(slope)) != 0).sum())


def _profile(axis: Any, shown: Shown, *, width: float, height: float) -> None:
    """width, height : of the axis on paper [inch]."""
    (x, z, at_y), (y, zy, at_x) = shown.cut_x, shown.cut_y
    low, high = min(float(z.min()), float(zy.min()), 0.0), max(float(z.max()), float(zy.max()), 0.0)
    reach = float(max(x[-1], y[-1]))
    span = max(high - low, 1e-12)
    fitting = [e for e in EXAGGERATIONS if 1.5 * span * e / height <= 2 * reach / width]
    exaggeration = fitting[-1] if fitting else 1
    view = max(2 * reach / width * height / exaggeration, 1.5 * span)  # heights from the lower to the upper border
    below = low - (view - span) * 0.35
    axis.set(xlim=(-reach, reach), ylim=(below, below + view))
    axis.axhline(0.0, color="#999999", linewidth=0.6, zorder=0)
    axis.fill_between(x, z, below, color=GROUND, alpha=0.45, linewidth=0)
    axis.plot(x, z, color=LINE, linewidth=1.3, label="along x" + (f", at y = {at_y:.3g} m" if at_y else ""))
    same = abs(y[-1] - x[-1]) < 1e-9 * reach and float(np.abs(z - zy).max()) < 0.01 * span
    if not same:
        axis.plot(y, zy, color=SECOND, linewidth=1.1, linestyle=(0, (4, 2)), label="along y" + (f", at x = {at_x:.3g} m" if at_x else ""))
        axis.legend(fontsize=7.5, frameon=False, loc="lower right", ncols=2, borderaxespad=0.2)
    _dimensions(axis, x, z, span, reach, high + 0.3 * (below + view - high))
    axis.set_xlabel(
        "distance from the origin [m]" + (f"; heights drawn {exaggeration} times larger" if exaggeration > 1 else ""), fontsize=8.5
    )
    axis.set_ylabel("height [m]", fontsize=8.5)
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(labelsize=7.5, width=0.6)


def _dimensions(axis: Any, x: Array, z: Array, span: float, reach: float, level: float) -> None:
    """Arrows with the width of what rises or sinks along x (at ``level``), and to the highest and the lowest point."""
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 0.7, "shrinkA": 0, "shrinkB": 0}
    box = {"boxstyle": "square,pad=0.12", "facecolor": "white", "alpha": 0.75, "linewidth": 0}
    touched = np.flatnonzero(np.abs(z) > 1e-3 * span)
    if len(touched):
        left, right = float(x[touched[0]]), float(x[touched[-1]])
        axis.annotate("", (left, level), (right, level), arrowprops=arrow)
        axis.text(
            (left + right) / 2, level, _length(right - left), ha="center", va="center", fontsize=8, color=INK, bbox=box | {"alpha": 1.0}
        )
    for value in (float(z.max()), float(z.min())):
        if abs(value) < 0.02 * span:
            continue
        plateau = x[np.abs(z - value) <= 0.002 * span]
        at = float(plateau[np.abs(plateau - np.median(plateau)).argmin()])
        axis.annotate("", (at, 0.0), (at, value), arrowprops=arrow)
        side = -1 if at > 0.6 * reach else 1
        place = {"ha": "left" if side > 0 else "right", "va": "center", "fontsize": 8, "color": INK, "bbox": box}
        axis.text(at + side * 0.03 * reach, value / 2, _length(abs(value)), **place)


def _scale_bar(axis: Any, reach: float) -> None:
    from matplotlib.patheffects import withStroke

    bar = _nice(2 * reach / 3.5)
    left, bottom = -0.92 * reach, -0.92 * reach
    halo = [withStroke(linewidth=2.5, foreground="white")]
    axis.plot([left, left + bar], [bottom, bottom], color=INK, linewidth=2.2, solid_capstyle="butt", path_effects=halo)
    axis.text(left + bar / 2, bottom + 0.06 * reach, _length(bar), fontsize=7.5, ha="center", va="bottom", color=INK, path_effects=halo)


def _levels(low: float, high: float, count: int) -> list[float]:
    """Round heights between two, without zero (the flat ground around lies there)."""
    if not high > low:
        return []
    step = _nice((high - low) / count)
    first, last = int(np.ceil(low / step + 1e-6)), int(np.floor(high / step - 1e-6))
    return [round(k * step, 12) for k in range(first, last + 1) if k != 0]


def _nice(value: float) -> float:
    """The nearest of 1, 2, 5 times a power of ten, upwards."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(m for m in (1, 2, 5, 10) if m >= value / power - 1e-9))


def _length(value: float) -> str:
    """With a unit that suits."""
    for unit, factor in (("km", 1e-3), ("m", 1.0), ("cm", 100.0)):
        if value * factor >= 1:
            return f"{value * factor:.3g} {unit}"
    return f"{1e3 * value:.2g} mm"


def _wrapped(parts: list[str], width: int) -> list[str]:
    lines = [""]
    for part in parts:
        if lines[-1] and len(lines[-1]) + len(part) + 5 > width:
            lines.append("")
        lines[-1] += ("  \N{MIDDLE DOT}  " if lines[-1] else "") + part
    return lines
