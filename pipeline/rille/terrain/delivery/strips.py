"""A terrain in strips of rows, so that no more than a few of them are in memory; and what a reader of its files must know."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Terrain

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

VALUES = 4_000_000  # of a strip, about
BLOCK = 512  # rows of a strip are a multiple of it: the tiles of rasters


def strips(terrain: Terrain, what: str, progress: Progress | None = None, *, reverse: bool = False) -> Iterator[tuple[int, Array]]:
    """(first row, heights [m] in W of some rows) from north to south, or from south to north with the rows of each in that order, too."""
    n_rows, n_cols = terrain.heights.shape
    step = BLOCK * max(1, VALUES // (BLOCK * n_cols))
    starts = range(0, n_rows, step)
    for count, row0 in enumerate(reversed(starts) if reverse else starts):
        block = np.asarray(terrain.heights[row0 : min(row0 + step, n_rows), 0:n_cols], np.float64)
        yield row0, block[::-1] if reverse else block
        if progress is not None:
            progress(what, (count + 1) / len(starts))


@dataclass(frozen=True, slots=True, kw_only=True)
class Relief:
    """low, high : [m] in W. missing : how many heights there are not."""

    low: float
    high: float
    missing: int


def relief(terrain: Terrain) -> Relief:
    """Lowest and highest height.

    Raises
    ------
    InputRefused : if there is no height at all.
    """
    low, high, missing = math.inf, -math.inf, 0
    for _, block in strips(terrain, ""):
        known = np.isfinite(block)
        missing += int(block.size - np.count_nonzero(known))
        if known.any():
            low, high = min(low, float(block[known].min())), max(high, float(block[known].max()))
    if low > high:
        raise InputRefused(f"terrain '{terrain.name}' has no height at all; choose another region")
    return Relief(low=low, high=high, missing=missing)


def facts(terrain: Terrain, **more: Any) -> dict[str, Any]:
    """What a reader of a file without georeference must know, for its sidecar."""
    n_rows, n_cols = terrain.heights.shape
    return {
        "terrain": terrain.name,
        "rows": n_rows,
        "columns": n_cols,
        "posting_m": {"x": terrain.posting_x, "y": terrain.posting_y},
        "points": "values are heights at points, not of cells; n values bound n - 1 cells",
        "row_order": "row 0 is the northernmost (largest y), column 0 the westernmost (smallest x)",
        "x_of_column_0_m": terrain.x_west,
        "y_of_row_0_m": terrain.y_north,
        "heights": "z in W [m], upwards; map height = z + map_origin z",
        "crs": terrain.crs,
        "map_origin_m": {"east": terrain.map_origin[0], "north": terrain.map_origin[1], "z": terrain.map_origin[2]},
        "map_heading_rad": terrain.map_heading,
        "map": "east = origin east + cos(heading) x - sin(heading) y, north = origin north + sin(heading) x + cos(heading) y",
        "source": terrain.source,
        **more,
    }


def require_whole(terrain: Terrain, found: Relief, what: str) -> None:
    """Refuse missing heights for a format that has no way to say so."""
    if found.missing:
        raise InputRefused(
            f"terrain '{terrain.name}' lacks {found.missing} heights, which {what} cannot express; take a region without holes, a box "
            "instead of a polygon, or set fill_holes = true in the scene"
        )
