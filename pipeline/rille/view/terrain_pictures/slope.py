"""Map of slopes in the classes that matter to a rover, and how they are distributed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rille.model import Terrain
from rille.view.obstacles import stated_obstacles
from rille.view.terrain_pictures.map_sheet import PANEL, MapSheet, counted, gap_entries, paint_gaps, plural
from rille.view.terrain_pictures.marks import Mark
from rille.view.terrain_pictures.paper import INK, RULE, SOFT
from rille.view.terrain_pictures.raster import Samples, rgb, sample

EDGES = (0, 5, 10, 15, 20, 25, 30)  # [deg] lower ends of the classes
ROUNDING = 1e-3  # [deg] that heights in single precision make of a plane
CLASS_COLORS = ("#f4f1e1", "#cfe0b0", "#8fc49a", "#f3c25b", "#e8853a", "#c23b3b", "#5e1742")
OUTLINE = "#22303c"


def slope_degrees(samples: Samples) -> np.ndarray:
    """Slope [deg] at every sample, atan |grad z| by central differences over two steps; NaN next to holes."""
    east, north = samples.gradient()
    degrees = np.degrees(np.arctan(np.hypot(east, north)))
    if samples.hole is not None:
        degrees[samples.near_hole()] = np.nan
    return degrees


def draw_slope(terrain: Terrain, path: Path, *, marks: Sequence[Mark] = ()) -> dict[str, float]:
    """Draw the map into a PNG; every pixel has the colour of its class (mean slope of the samples in it).

    Returns
    -------
    Median and 95th percentile of slope [deg], and the baseline over which slopes were taken [m].
    """
    samples = sample(terrain)
    degrees = slope_degrees(samples)
    known = degrees[np.isfinite(degrees)]
    median, steep = (float(v) for v in np.percentile(known, (50, 95))) if known.size else (0.0, 0.0)
    baseline = 2 * max(samples.step_x, samples.step_y)
    subtitle = f"slope over {baseline:.4g} m: median {median:.1f}\u00b0, 95 % of the ground below {steep:.1f}\u00b0"
    sheet = MapSheet(terrain, samples, f"{terrain.name}: slope", subtitle, counted(terrain))
    shown = sheet.raster.scaled(np.nan_to_num(degrees).astype(np.float32))
    table = np.array([rgb(c) for c in CLASS_COLORS], np.uint8)
    pixels = table[_class(shown)]
    paint_gaps(pixels, sheet.raster)
    sheet.lay(pixels)
    labels, lost = sheet.place(marks)
    sheet.outlines(marks, OUTLINE)
    sheet.obstacles()
    sheet.name(labels)
    sheet.frame()
    _classes(sheet, known)
    _histogram(sheet, known, median, steep)
    if marks:
        text = "placed landform: outline, heading" + (f" ({plural(lost, 'name')} left out)" if lost else "")
        sheet.entry(text, line=OUTLINE, width=1.4)
    if stated_obstacles(terrain):
        sheet.entry("obstacle", dot=INK)
    gap_entries(sheet)
    sheet.compass()
    sheet.paper.save(path)
    return {"median_deg": median, "p95_deg": steep, "baseline_m": baseline}


def _class(degrees: np.ndarray) -> np.ndarray:
    """Numbers of the classes of slopes; one that is an edge but for rounding is in the class that begins there."""
    return np.digitize(degrees + ROUNDING, EDGES[1:])


def _classes(sheet: MapSheet, known: np.ndarray) -> None:
    """The classes with their colours and shares of the ground."""
    sheet.heading("slope [\u00b0], share of the ground")
    counts = np.bincount(_class(known), minlength=len(EDGES))
    pen = sheet.paper.pen
    for k, color in enumerate(CLASS_COLORS):
        share = 100 * counts[k] / max(known.size, 1)
        y = sheet.panel_y
        pen.rectangle((sheet.panel_x, y, sheet.panel_x + 24, y + 16), fill=color, outline=INK)
        text = f"{EDGES[k]} to {EDGES[k + 1]}" if k + 1 < len(EDGES) else f"above {EDGES[k]}"
        sheet.paper.text((sheet.panel_x + 34, y + 8), text, size=12, anchor="lm")
        sheet.paper.text((sheet.panel_x + 168, y + 8), f"{share:.1f} %", size=12, anchor="rm")
        sheet.panel_y += 21
    sheet.panel_y += 14


def _histogram(sheet: MapSheet, known: np.ndarray, median: float, steep: float) -> None:
    """Share of the ground by degree, coloured by class, with the median marked."""
    top = float(np.clip(np.ceil(max(steep * 1.5, 6) / 5) * 5, 10, 90))
    bins = np.linspace(0, top, 41)
    counts, _ = np.histogram(known, bins)
    width, height = PANEL - 30.0, 96.0
    x0, y0 = sheet.panel_x, sheet.panel_y + height
    pen = sheet.paper.pen
    for k, count in enumerate(counts):
        color = CLASS_COLORS[int(np.digitize((bins[k] + bins[k + 1]) / 2, EDGES[1:]))]
        left, right = x0 + width * k / 40, x0 + width * (k + 1) / 40
        pen.rectangle((left, y0 - height * count / max(counts.max(), 1), right - 1, y0), fill=color, outline=RULE)
    pen.line((x0, y0, x0 + width, y0), fill=INK)
    step = 5 if top <= 45 else 15
    for value in np.arange(0, top + 1e-9, step):
        at = x0 + width * value / top
        pen.line((at, y0, at, y0 + 4), fill=INK)
        sheet.paper.text((at, y0 + 6), f"{value:.0f}", size=11, anchor="ma")
    at = x0 + width * min(median / top, 1.0)
    sheet.paper.lines([np.array([[at, y0 - height - 4], [at, y0]])], INK, 1.2, dash=(4, 3))
    sheet.paper.text((at + 5, y0 - height - 6), "median", size=11, color=SOFT)
    sheet.panel_y = y0 + 34
