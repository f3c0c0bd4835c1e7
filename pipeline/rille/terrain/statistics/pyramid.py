"""Heights averaged over blocks, read in bounded parts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.terrain.statistics.samples import Surface

Array = NDArray[np.float64]

MOST = 4_000_000  # heights of one level that are searched; of larger levels, tiles
TILE = 1024
STRIP = 4_000_000  # heights read at a time


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Rows row0.. and columns col0.. of a level: means of 2^level x 2^level heights. inner : the tile without its margin, as slices
    into ``heights``, for which the part stands: parts of a level never share one.
    """

    level: int
    row0: int
    col0: int
    heights: Array
    inner: tuple[slice, slice]

    @property
    def share(self) -> int:
        """Number of values for which it stands."""
        rows, cols = self.inner
        return (rows.stop - rows.start) * (cols.stop - cols.start)


def level_shape(surface: Surface, level: int) -> tuple[int, int]:
    """Rows and columns of a level; blocks that are not full are left out."""
    return surface.shape[0] >> level, surface.shape[1] >> level


def tiles(surface: Surface, level: int) -> list[tuple[int, int, int, int]]:
    """row0, row1, col0, col1 of tiles of a level: all of it, or so many spread evenly that they hold MOST values."""
    n_rows, n_cols = level_shape(surface, level)
    every = [(i, min(i + TILE, n_rows), j, min(j + TILE, n_cols)) for i in range(0, n_rows, TILE) for j in range(0, n_cols, TILE)]
    if n_rows * n_cols <= MOST:
        return every
    wanted = max(MOST // TILE**2, 1)
    golden = 0.6180339887498949  # a sequence that spreads evenly however long it is
    chosen = sorted({int(((k + 0.5) * golden % 1.0) * len(every)) for k in range(wanted)})
    return [every[k] for k in chosen]


def read_part(surface: Surface, level: int, tile: tuple[int, int, int, int], margin: int) -> Part:
    """A tile with up to ``margin`` more values on each side."""
    n_rows, n_cols = level_shape(surface, level)
    row0, row1, col0, col1 = tile
    i0, i1, j0, j1 = max(row0 - margin, 0), min(row1 + margin, n_rows), max(col0 - margin, 0), min(col1 + margin, n_cols)
    size = 1 << level
    step = max(STRIP // ((j1 - j0) * size * size), 1)
    strips = []
    for i in range(i0, i1, step):
        end = min(i + step, i1)
        z = np.asarray(surface[i * size : end * size, j0 * size : j1 * size], np.float64)
        strips.append(z if level == 0 else z.reshape(end - i, size, j1 - j0, size).mean(axis=(1, 3)))
    inner = (slice(row0 - i0, row1 - i0), slice(col0 - j0, col1 - j0))
    return Part(level=level, row0=i0, col0=j0, heights=np.concatenate(strips), inner=inner)
