"""A terrain as triangles, in strips: a vertex at every height, two triangles in every cell whose four corners have heights."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Terrain
from rille.terrain.delivery.strips import Progress, strips

Array = NDArray[np.float64]

MOST_POINTS = 16_000_000  # of a mesh: 32 million triangles, 1.6 GB of STL


def require_size(terrain: Terrain, kind: str) -> None:
    """Refuse a mesh that no program would open, rather than thinning it out unasked.

    Raises
    ------
    InputRefused : with a posting that would do.
    """
    n_rows, n_cols = terrain.heights.shape
    if n_rows * n_cols > MOST_POINTS:
        share = (n_rows * n_cols / MOST_POINTS) ** 0.5
        raise InputRefused(
            f"the {kind} of terrain '{terrain.name}' would have {n_rows * n_cols} vertices, more than {MOST_POINTS}; extract a smaller "
            f"region, or with a larger posting, for example --posting {max(terrain.posting_x, terrain.posting_y) * share * 1.01:.3g}"
        )


def vertices(terrain: Terrain, what: str, progress: Progress | None = None) -> Iterator[Array]:
    """Vertices (n, 3) [m] in W, row by row from the north, those of missing heights left out."""
    x = terrain.x_west + np.arange(terrain.heights.shape[1], dtype=np.float64) * terrain.posting_x
    for row0, z in strips(terrain, what, progress):
        y = terrain.y_north - np.arange(row0, row0 + len(z), dtype=np.float64) * terrain.posting_y
        points = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), z], axis=-1).reshape(-1, 3)
        yield points[np.isfinite(points[:, 2])]


def triangles(terrain: Terrain, what: str, progress: Progress | None = None) -> Iterator[NDArray[np.int64]]:
    """Triangles (n, 3) of vertex numbers from 0, counter-clockwise from above; cells are split from north-west to south-east."""
    above = np.empty((0, terrain.heights.shape[1]), np.int64)
    count = 0
    for _, z in strips(terrain, what, progress):
        known = np.isfinite(z)
        number = np.where(known, count + np.cumsum(known.ravel()).reshape(z.shape) - 1, -1)
        count += int(np.count_nonzero(known))
        rows = np.concatenate([above, number])
        above = number[-1:]
        nw, ne, sw, se = rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]
        full = np.minimum.reduce([nw, ne, sw, se]) >= 0
        cells = np.stack([nw[full], sw[full], se[full], nw[full], se[full], ne[full]], axis=-1)
        yield cells.reshape(-1, 3)
