"""Pictures of an assembly: its parts in their colours, or its bodies in one colour each with joint axes and wheels over them.

The scene is drawn by :mod:`rille.view.drawing`; axes, circles and labels are drawn over it, flat, so that no part hides them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.view.drawing import Camera, Drawing, Item, draw

Array = NDArray[np.float64]

SIZE = (1600, 1000)
# Colours that stay apart on white (after Tableau 20).
BODY_COLORS = (
    "#9aa3ad",
    "#4e79a7",
    "#f28e2b",
    "#59a14f",
    "#e15759",
    "#76b7b2",
    "#b07aa1",
    "#edc948",
    "#9c755f",
    "#ff9da7",
    "#1f9e89",
    "#6a51a3",
    "#a0cbe8",
    "#8c6d31",
    "#d37295",
    "#499894",
    "#b6992d",
    "#79706e",
    "#c5b0d5",
    "#2f4b7c",
)
_INK = "#1c2430"
_KINDS = {"hinge": "#b00020", "prismatic": "#0050b3", "spherical": "#6a1b9a"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid:
    """Triangles where they stand: vertices (n, 3) [m], triangles (m, 3), colour ``#rrggbb``."""

    vertices: NDArray
    triangles: NDArray
    color: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisMark:
    """A joint: point (3,) [m], axis (3,) unit, kind and label. sure : drawn full, else dashed."""

    point: Array
    axis: Array
    kind: str
    label: str
    sure: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelMark:
    """A wheel's rim: center (3,), axis (3,), radius [m]."""

    center: Array
    axis: Array
    radius: float


def draw_assembly(
    path: Path,
    solids: Sequence[Solid],
    *,
    axes: Sequence[AxisMark] = (),
    wheels: Sequence[WheelMark] = (),
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
    title: str = "",
    legend: Sequence[tuple[str, str]] = (),
) -> list[str]:
    """Draw an assembly into a PNG; with axes or wheels the parts are half transparent.

    Parameters
    ----------
    path : of the picture. solids : what stands there. axes, wheels : marks. up : of the drawing. legend : (name, colour) pairs.

    Returns
    -------
    Notes about what could not be drawn; empty if all was.
    """
    if not solids:
        return ["there is nothing to draw: no part has a surface"]
    path.unlink(missing_ok=True)  # an older picture must not pass for a new one
    marked = bool(axes or wheels)
    cloud = np.concatenate([s.vertices for s in solids]).astype(float)
    camera = _camera(cloud, np.array(up, float), [np.array(a.axis) for a in axes])
    items = [Item(vertices=s.vertices, triangles=s.triangles, color=s.color, opacity=0.5 if marked else 1.0) for s in solids]
    sun = np.array(camera.position) - np.array(camera.focus) + np.linalg.norm(np.ptp(cloud, axis=0)) * np.array(up)
    notes = draw(
        {
            path: Drawing(
                items=items,
                camera=camera,
                size=SIZE,
                background=("#eef1f5", "#ffffff"),
                sun=tuple(map(float, sun / np.linalg.norm(sun))),  # type: ignore[arg-type]
            )
        }
    )
    if not notes and (marked or title or legend):
        _draw_over(path, camera, cloud, axes, wheels, title, legend)
    return notes


def project(points: Array, camera: Camera, size: tuple[int, int] = SIZE) -> Array:
    """Pixels (n, 2), from the upper left corner, of points (n, 3) in front of a camera."""
    eye, focus = np.array(camera.position), np.array(camera.focus)
    ahead = (focus - eye) / np.linalg.norm(focus - eye)
    right = np.cross(ahead, camera.up)
    right /= np.linalg.norm(right)
    above = np.cross(right, ahead)
    away = np.atleast_2d(points) - eye
    depth = np.maximum(away @ ahead, 1e-9)
    scale = size[1] / 2 / math.tan(math.radians(camera.view_angle) / 2)
    return np.column_stack([size[0] / 2 + scale * (away @ right) / depth, size[1] / 2 - scale * (away @ above) / depth])


def spread(wanted: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Positions near the wanted ones, in their order, at least ``gap`` apart and within bounds if there is room."""
    order = np.argsort(wanted, kind="stable")
    if len(order) == 0:
        return []
    gap = min(gap, (high - low) / max(len(order) - 1, 1))
    placed = np.clip(np.array(wanted, float)[order], low, high)
    for i in range(1, len(placed)):
        placed[i] = max(placed[i], placed[i - 1] + gap)
    placed[-1] = min(placed[-1], high)
    for i in range(len(placed) - 2, -1, -1):
        placed[i] = min(placed[i], placed[i + 1] - gap)
    result = np.empty(len(placed))
    result[order] = placed
    return [float(v) for v in result]


def _camera(cloud: Array, up: Array, axes: list[Array]) -> Camera:
    """Three-quarter view from where the longest side lies across and few axes point at the eye."""
    up = up / np.linalg.norm(up)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    middle = (low + high) / 2
    first = np.linalg.svd(up[None])[2][1]
    second = np.cross(up, first)
    best, looks = -math.inf, first
    for turn in np.linspace(0, 2 * math.pi, 24, endpoint=False):
        side = math.cos(turn) * first + math.sin(turn) * second
        view = 0.88 * side + 0.47 * up
        view /= np.linalg.norm(view)
        across = np.cross(up, side)
        width = float(np.ptp(cloud @ across))
        pointing = sum(max(0.0, abs(float(view @ a)) - 0.7) for a in axes)
        # A little preference for the front and the right, so that like machines look alike.
        score = (
            width / float(np.linalg.norm(high - low)) - 0.5 * pointing / max(len(axes), 1) + 0.02 * float(view @ np.array([0.6, -0.8, 0]))
        )
        if score > best:
            best, looks = score, view
    angle = 30.0
    right = np.cross(-looks, up)
    right /= np.linalg.norm(right)
    above = np.cross(right, -looks)
    half_height = float(np.ptp(cloud @ above)) / 2
    half_width = float(np.ptp(cloud @ right)) / 2
    depth = float(np.ptp(cloud @ looks)) / 2
    # Labels stand left and right: a quarter of the picture's width is theirs.
    need = max(half_height * 1.12, half_width * 1.12 * SIZE[1] / (0.72 * SIZE[0]))
    distance = need / math.tan(math.radians(angle) / 2) + depth
    center = middle + (float((cloud @ above).max() + (cloud @ above).min()) / 2 - float(middle @ above)) * above
    center = center + (float((cloud @ right).max() + (cloud @ right).min()) / 2 - float(center @ right)) * right
    position = center + distance * looks
    return Camera(
        position=tuple(map(float, position)),  # type: ignore[arg-type]
        focus=tuple(map(float, center)),  # type: ignore[arg-type]
        up=tuple(map(float, up)),  # type: ignore[arg-type]
        view_angle=angle,
    )


def _draw_over(
    path: Path,
    camera: Camera,
    cloud: Array,
    axes: Sequence[AxisMark],
    wheels: Sequence[WheelMark],
    title: str,
    legend: Sequence[tuple[str, str]],
) -> None:
    """Axes, rims, labels with leader lines, and the legend, over the picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.image import imread
    from matplotlib.lines import Line2D

    width, height = SIZE
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    FigureCanvasAgg(figure)
    plot = figure.add_axes((0, 0, 1, 1))
    plot.imshow(imread(path), extent=(0, width, height, 0), aspect="auto")
    plot.set_xlim(0, width)
    plot.set_ylim(height, 0)
    plot.set_axis_off()
    reach = 0.07 * float(np.linalg.norm(np.ptp(cloud, axis=0)))
    for wheel in wheels:
        ring = project(_circle(wheel), camera)
        plot.plot(ring[:, 0], ring[:, 1], color="#00695c", linewidth=2.2)
    anchors = []
    for mark in axes:
        start, end = project(np.array([mark.point - reach * mark.axis, mark.point + reach * mark.axis]), camera)
        color = _KINDS.get(mark.kind, _INK)
        style = "-" if mark.sure else (0, (4, 3))
        plot.plot([start[0], end[0]], [start[1], end[1]], color="white", linewidth=5.5, solid_capstyle="round")
        plot.plot([start[0], end[0]], [start[1], end[1]], color=color, linewidth=2.6, linestyle=style)
        if np.linalg.norm(end - start) > 25:
            plot.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2.0})
        middle = project(mark.point, camera)[0]
        plot.plot(*middle, marker="o", markersize=5, color=color, markeredgecolor="white")
        anchors.append(middle)
    _labels(plot, np.array(anchors).reshape(-1, 2), [(m.label, _KINDS.get(m.kind, _INK)) for m in axes], has_legend=bool(legend))
    if title:
        plot.text(24, 34, title, fontsize=15, color=_INK, fontweight="bold", va="center")
    kinds = [k for k in _KINDS if any(m.kind == k for m in axes)]
    handles = [Line2D([], [], color=_KINDS[k], linewidth=3, label=k) for k in kinds]
    handles += [Line2D([], [], color="#00695c", linewidth=3, label="wheel")] if wheels else []
    handles += [Line2D([], [], color=color, linewidth=8, alpha=0.75, label=name) for name, color in legend[:24]]
    if handles:
        columns = min(8, max(1, math.ceil(len(handles) / 3)))
        plot.legend(handles=handles, loc="lower center", ncols=columns, fontsize=9.5, framealpha=0.9, edgecolor="#c9d0d8")
    figure.savefig(path, dpi=100)


def _labels(plot, anchors: Array, labels: Sequence[tuple[str, str]], has_legend: bool) -> None:
    """Labels in two columns beside the machine, each with a line to its anchor, none over another."""
    width, height = SIZE
    top, bottom = 80.0, height - (130.0 if has_legend else 60.0)
    order = np.argsort(anchors[:, 0], kind="stable") if len(anchors) else []
    left = set(int(k) for k in order[: (len(anchors) + 1) // 2])
    for side in (True, False):
        members = [k for k in range(len(labels)) if (k in left) == side]
        heights = spread([anchors[k][1] for k in members], 34.0, top, bottom)
        for k, y in zip(members, heights, strict=True):
            text, color = labels[k]
            text = text if len(text) <= 34 else text[:31] + "..."
            x = 24 if side else width - 24
            plot.annotate(
                text,
                xy=tuple(anchors[k]),
                xytext=(x, y),
                fontsize=11.5,
                color=color,
                va="center",
                ha="left" if side else "right",
                bbox={"boxstyle": "round,pad=0.25", "fc": "white", "ec": "#c9d0d8", "alpha": 0.92},
                arrowprops={"arrowstyle": "-", "color": color, "lw": 0.8, "alpha": 0.7, "shrinkB": 4},
            )


def _circle(wheel: WheelMark) -> Array:
    axis = wheel.axis / np.linalg.norm(wheel.axis)
    first = np.linalg.svd(axis[None])[2][1]
    second = np.cross(axis, first)
    turn = np.linspace(0, 2 * math.pi, 73)[:, None]
    return wheel.center + wheel.radius * (np.cos(turn) * first + np.sin(turn) * second)
