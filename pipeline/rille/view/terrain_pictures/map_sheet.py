"""A map on paper: the frame with its axes, title, caption, side panel with scale bar and north arrow."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from rille.model import Terrain
from rille.model.polygon import soil_names
from rille.view.obstacles import stated_obstacles
from rille.view.terrain_pictures.marks import MOST_LABELS, OUTLINE, Label, Mark, draw_labels, place_labels
from rille.view.terrain_pictures.paper import INK, PAPER, RULE, SOFT, Box, Paper, number, ticks, wrap
from rille.view.terrain_pictures.raster import Bytes, Raster, Samples, hatch, nice

Array = NDArray[np.float64]

LARGEST = (960, 820)  # of the map [pixels]
LEFT, TOP, GAP, PANEL, BELOW = 76, 86, 26, 236, 50
LEAST_HEIGHT = 430  # of the panel [pixels]
SOIL_COLORS = ("#8d99a6", "#c9772b", "#3f7fb5", "#5d9a58", "#8a63b0", "#c2517a", "#a48f3d", "#3e9a96")
NO_DATA, NO_DATA_LINE, FILLED_LINE = "#d5d8dc", "#9aa1a9", "#7b2cbf"


def soil_color(terrain: Terrain, soil: str) -> str:
    """The colour that stands for a soil in all maps of a terrain."""
    return SOIL_COLORS[soil_names(terrain.soil, terrain.patches).index(soil) % len(SOIL_COLORS)]


def map_name(terrain: Terrain) -> str:
    """Name of the map projection: the first name in its WKT."""
    return terrain.crs.split('"')[1] if terrain.crs.count('"') > 1 else terrain.crs


def counted(terrain: Terrain) -> str:
    """A sentence on what the terrain is composed of, and where its origin lies on the map."""
    parts = []
    if terrain.landforms:
        kinds = Counter(landform.landform for landform in terrain.landforms)
        parts.append(f"{plural(len(terrain.landforms), 'placed landform')} of {plural(len(kinds), 'kind')}")
    parts += [f"population '{p.name}' of {plural(len(p.x), p.landform.replace('_', ' '))}" for p in terrain.populations]
    stones = stated_obstacles(terrain)
    if stones:
        parts.append(plural(len(stones), "obstacle"))
    sentences = ["; ".join(parts)]
    if terrain.crs:
        east, north, up = terrain.map_origin
        turn = f", x turned {math.degrees(terrain.map_heading):.4g}\u00b0 against east" if terrain.map_heading else ""
        place = f"Origin at E {east:.1f} m, N {north:.1f} m, height {up:.1f} m{turn} ({map_name(terrain)})".replace("-", "\u2212")
        sentences.append(place)
    if terrain.source:
        sentences.append(f"Base: {terrain.source}.")
    return ". ".join(sentence for sentence in sentences if sentence)


def extent(terrain: Terrain) -> str:
    """Width and height in words, of all its heights, also where a picture shows every k-th alone."""
    n_rows, n_cols = terrain.heights.shape
    return f"{(n_cols - 1) * terrain.posting_x:g} m \u00d7 {(n_rows - 1) * terrain.posting_y:g} m"


def plural(count: int, what: str) -> str:
    """``3 craters``."""
    return f"{count:,} {what}".replace(",", "\u2009") + ("" if count == 1 or what.endswith("s") else "s")


class MapSheet:
    """A map with its surroundings; :attr:`box` is where the map lies, :meth:`pixels` where a point of W lies."""

    def __init__(self, terrain: Terrain, samples: Samples, title: str, subtitle: str, caption: str) -> None:
        """Lay out the sheet; the map is empty."""
        self.terrain, self.samples = terrain, samples
        width, height = samples.width, samples.height
        scale = min(LARGEST[0] / width, LARGEST[1] / height)
        self.size = max(24, round(width * scale)), max(24, round(height * scale))
        self.raster = Raster(samples, self.size)
        self.box: Box = (LEFT, TOP, LEFT + self.size[0], TOP + self.size[1])
        total = LEFT + self.size[0] + GAP + PANEL
        lines = wrap(caption, total - 40, 12)
        bottom = max(self.box[3], TOP + LEAST_HEIGHT)
        self.paper = Paper(total, round(bottom + BELOW + 17 * len(lines) + 12))
        self.paper.text((20, 16), title, size=19, bold=True)
        self.paper.text((20, 44), subtitle, size=13, color=SOFT)
        for k, line in enumerate(lines):
            self.paper.text((20, bottom + BELOW + 17 * k), line, size=12, color=SOFT)
        self.panel_x = self.box[2] + GAP
        self.panel_y = float(TOP)
        self.panel_end = bottom

    def pixels(self, x: Array | float, y: Array | float) -> Array:
        """Pixels (..., 2) on the paper of points [m] in W."""
        s = self.samples
        px = self.box[0] + (np.asarray(x, float) - s.x_west) / s.width * self.size[0]
        py = self.box[1] + (s.y_north - np.asarray(y, float)) / s.height * self.size[1]
        return np.stack(np.broadcast_arrays(px, py), axis=-1)

    def centers(self) -> tuple[Array, Array]:
        """x and y [m] of the middles of the map's pixels."""
        s = self.samples
        x = s.x_west + (np.arange(self.size[0]) + 0.5) / self.size[0] * s.width
        return x, s.y_north - (np.arange(self.size[1]) + 0.5) / self.size[1] * s.height

    def lay(self, pixels: Bytes) -> None:
        """Put the map's pixels (rows, columns, 3) into the frame."""
        self.paper.image.paste(Image.fromarray(pixels), (round(self.box[0]), round(self.box[1])))

    def frame(self) -> None:
        """Frame, ticks and their labels in metres."""
        s, pen, box = self.samples, self.paper.pen, self.box
        pen.rectangle((box[0] - 1, box[1] - 1, box[2], box[3]), outline=INK)
        for axis, (low, high) in enumerate(((s.x_west, s.x_west + s.width), (s.y_north - s.height, s.y_north))):
            values = ticks(low, high, max(2, self.size[axis] // 95))
            step = values[1] - values[0] if len(values) > 1 else abs(values[0]) if values and values[0] else 1.0
            for value in values:
                if axis == 0:
                    at = float(self.pixels(value, s.y_north)[0])
                    pen.line((at, box[3], at, box[3] + 5), fill=INK)
                    self.paper.text((at, box[3] + 8), number(value, step), size=12, anchor="ma")
                else:
                    at = float(self.pixels(s.x_west, value)[1])
                    pen.line((box[0] - 6, at, box[0] - 1, at), fill=INK)
                    self.paper.text((box[0] - 9, at), number(value, step), size=12, anchor="rm")
        self.paper.text((box[2], box[3] + 27), "x [m]", size=12, color=SOFT, anchor="ra")
        self.paper.text((box[0] - 9, box[1] - 7), "y [m]", size=12, color=SOFT, anchor="rs")

    def compass(self) -> None:
        """Scale bar and north arrow at the foot of the panel."""
        scale = self.size[0] / self.samples.width
        length = nice(52 / scale)
        x0, y0 = self.panel_x, self.panel_end - 8
        width = length * scale
        pen = self.paper.pen
        for k in range(4):
            fill = INK if k % 2 == 0 else PAPER
            pen.rectangle((x0 + k * width / 4, y0 - 7, x0 + (k + 1) * width / 4, y0), fill=fill, outline=INK)
        self.paper.text((x0, y0 - 12), "0", size=12, anchor="ls")
        self.paper.text((x0 + width, y0 - 12), f"{length:g} m" if length < 1000 else f"{length / 1000:g} km", size=12, anchor="ms")
        turn = self.terrain.map_heading
        north = np.array([math.sin(turn), -math.cos(turn)])  # pixels: y points down
        middle = np.array([self.panel_x + PANEL - 46, y0 - 30.0])
        self.paper.arrow(middle - 17 * north, middle + 21 * north, INK, 2.6)
        self.paper.text(tuple(middle + 32 * north), "N", size=14, bold=True, anchor="mm")

    def heading(self, text: str) -> None:
        """A headline in the panel."""
        self.paper.text((self.panel_x, self.panel_y), text, size=13, bold=True)
        self.panel_y += 23

    def note(self, text: str) -> None:
        """Small print in the panel, beside the swatches."""
        self.panel_y = self.paper.wrapped((self.panel_x + 34, self.panel_y), text, PANEL - 54, size=11) + 5

    def entry(
        self, text: str, *, color: str = "", line: str = "", width: float = 1.5, dot: str = "", hatched: str = "", dash: bool = False
    ) -> None:
        """A row of the legend: a swatch, a line, a dot or a hatched swatch, and its meaning."""
        x, y = self.panel_x, self.panel_y + 8
        if color or hatched:
            box = (round(x), round(y - 7), round(x + 24), round(y + 7))
            self.paper.pen.rectangle(box, fill=color or PAPER, outline=RULE)
            for k in range(-14, 24, 7) if hatched else ():
                self.paper.lines(
                    [np.array([[x + k, y + 7.0], [x + k + 14, y - 7.0]])], hatched, 1.2, within=(*box[:2], box[2] + 1.0, box[3] + 1.0)
                )
        if line:
            self.paper.lines([np.array([[x, y], [x + 24.0, y]])], line, width, dash=(5, 3) if dash else None)
        if dot:
            self.paper.dots(np.array([[x + 12.0, y]]), 3.5, dot, rim=PAPER)
        self.panel_y = max(self.paper.wrapped((x + 34, self.panel_y), text, PANEL - 54, color=INK), self.panel_y + 20) + 4

    def color_bar(self, title: str, colors: Bytes, low: float, high: float, height: float) -> None:
        """A vertical bar of colours (n, 3) between two values, with ticks."""
        self.heading(title)
        x, y = round(self.panel_x), round(self.panel_y + 4)
        tall = round(height)
        index = np.linspace(len(colors) - 1, 0, tall).round().astype(int)
        self.paper.image.paste(Image.fromarray(np.repeat(colors[index][:, None], 24, axis=1)), (x, y))
        self.paper.pen.rectangle((x - 1, y - 1, x + 24, y + tall), outline=INK)
        values = ticks(low, high, max(2, tall // 34)) if high > low else [low]
        step = values[1] - values[0] if len(values) > 1 else max(abs(low), 1.0)
        for value in values:
            at = y + (tall - 1) * (high - value) / max(high - low, 1e-12)
            self.paper.pen.line((x + 24, at, x + 29, at), fill=INK)
            self.paper.text((x + 34, at), number(value, step), size=12, anchor="lm")
        self.panel_y = y + tall + 18

    def place(self, marks: Sequence[Mark]) -> tuple[list[Label], int]:
        """Places of the names of landforms, the largest first; and how many names find none."""
        ordered = sorted((m for m in marks if self._shown(m)), key=lambda m: -_area(m))
        points = [(m.name, tuple(self.pixels(m.x, m.y))) for m in ordered[:MOST_LABELS]]
        labels, lost = place_labels(self.paper, points, self.box)
        return labels, len(lost) + len(ordered) - len(points)

    def outlines(self, marks: Sequence[Mark], color: str = OUTLINE) -> None:
        """Footprints, and a dot with a tick towards the heading at every origin."""
        shown = [m for m in marks if self._shown(m)]
        rings = [self.pixels(*m.outline[np.r_[: len(m.outline), 0]].T) for m in shown if m.outline is not None]
        self.paper.lines(rings, color, 1.2, within=self.box)
        at = np.array([self.pixels(m.x, m.y) for m in shown]).reshape(-1, 2)
        tips = at + 13 * np.array([[math.cos(m.heading), -math.sin(m.heading)] for m in shown]).reshape(-1, 2)
        self.paper.lines(list(np.stack([at, tips], axis=1)), PAPER, 4.2, within=self.box)
        self.paper.lines(list(np.stack([at, tips], axis=1)), color, 2.2, within=self.box)
        self.paper.dots(at, 3.0, color, rim=PAPER, within=self.box)

    def name(self, labels: Sequence[Label]) -> None:
        """Write the names."""
        draw_labels(self.paper, labels)

    def patches(self) -> None:
        """Outlines of soil patches, dashed in the colour of their soil."""
        for patch in self.terrain.patches:
            corners = np.array(patch.polygon)
            ring = self.pixels(*corners[np.r_[: len(corners), 0]].T)
            self.paper.lines([ring], PAPER, 3.2, within=self.box)
            self.paper.lines([ring], soil_color(self.terrain, patch.soil), 2.0, within=self.box, dash=(8, 4))

    def obstacles(self) -> None:
        """A dot for every obstacle that the scene states."""
        stones = stated_obstacles(self.terrain)
        if stones:
            at = np.array([self.pixels(*o.pose.position[:2]) for o in stones])
            self.paper.dots(at, 2.6 if len(at) < 200 else 1.6, INK, rim=PAPER, within=self.box)

    def _shown(self, mark: Mark) -> bool:
        column, row = self.pixels(mark.x, mark.y)
        return self.box[0] <= column <= self.box[2] and self.box[1] <= row <= self.box[3]


def _area(mark: Mark) -> float:
    return 0.0 if mark.outline is None else float(np.prod(np.ptp(mark.outline, axis=0)))


def paint_gaps(pixels: Bytes, raster: Raster) -> None:
    """Hatch what has no height (grey) and what was interpolated over a hole of the base (violet), in place."""
    if raster.filled is not None:
        hatch(pixels, raster.filled, FILLED_LINE, spacing=9)
    if raster.hole is not None:
        hatch(pixels, raster.hole, NO_DATA_LINE, NO_DATA)


def gap_entries(sheet: MapSheet) -> None:
    """Rows of the legend for :func:`paint_gaps`."""
    if sheet.samples.filled is not None:
        sheet.entry("interpolated over a hole of the base", hatched=FILLED_LINE)
    if sheet.samples.hole is not None:
        sheet.entry("no height", color=NO_DATA, hatched=NO_DATA_LINE)
