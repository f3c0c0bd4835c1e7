"""Map of soils over the relief."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rille.model import Terrain
from rille.model.polygon import soil_codes, soil_names
from rille.view.obstacles import stated_obstacles
from rille.view.terrain_pictures.map_sheet import MapSheet, counted, extent, gap_entries, paint_gaps, plural, soil_color
from rille.view.terrain_pictures.marks import Mark, draw_labels, place_labels
from rille.view.terrain_pictures.paper import INK
from rille.view.terrain_pictures.raster import blend, contour_interval, lit, rgb, sample

OUTLINE = "#22303c"


def draw_soil(terrain: Terrain, path: Path, *, marks: Sequence[Mark] = ()) -> dict[str, float]:
    """Draw the map into a PNG.

    Returns
    -------
    Share of the area [-] of every soil, by counting pixels.
    """
    samples = sample(terrain)
    names = soil_names(terrain.soil, terrain.patches)
    low, high = samples.limits
    subtitle = f"{plural(len(names), 'soil')} on {extent(terrain)}"
    sheet = MapSheet(terrain, samples, f"{terrain.name}: soils", subtitle, counted(terrain))
    codes = soil_codes(terrain.soil, terrain.patches, *sheet.centers())
    colors = np.array([rgb(soil_color(terrain, name)) for name in names], float)
    pale = np.round(0.62 * colors + 0.38 * 255).astype(np.uint8)
    pixels = lit(pale[codes], sheet.raster.light(), strength=0.75)
    if high - low > 1e-6:
        blend(pixels, INK, 0.25 * sheet.raster.contours(contour_interval(low, high), 0.9))
    paint_gaps(pixels, sheet.raster)
    sheet.lay(pixels)
    shares = {name: float(np.mean(codes == k)) for k, name in enumerate(names)}
    for patch in terrain.patches:
        corners = np.array(patch.polygon)
        sheet.paper.lines([sheet.pixels(*corners[np.r_[: len(corners), 0]].T)], soil_color(terrain, patch.soil), 1.8, within=sheet.box)
    sheet.outlines(marks, OUTLINE)
    sheet.obstacles()
    middles = [(p.name, tuple(sheet.pixels(*np.mean(p.polygon, axis=0)))) for p in terrain.patches]
    inside = [(n, at) for n, at in middles if sheet.box[0] < at[0] < sheet.box[2] and sheet.box[1] < at[1] < sheet.box[3]]
    labels, _ = place_labels(sheet.paper, inside, sheet.box)
    draw_labels(sheet.paper, labels)
    sheet.frame()
    sheet.heading("soil, share of the area")
    known = {soil.name: soil for soil in terrain.soils}
    for name, share in shares.items():
        sheet.entry(
            f"{name}: {100 * share:.1f} %" if share >= 5e-4 or share == 0 else f"{name}: below 0.1 %", color=soil_color(terrain, name)
        )
        if name in known:
            sheet.panel_y -= 5
            sheet.note(
                f"friction {np.degrees(known[name].friction_angle):.0f}\u00b0, cohesion {known[name].cohesion:.3g} Pa, "
                f"{known[name].density:.0f} kg/m\u00b3"
            )
    sheet.panel_y += 6
    if marks:
        sheet.entry("placed landform", line=OUTLINE, width=1.4)
    if stated_obstacles(terrain):
        sheet.entry("obstacle", dot=INK)
    gap_entries(sheet)
    sheet.compass()
    sheet.paper.save(path)
    return shares
