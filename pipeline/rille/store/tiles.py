"""Layers of a terrain as tiles with levels of detail: written and read piece by piece, in bounded memory.

Level k holds every 2^k-th value of rows and columns 0, 2^k, ...: points stay points, nothing is averaged. Tiles of the layers ``soil``
and ``filled`` that hold nothing but the default are left out.
"""

import sqlite3
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.store.database import address, insert

TILE = 256  # rows and columns of a tile: a small edit rewrites little
DTYPES = {"float32": "<f4", "float64": "<f8", "uint8": "u1", "int32": "<i4"}

Values = NDArray[Any]
Source = Callable[[slice, slice], Values]
Slices = tuple[slice, slice]


def level_shape(shape: tuple[int, int], level: int) -> tuple[int, int]:
    """Rows and columns of a level of detail."""
    step = 1 << level
    return -(-shape[0] // step), -(-shape[1] // step)


def level_count(shape: tuple[int, int]) -> int:
    """Number of levels, such that the coarsest fits into one tile."""
    level = 0
    while max(level_shape(shape, level)) > TILE:
        level += 1
    return level + 1


def write_tiles(
    connection: sqlite3.Connection,
    key: int,
    layer: str,
    shape: tuple[int, int],
    source: Source,
    *,
    default: float,
    dtype: str,
    windows: Sequence[Slices] | None = None,
    progress: Callable[[float], None] | None = None,
) -> int:
    """Write the tiles of a layer, all levels; with ``windows`` only those that hold a value inside one of them.

    Parameters
    ----------
    key : of the terrain. shape : of the whole grid. source : (rows, columns) -> values of that window.
    default : what tiles that are left out stand for (NaN: none is left out).

    Returns
    -------
    How many tiles were written or removed.
    """
    touched = 0
    steps = [slice(0, shape[0]), slice(0, shape[1])]
    asked = [(steps[0], steps[1])] if windows is None else list(windows)
    for level in range(level_count(shape)):
        rows, columns = level_shape(shape, level)
        places = _places(rows, columns, level, asked)
        read = source if level == 0 else _coarser(connection, key, layer, level, default, dtype)
        for count, (row0, col0) in enumerate(places):
            values = read(slice(row0, min(row0 + TILE, rows)), slice(col0, min(col0 + TILE, columns)))
            _put(connection, (key, layer, level, row0, col0), values, default, dtype)
            touched += 1
            if progress is not None and level == 0:
                progress((count + 1) / len(places))
    return touched


def _places(rows: int, columns: int, level: int, windows: Sequence[Slices]) -> list[tuple[int, int]]:
    """First rows and columns of the tiles of a level that hold a value of one of the windows (of level 0)."""
    step = 1 << level
    found = set()
    for window in windows:
        (r0, r1), (c0, c1) = ((-(-s.start // step), -(-s.stop // step)) for s in window)  # values k with start <= k step < stop
        r1, c1 = min(r1, rows), min(c1, columns)
        if r0 >= r1 or c0 >= c1:
            continue
        found |= {(i * TILE, j * TILE) for i in range(r0 // TILE, (r1 - 1) // TILE + 1) for j in range(c0 // TILE, (c1 - 1) // TILE + 1)}
    return sorted(found)


def _put(connection: sqlite3.Connection, place: tuple[int, str, int, int, int], values: Values, default: float, dtype: str) -> None:
    names = ("terrain_id", "layer", "level", "row0", "col0")
    connection.execute(f"DELETE FROM terrain_tile WHERE {' AND '.join(f'{n} = ?' for n in names)}", place)
    if default == default and (values == default).all():
        return
    row = dict(zip(names, place, strict=True)) | {
        "n_rows": values.shape[0],
        "n_cols": values.shape[1],
        "dtype": dtype,
        "data": np.ascontiguousarray(values, DTYPES[dtype]).tobytes(),
    }
    insert(connection, "terrain_tile", f"a tile of layer '{place[1]}'", row)


def _coarser(connection: sqlite3.Connection, key: int, layer: str, level: int, default: float, dtype: str) -> Source:
    """Windows of a level from the tiles, just written, of the level below."""

    def read(rows: slice, columns: slice) -> Values:
        wanted = (slice(2 * rows.start, 2 * rows.stop - 1), slice(2 * columns.start, 2 * columns.stop - 1))
        return read_block(connection, key, layer, level - 1, wanted, (TILE, TILE), default, DTYPES[dtype])[::2, ::2]

    return read


def read_block(
    connection: sqlite3.Connection,
    key: int,
    layer: str,
    level: int,
    window: Slices,
    largest: tuple[int, int],
    default: float,
    dtype: str,
) -> Values:
    """Values of a window of a level; ``largest``: rows and columns that no tile exceeds."""
    (r0, r1), (c0, c1) = ((s.start, s.stop) for s in window)
    values = np.full((r1 - r0, c1 - c0), default, dtype)
    tiles = connection.execute(
        "SELECT row0, col0, n_rows, n_cols, dtype, data FROM terrain_tile WHERE terrain_id = ? AND layer = ? AND level = ? "
        "AND row0 > ? AND row0 < ? AND col0 > ? AND col0 < ?",
        (key, layer, level, r0 - largest[0], r1, c0 - largest[1], c1),
    )
    for row0, col0, n_rows, n_cols, stored, data in tiles:
        tile = np.frombuffer(data, DTYPES[stored]).reshape(n_rows, n_cols)
        top, bottom, left, right = max(r0, row0), min(r1, row0 + n_rows), max(c0, col0), min(c1, col0 + n_cols)
        if top < bottom and left < right:
            values[top - r0 : bottom - r0, left - c0 : right - c0] = tile[top - row0 : bottom - row0, left - col0 : right - col0]
    return values


class StoredLayer:
    """A layer of a terrain that stays in the database: ``.shape``, and ``layer[r0:r1, c0:c1]`` reads that window.

    level : of detail; one that the database does not hold is thinned out from the finest that it does.
    """

    def __init__(self, path: Path, key: int, layer: str, shape: tuple[int, int], *, level: int = 0, default: float = np.nan) -> None:
        self._path, self._key, self._layer, self._default = Path(path), key, layer, default
        self._dtype = "<f8" if layer == "height" else "<i4"
        with closing(self._open()) as connection:
            where = "FROM terrain_tile WHERE terrain_id = ? AND layer = ?"
            held = connection.execute("SELECT max(level) FROM terrain_tile WHERE terrain_id = ?", (key,)).fetchone()[0] or 0
            self._level = min(level, held)
            largest = connection.execute(f"SELECT max(n_rows), max(n_cols) {where} AND level = ?", (key, layer, self._level)).fetchone()
        self._largest = (largest[0] or 1, largest[1] or 1)
        self._thin = 1 << (level - self._level)
        self._held_shape = level_shape(shape, self._level)
        self.shape = level_shape(shape, level)
        self.dtype = np.dtype(self._dtype)

    def _open(self) -> sqlite3.Connection:
        return sqlite3.connect(address(self._path), uri=True)

    def __getitem__(self, window: Slices) -> Values:
        """Values of rows r0 <= i < r1 and columns c0 <= j < c1 of its level."""
        (r0, r1, _), (c0, c1, _) = (s.indices(n) for s, n in zip(window, self.shape, strict=True))
        if r1 <= r0 or c1 <= c0:
            return np.empty((max(r1 - r0, 0), max(c1 - c0, 0)), self._dtype)
        thin = self._thin
        wanted = (slice(r0 * thin, (r1 - 1) * thin + 1), slice(c0 * thin, (c1 - 1) * thin + 1))
        try:
            with closing(self._open()) as connection:
                block = read_block(connection, self._key, self._layer, self._level, wanted, self._largest, self._default, self._dtype)
        except sqlite3.Error as error:
            raise InputRefused(f"'{self._path}' cannot be read: {error}; was it moved or replaced meanwhile?") from error
        return np.ascontiguousarray(block[::thin, ::thin])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Values:
        """Everything at once, for code that handles small terrains."""
        return np.asarray(self[:, :], dtype)
