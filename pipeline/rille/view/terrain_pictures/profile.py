"""Heights and slopes along a line, with the landforms that it crosses, and where the line lies."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from rille.model import InputRefused, Terrain
from rille.model.grid import bilinear
from rille.view.terrain_pictures.marks import OUTLINE, Mark
from rille.view.terrain_pictures.paper import INK, PAPER, RULE, SOFT, Box, Paper, number, ticks
from rille.view.terrain_pictures.raster import Raster, lit, sample
from rille.view.terrain_pictures.shade import HEIGHT_COLORS, height_index
from rille.view.terrain_pictures.slope import CLASS_COLORS, EDGES

Array = NDArray[np.float64]
Line = tuple[float, float, float, float]

WIDTH, HEIGHT = 1240, 700
PLOT: Box = (84, 118, 1214, 382)
SLOPES: Box = (84, 430, 930, 640)
MAP: Box = (968, 430, 1214, 640)
GROUND, LINE = "#c9bda6", "#5a4632"


def heights_along(terrain: Terrain, line: Line, step: float) -> tuple[Array, Array, Array, Array]:
    """Distance, x, y, height (n,) [m] along a straight line from (x1, y1) to (x2, y2), at most ``step`` apart, bilinear as in the solver.

    Raises
    ------
    InputRefused : if the line has no length or does not meet the terrain.
    """
    start, end = np.array(line[:2]), np.array(line[2:])
    length = float(np.linalg.norm(end - start))
    if length == 0:
        raise InputRefused(
            f"the line from ({line[0]:g}, {line[1]:g}) to ({line[2]:g}, {line[3]:g}) has no length; give two different points"
        )
    count = int(np.clip(math.ceil(length / step), 2, 20000)) + 1
    share = np.linspace(0, 1, count)
    x, y = start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
    n_rows, n_cols = terrain.heights.shape
    column, row = (x - terrain.x_west) / terrain.posting_x, (terrain.y_north - y) / terrain.posting_y
    slack = 1e-9 * max(n_rows, n_cols)
    inside = (column >= -slack) & (row >= -slack) & (column <= n_cols - 1 + slack) & (row <= n_rows - 1 + slack)
    if not inside.any():
        east, south = terrain.x_west + (n_cols - 1) * terrain.posting_x, terrain.y_north - (n_rows - 1) * terrain.posting_y
        raise InputRefused(
            f"the line from ({line[0]:g}, {line[1]:g}) to ({line[2]:g}, {line[3]:g}) does not meet the terrain, which spans "
            f"x {terrain.x_west:g} to {east:g} m and y {south:g} to {terrain.y_north:g} m"
        )
    z = np.full(count, np.nan)
    pieces = np.array_split(np.flatnonzero(inside), max(1, math.ceil(inside.sum() / 500)))
    for piece in pieces:  # only the windows that the line goes through are read
        c0, c1 = int(np.floor(column[piece].min())), int(np.ceil(column[piece].max())) + 1
        r0, r1 = int(np.floor(row[piece].min())), int(np.ceil(row[piece].max())) + 1
        c0, r0 = max(0, min(c0, n_cols - 2)), max(0, min(r0, n_rows - 2))
        window = np.asarray(terrain.heights[r0 : min(max(r1, r0 + 2), n_rows), c0 : min(max(c1, c0 + 2), n_cols)], float)
        corner = terrain.x_west + c0 * terrain.posting_x, terrain.y_north - r0 * terrain.posting_y
        z[piece] = bilinear(window, corner, (terrain.posting_x, terrain.posting_y), x[piece], y[piece], clamp=True)
    return share * length, x, y, z


def crossed(mark: Mark, x: Array, y: Array) -> NDArray[np.bool_]:
    """Points (n,) of a line that lie in a landform's outline: even-odd rule, as for soils."""
    if mark.outline is None:
        return np.zeros(len(x), bool)
    (ax, ay), (bx, by) = mark.outline.T[..., None], np.roll(mark.outline, 1, axis=0).T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return sides.sum(axis=0) % 2 == 1


def draw_profile(terrain: Terrain, path: Path, line: Line, *, marks: Sequence[Mark] = ()) -> dict[str, float]:
    """Draw the profile into a PNG.

    Returns
    -------
    Length [m], how much of it has heights [m], lowest and highest height [m], steepest slope [deg] along the line over one posting, and
    the vertical exaggeration [-].

    Raises
    ------
    InputRefused : for a line without length, or outside of the terrain.
    """
    posting = min(terrain.posting_x, terrain.posting_y)
    along, x, y, z = heights_along(terrain, line, posting / 2)
    if not np.isfinite(z).any():
        raise InputRefused("there is no height along the whole line; choose another")
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    length = float(along[-1])
    known = np.isfinite(z)
    covered = float(np.diff(along)[known[1:] & known[:-1]].sum())
    partly = "" if known.all() else f" ({covered:.4g} m of it on known ground)"
    baseline = max(2, round(posting / (along[1] - along[0])))  # samples over one posting
    slope = np.full(len(z), np.nan)
    half = baseline // 2
    slope[half : len(z) - (baseline - half)] = np.degrees(
        np.arctan((z[baseline:] - z[:-baseline]) / (along[baseline:] - along[:-baseline]))
    )
    steepest = float(np.nanmax(np.abs(slope))) if np.isfinite(slope).any() else 0.0
    bottom, top = _limits(low, high, length)
    exaggeration = ((PLOT[3] - PLOT[1]) / (top - bottom)) / ((PLOT[2] - PLOT[0]) / length)
    paper = Paper(WIDTH, HEIGHT)
    paper.text((20, 16), f"{terrain.name}: profile", size=19, bold=True)
    paper.text(
        (20, 44),
        f"from ({line[0]:g}, {line[1]:g}) to ({line[2]:g}, {line[3]:g}) m, {length:.4g} m long{partly}; heights {low:.3f} to {high:.3f} m, "
        f"steepest {steepest:.1f}\u00b0; heights enlarged {exaggeration:.3g} times".replace("-", "\u2212"),
        size=13,
        color=SOFT,
    )
    _heights(paper, along, x, y, z, (bottom, top), marks)
    _slopes(paper, along, slope, posting)
    _place(paper, terrain, line, marks)
    paper.text((20, HEIGHT - 24), "Heights are the solver's: bilinear between the values of the grid.", size=12, color=SOFT)
    paper.save(path)
    return {
        "length_m": length,
        "known_m": covered,
        "lowest_m": low,
        "highest_m": high,
        "steepest_deg": steepest,
        "vertical_exaggeration": exaggeration,
    }


def _limits(low: float, high: float, length: float) -> tuple[float, float]:
    """Lower and upper end of the axis of heights: room around them, and at least a fiftieth of the length."""
    room = max(high - low, length / 50) * 1.25
    middle = (low + high) / 2
    return middle - room / 2, middle + room / 2


def _axes(paper: Paper, box: Box, across: tuple[float, float], up: tuple[float, float], labels: tuple[str, str]) -> None:
    pen = paper.pen
    for axis, (low, high) in enumerate((across, up)):
        values = ticks(low, high, 10 if axis == 0 else 5)
        step = values[1] - values[0] if len(values) > 1 else 1.0
        for value in values:
            if axis == 0:
                at = box[0] + (box[2] - box[0]) * (value - low) / (high - low)
                pen.line((at, box[3], at, box[3] + 5), fill=INK)
                paper.text((at, box[3] + 8), number(value, step), size=12, anchor="ma")
            else:
                at = box[3] - (box[3] - box[1]) * (value - low) / (high - low)
                pen.line((box[0], at, box[2], at), fill=RULE)
                pen.line((box[0] - 5, at, box[0], at), fill=INK)
                paper.text((box[0] - 9, at), number(value, step), size=12, anchor="rm")
    paper.text((box[2], box[3] + 25), labels[0], size=12, color=SOFT, anchor="ra")
    paper.text((20, box[1] - 10), labels[1], size=12, color=SOFT, anchor="ls")


def _heights(paper: Paper, along: Array, x: Array, y: Array, z: Array, up: tuple[float, float], marks: Sequence[Mark]) -> None:
    box, length = PLOT, float(along[-1])
    _axes(paper, box, (0.0, length), up, ("distance [m]", "height [m]"))
    px = box[0] + (box[2] - box[0]) * along / length
    py = box[3] - (box[3] - box[1]) * (z - up[0]) / (up[1] - up[0])
    for run in _runs(np.isfinite(z)):
        if len(run) > 1:
            ground = np.column_stack([px[run], py[run]])
            paper.areas([np.concatenate([ground, [[px[run[-1]], box[3]], [px[run[0]], box[3]]]])], GROUND)
            paper.lines([ground], LINE, 2.0)
    ends = [-math.inf] * 3  # of the names in three rows
    for mark in sorted(marks, key=lambda m: float(np.argmax(crossed(m, x, y)))):
        runs = _runs(crossed(mark, x, y))
        for run in runs:
            width, _ = paper.extent(mark.name, size=12)
            middle = (px[run[0]] + px[run[-1]]) / 2
            row = next((k for k, end in enumerate(ends) if middle - width / 2 > end + 8), None)
            for k in (run[0], run[-1]):
                paper.lines([np.array([[px[k], box[1] - 2], [px[k], box[3]]])], OUTLINE, 0.8, dash=(3, 4))
            at = box[1] - 8 if row is None else box[1] - 8 - 14 * row
            paper.lines([np.array([[px[run[0]], box[1] - 2], [px[run[-1]], box[1] - 2]])], OUTLINE, 2.2)
            if row is not None:
                ends[row] = float(middle + width / 2)
                middle = float(np.clip(middle, box[0] + width / 2, box[2] - width / 2))
                paper.text((middle, at), mark.name, size=12, color=OUTLINE, anchor="ms", halo=2)
    paper.pen.rectangle((box[0], box[1], box[2], box[3]), outline=INK)


def _slopes(paper: Paper, along: Array, slope: Array, posting: float) -> None:
    box, length = SLOPES, float(along[-1])
    most = max(5.0, float(np.nanmax(np.abs(slope))) * 1.1 if np.isfinite(slope).any() else 5.0)
    scale = (box[3] - box[1]) / (2 * most)
    middle = (box[1] + box[3]) / 2
    for k, edge in enumerate(EDGES):
        upper = min(EDGES[k + 1] if k + 1 < len(EDGES) else 90.0, most)
        if edge < most:
            for sign in (-1, 1):
                ends = sorted((middle - sign * edge * scale, middle - sign * upper * scale))
                paper.pen.rectangle((box[0], ends[0], box[2], ends[1]), fill=_pale(CLASS_COLORS[k]))
    _axes(paper, box, (0.0, length), (-most, most), ("distance [m]", f"slope along the line [\u00b0], over {posting:.4g} m"))
    for run in _runs(np.isfinite(slope)):
        points = np.column_stack([box[0] + (box[2] - box[0]) * along[run] / length, middle - slope[run] * scale])
        paper.lines([points], LINE, 1.3)
    paper.pen.rectangle((box[0], box[1], box[2], box[3]), outline=INK)


def _pale(color: str) -> tuple[int, int, int]:
    r, g, b = (round(0.3 * int(color[k : k + 2], 16) + 0.7 * 255) for k in (1, 3, 5))
    return r, g, b


def _place(paper: Paper, terrain: Terrain, line: Line, marks: Sequence[Mark]) -> None:
    """A small map with the line on it."""
    samples = sample(replace(terrain, filled=None), most=500)
    scale = min((MAP[2] - MAP[0]) / samples.width, (MAP[3] - MAP[1]) / samples.height)
    raster = Raster(samples, (max(8, round(samples.width * scale)), max(8, round(samples.height * scale))))
    pixels = lit(HEIGHT_COLORS[height_index(raster, *samples.limits)], raster.light())
    corner = (round(MAP[2] - raster.size[0]), round(MAP[1]))
    paper.image.paste(Image.fromarray(pixels), corner)
    box = (*corner, corner[0] + raster.size[0], corner[1] + raster.size[1])
    paper.pen.rectangle((box[0] - 1, box[1] - 1, box[2], box[3]), outline=INK)

    def at(x: Array, y: Array) -> Array:
        return np.column_stack([box[0] + (x - samples.x_west) * scale, box[1] + (samples.y_north - y) * scale])

    rings = [at(*m.outline[np.r_[: len(m.outline), 0]].T) for m in marks if m.outline is not None]
    paper.lines(rings, INK, 0.6, within=box)
    ends = at(np.array(line[::2]), np.array(line[1::2]))
    paper.lines([ends], PAPER, 4.0, within=box)
    paper.lines([ends], OUTLINE, 2.0, within=box)
    paper.dots(ends[:1], 4.0, OUTLINE, rim=PAPER, within=box)
    paper.text(((box[0] + box[2]) / 2, box[3] + 8), "the line, from the dot", size=12, color=SOFT, anchor="ma")


def _runs(mask: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Indices of unbroken stretches of True."""
    found = np.flatnonzero(mask)
    return [run for run in np.split(found, np.flatnonzero(np.diff(found) > 1) + 1) if len(run)]
