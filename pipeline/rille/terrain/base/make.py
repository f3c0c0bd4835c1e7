"""[base] -> Ground."""

import hashlib
import math
from pathlib import Path

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.terrain.base.fractal import fractal_lattice
from rille.terrain.base.ground import Ground, Progress, grid_shape
from rille.terrain.base.lattice import Lattice, Lazy, Surface
from rille.terrain.base.measured import measured
from rille.terrain.base.plane import Plane
from rille.terrain.base.sheet import BaseSheet
from rille.terrain.grid import Grid, place_of

FORM = "fractal 1"  # changes when the same sheet gives other heights
EXTENT = ("kind", "size", "center", "posting")
KEYS = {  # that a base of each kind heeds
    "flat": EXTENT,
    "plane": (*EXTENT, "slope", "direction"),
    "fractal": (*EXTENT, "hurst", "median_slope", "seed"),
    "dem": (*EXTENT, "file", "band", "origin", "fill_holes", "values", "detail"),
}
STEEPEST = math.radians(89) * (1 + 1e-12)  # of a plane; a wall has no height over the ground


def make_base(sheet: BaseSheet, scene_file: Path, progress: Progress) -> Ground:
    """The base of a scene.

    Parameters
    ----------
    scene_file : paths in the sheet are relative to its folder. progress : called with what is being done and the fraction done.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    _require_used(sheet)
    if sheet.kind == "dem":
        return measured(sheet, scene_file, progress)
    grid = _grid(sheet)
    if sheet.kind == "fractal":
        return _fractal(sheet, grid)
    slope = to_si(sheet.slope, "angle", "slope of the base") if sheet.kind == "plane" else 0.0
    if abs(slope) > STEEPEST:
        raise InputRefused(f"the slope of the base is {math.degrees(slope):g} deg; it must lie between -89 and 89 deg")
    return Ground(
        base=Plane(slope=slope, direction=to_si(sheet.direction, "angle", "direction of the base")),
        grid=grid,
        source=f"synthetic: {sheet.kind}",
    )


def _require_used(sheet: BaseSheet) -> None:
    """Refuse what a base of this kind does not heed: a slope of what is flat is a mistake."""
    if sheet.detail is not None and sheet.kind != "dem":
        raise InputRefused(f"the base is {sheet.kind} and has no resolution that [base.detail] could go below; remove it or take a dem")
    for key in sorted(sheet.model_fields_set - set(KEYS[sheet.kind])):
        kinds = " or ".join(f'"{kind}"' for kind, keys in KEYS.items() if key in keys)
        raise InputRefused(
            f"the base is {sheet.kind} and does not heed `{key}`, which belongs to kind = {kinds}; remove it or change the kind"
        )


def _grid(sheet: BaseSheet) -> Grid:
    if sheet.size is None or sheet.posting is None:
        raise InputRefused(f"the base is {sheet.kind} and needs `size` and `posting`")
    width, height = (to_si(v, "length", "size of the base") for v in sheet.size)
    east, north = (place_of(v, "center of the base") for v in sheet.center)
    posting = to_si(sheet.posting, "length", "posting of the base")
    n_rows, n_cols = grid_shape(width, height, posting, posting)
    return Grid(
        n_rows=n_rows,
        n_cols=n_cols,
        posting_x=posting,
        posting_y=posting,
        x_west=east - (n_cols - 1) / 2 * posting,
        y_north=north + (n_rows - 1) / 2 * posting,
    )


def _fractal(sheet: BaseSheet, grid: Grid) -> Ground:
    slope = to_si(sheet.median_slope, "angle", "median_slope of the base")
    if not 0 <= slope < math.pi / 2:
        raise InputRefused(f"the median_slope of the base is {math.degrees(slope):g} deg; it must lie between 0 and 90 deg")

    def make() -> Lattice:
        return fractal_lattice(grid.shape, grid.posting_x, sheet.hurst, slope, sheet.seed)

    surface = Surface(
        lattice=Lazy(rows=(0, grid.n_rows), cols=(0, grid.n_cols), make=make),
        corner=(grid.x_west, grid.y_north),
        posting=(grid.posting_x, grid.posting_y),
        digest=hashlib.sha256(f"{FORM} {grid!r} {sheet.hurst!r} {slope!r} {sheet.seed}".encode()).hexdigest(),
    )
    return Ground(base=surface, grid=grid, source=f"synthetic: fractal, seed {sheet.seed}")
