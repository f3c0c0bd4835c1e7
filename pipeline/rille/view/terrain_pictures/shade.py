"""The map of a terrain: relief under light, tinted by height, with contours, landforms, soils and obstacles."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.view.obstacles import stated_obstacles
from rille.view.terrain_pictures.map_sheet import MapSheet, counted, extent, gap_entries, paint_gaps, plural, soil_color
from rille.view.terrain_pictures.marks import OUTLINE, Label, Mark, overlap
from rille.view.terrain_pictures.paper import INK, number
from rille.view.terrain_pictures.raster import Raster, blend, contour_interval, lit, ramp, sample

HEIGHT_COLORS = ramp(("#566b80", "#788a93", "#9fa39a", "#c0b59b", "#d9ccb1", "#efe9dc"))
CONTOUR = "#3d342a"


def draw_shade(terrain: Terrain, path: Path, *, marks: Sequence[Mark] = ()) -> None:
    """Draw the map into a PNG.

    Parameters
    ----------
    terrain : its heights may lie in a file; they are decimated while they are read. marks : placed landforms.

    Raises
    ------
    InputRefused : if the terrain has no height.
    """
    samples = sample(terrain)
    low, high = samples.limits
    interval = contour_interval(low, high)
    size = f"{extent(terrain)} at {posting(terrain)}, heights {low:.2f} to {high:.2f} m"
    sheet = MapSheet(terrain, samples, terrain.name, size.replace("-", "\u2212"), counted(terrain))
    raster = sheet.raster
    pixels = lit(HEIGHT_COLORS[height_index(raster, low, high)], raster.light())
    relief = high - low > 1e-6
    if relief:
        thin, thick = raster.contours(interval, 0.9), raster.contours(5 * interval, 1.7)
        blend(pixels, CONTOUR, np.maximum(0.42 * thin, 0.75 * thick))
    paint_gaps(pixels, raster)
    sheet.lay(pixels)
    labels, lost = sheet.place(marks)
    sheet.patches()
    sheet.outlines(marks)
    sheet.obstacles()
    if relief:
        label_contours(sheet, 5 * interval, low, high, labels)
    sheet.name(labels)
    sheet.frame()
    sheet.color_bar("height [m]", HEIGHT_COLORS, low, high, min(250, 0.42 * (sheet.panel_end - sheet.box[1])))
    if relief:
        sheet.entry(f"contours every {interval:g} m, bold every {5 * interval:g} m", line=CONTOUR)
    if marks:
        text = "placed landform: outline, heading" + (f" ({plural(lost, 'name')} left out)" if lost else "")
        sheet.entry(text, line=OUTLINE, width=1.4)
    for soil in dict.fromkeys(patch.soil for patch in terrain.patches):
        sheet.entry(f"soil {soil}", line=soil_color(terrain, soil), width=2.0, dash=True)
    if stated_obstacles(terrain):
        sheet.entry("obstacle", dot=INK)
    gap_entries(sheet)
    sheet.compass()
    sheet.paper.save(path)


def posting(terrain: Terrain) -> str:
    """The posting in words."""
    if math.isclose(terrain.posting_x, terrain.posting_y, rel_tol=1e-9):
        return f"{terrain.posting_x:.4g} m"
    return f"{terrain.posting_x:.4g} m \u00d7 {terrain.posting_y:.4g} m"


def height_index(raster: Raster, low: float, high: float) -> NDArray[np.uint8]:
    """Index (rows, columns) into 256 colours from ``low`` to ``high`` [m]."""
    factor = np.float32(255 / max(high - low, 1e-6))
    return np.clip((raster.z + np.float32(raster.samples.level - low)) * factor, 0, 255).astype(np.uint8)


def label_contours(sheet: MapSheet, step: float, low: float, high: float, labels: Sequence[Label]) -> None:
    """Write the heights of contours on them, where they run straightest, along them and clear of names."""
    z, level = sheet.raster.z, sheet.samples.level
    rows, columns = z.shape
    taken = [label.box for label in labels]
    for k in range(math.ceil(low / step), math.floor(high / step) + 1):
        above = z[::2, ::2] > k * step - level
        i, j = np.nonzero(above[:, 1:] != above[:, :-1])
        i, j = 2 * i, 2 * j + 1
        kept = (i > 34) & (i < rows - 34) & (j > 34) & (j < columns - 34)
        i, j = i[kept], j[kept]
        if len(i) == 0:
            continue
        pick = np.linspace(0, len(i) - 1, min(len(i), 160)).astype(int)
        i, j = i[pick], j[pick]
        gy, gx = (z[i + 3, j] - z[i - 3, j]) / 6, (z[i, j + 3] - z[i, j - 3]) / 6
        steep = np.hypot(gx, gy) + 1e-9
        along = np.stack([-gy, gx]) / steep
        off = np.zeros(len(i))
        for reach in (-24, -12, 0, 12, 24):  # how far the line is from straight [pixels]
            there = z[np.rint(i + reach * along[1]).astype(int), np.rint(j + reach * along[0]).astype(int)]
            off = np.maximum(off, np.abs(there - (k * step - level)) / steep)
        written: list[tuple[int, int]] = []
        for best in np.argsort(off, kind="stable"):
            if off[best] > 9 or len(written) == 3:
                break
            x, y = int(sheet.box[0] + j[best]), int(sheet.box[1] + i[best])
            box = (x - 20, y - 20, x + 20, y + 20)
            if any(overlap(box, other) for other in taken) or any(math.hypot(x - a, y - b) < 260 for a, b in written):
                continue
            angle = math.degrees(math.atan2(-along[1][best], along[0][best]))
            angle = angle - 180 if angle > 90 else angle + 180 if angle <= -90 else angle
            sheet.paper.turned((x, y), number(k * step, step), angle, color=CONTOUR, halo="#efe8da")
            taken.append(box)
            written.append((x, y))
