"""Plots by matplotlib: channels over time, and the map."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover, Ruts, Terrain, Trace
from rille.view.obstacles import hull_points, stated_obstacles

Array = NDArray[np.float64]
COLORS = ("#1b6ca8", "#d1495b", "#2a9d5c", "#e09f3e", "#7b4ea3", "#4d4d4d", "#17becf", "#bc5090")


def empty_canvas(width: float, height: float) -> Any:
    """A figure of that size [inch], drawn without a screen."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=130, layout="constrained")


def plot_traces(trace: Trace, rover: Rover, path: Path) -> None:
    """Wheel channels over time; without wheels, joint channels, hinges and prismatic joints apart."""
    rows = _wheel_rows(trace) if trace.wheels else joint_rows(trace, rover)
    figure = empty_canvas(11, 1.0 + 1.9 * len(rows))
    axes = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    names = list(dict.fromkeys(name for _, series in rows for name, _ in series))
    for axis, (label, series) in zip(axes, rows, strict=True):
        for name, values in series:
            style = "--" if "right" in name else "-"
            color = COLORS[names.index(_twin(names, name)) % len(COLORS)]
            axis.plot(trace.time, values, style, color=color, linewidth=1.1, label=name)
        axis.set_ylabel(label)
        axis.grid(alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(trace.time[0], max(trace.time[-1], trace.time[0] + 1e-9))
    lines = {label: line for axis in axes for line, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(lines.values(), lines, loc="outside upper center", ncols=min(6, len(lines)), frameon=False, fontsize=9)
    figure.savefig(path)


def _twin(names: list[str], name: str) -> str:
    """The left twin of a right wheel, so that both share a colour; without one, itself."""
    twin = name.replace("right", "left")
    return twin if twin in names else name


def _wheel_rows(trace: Trace) -> list:
    return [
        ("slip ratio [-]", [(w.name, w.slip_ratio) for w in trace.wheels]),
        ("sinkage [mm]", [(w.name, 1e3 * w.sinkage) for w in trace.wheels]),
        ("drive torque [N m]", [(w.name, w.drive_torque) for w in trace.wheels]),
        ("drawbar pull [N]", [(w.name, w.drawbar_pull) for w in trace.wheels]),
        ("normal load [N]", [(w.name, w.normal_load) for w in trace.wheels]),
    ]


def joint_rows(trace: Trace, rover: Rover) -> list[tuple[str, list[tuple[str, Array]]]]:
    """Rows of a figure: label with unit, and (name, values) of each line. Efforts are those of drives; without joints, heights."""
    kinds = {joint.name: joint.kind for joint in rover.joints}
    driven = {drive.joint for drive in rover.drives}
    rows = []
    for sliding, words in (
        (False, ("angle [rad]", "rate [rad/s]", "drive torque [N m]")),
        (True, ("travel [m]", "speed [m/s]", "drive force [N]")),
    ):
        joints = [j for j in trace.joints if (kinds.get(j.name) == "prismatic") is sliding]
        position, velocity, effort = words
        rows.append((position, [(j.name, j.position) for j in joints]))
        rows.append((velocity, [(j.name, j.velocity) for j in joints]))
        rows.append((effort, [(j.name, j.effort) for j in joints if j.name in driven]))
    return [row for row in rows if row[1]] or [("height [m]", [(b.name, b.position[:, 2]) for b in trace.bodies])]


def plot_map(trace: Trace, rover: Rover, terrain: Terrain, path: Path) -> None:
    """The terrain from above: hill-shade, contours, soil patches, landforms by name, the paths of all wheels."""
    from matplotlib.colors import LightSource
    from matplotlib.patches import Polygon

    n_rows, n_cols = terrain.heights.shape
    stride = max(1, max(n_rows, n_cols) // 1500)
    heights = np.ma.masked_invalid(terrain.heights[::stride, ::stride])
    x = terrain.x_west + terrain.posting_x * np.arange(0, n_cols, stride)
    y = terrain.y_north - terrain.posting_y * np.arange(0, n_rows, stride)
    span = (x[-1] - x[0]) / (y[0] - y[-1])
    figure = empty_canvas(min(13.0, 2.0 + 7.5 * span), 8.0)
    axis = figure.subplots()
    shade = LightSource(azdeg=315, altdeg=28).hillshade(
        heights.filled(float(heights.min())), dx=terrain.posting_x * stride, dy=terrain.posting_y * stride
    )
    extent = (x[0], x[-1], y[-1], y[0])
    axis.imshow(shade, cmap="gray", extent=extent, vmin=0.0, vmax=1.0, interpolation="bilinear")
    relief = axis.imshow(heights, cmap="cividis", extent=extent, alpha=0.35, interpolation="bilinear")
    axis.contour(x, y, heights, levels=14, colors="black", linewidths=0.4, alpha=0.5)
    for region in terrain.patches:
        axis.add_patch(Polygon(region.polygon, closed=True, facecolor="#d9822b", edgecolor="#7a3e00", alpha=0.35, linewidth=1.2))
        east, north = np.mean(region.polygon, axis=0)
        axis.annotate(f"{region.name} ({region.soil})", (east, north), fontsize=8, ha="center", color="#4a2500")
    for obstacle in stated_obstacles(terrain):
        from scipy.spatial import ConvexHull

        plan = hull_points(obstacle)[:, :2]
        axis.add_patch(Polygon(plan[ConvexHull(plan).vertices], closed=True, facecolor="#3a3632", edgecolor="white", linewidth=0.6))
    for landform in terrain.landforms:
        axis.plot(landform.x, landform.y, "+", color="white", markersize=6)
        axis.annotate(landform.name, (landform.x, landform.y), xytext=(4, 4), textcoords="offset points", fontsize=8, color="white")
    for wheel in trace.wheels:
        axis.plot(wheel.center[:, 0], wheel.center[:, 1], color="#c1121f", linewidth=0.7, alpha=0.8)
    carried = {joint.child for joint in rover.joints}
    root = next((body for body in trace.bodies if body.name not in carried), trace.bodies[0])
    axis.plot(root.position[:, 0], root.position[:, 1], color="#ffd166", linewidth=1.6, label="path of " + root.name)
    axis.plot(*root.position[0, :2], "o", color="#06d6a0", markersize=7, label="start")
    axis.plot(*root.position[-1, :2], "s", color="#ef476f", markersize=7, label="end")
    axis.set(xlabel="x [m]", ylabel="y [m]", title=f"{terrain.name}: run {trace.run_id} of '{trace.scenario}'", aspect="equal")
    axis.set_xlim(x[0], x[-1])
    axis.set_ylim(y[-1], y[0])
    axis.legend(loc="lower right", fontsize=8)
    figure.colorbar(relief, ax=axis, label="height [m]", shrink=0.8)
    figure.savefig(path)


def plot_ruts(ruts: Ruts, terrain: Terrain, path: Path, title: str) -> None:
    """Depth of the ruts from above, over the hill-shade of the ground around them."""
    from matplotlib.colors import LightSource

    from rille.model.grid import bilinear

    touched = np.argwhere(ruts.sinkage > 0)
    margin = 8
    low = np.maximum(touched.min(axis=0) - margin, 0)
    high = np.minimum(touched.max(axis=0) + margin + 1, ruts.sinkage.shape)
    depth = ruts.sinkage[low[0] : high[0], low[1] : high[1]]
    x = ruts.x_west + ruts.posting * np.arange(low[1], high[1])
    y = ruts.y_north - ruts.posting * np.arange(low[0], high[0])
    stride = max(1, max(depth.shape) // 3000)
    depth, x, y = depth[::stride, ::stride], x[::stride], y[::stride]
    origin, posting = (terrain.x_west, terrain.y_north), (terrain.posting_x, terrain.posting_y)
    filled = np.where(np.isnan(terrain.heights), np.nanmin(terrain.heights), terrain.heights)
    ground = bilinear(filled, origin, posting, x[None, :], y[:, None], clamp=True) - depth
    figure = empty_canvas(12.0, min(12.0, 1.4 + 11.0 * depth.shape[0] / depth.shape[1]))
    axis = figure.subplots()
    extent = (x[0], x[-1], y[-1], y[0])
    step = ruts.posting * stride
    axis.imshow(LightSource(azdeg=315, altdeg=28).hillshade(ground, dx=step, dy=step), cmap="gray", extent=extent, vmin=0.0, vmax=1.0)
    shown = axis.imshow(np.ma.masked_equal(1e3 * depth, 0.0), cmap="inferno_r", extent=extent, alpha=0.75)
    axis.set(xlabel="x [m]", ylabel="y [m]", title=title, aspect="equal")
    figure.colorbar(shown, ax=axis, label="depth of the rut [mm]", shrink=0.8)
    figure.savefig(path)
