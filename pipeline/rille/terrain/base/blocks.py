"""A lattice that is loaded block by block; the blocks used last are kept."""

from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from rille.terrain.base.lattice import Indices, Range, Stored

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocks:
    """Block (a, b) holds the rows a size <= i < (a + 1) size that the lattice has and the like columns, whatever is asked for.

    rows, cols : first and last + 1. size : values across a block. load : (rows, cols) -> values there. keep : blocks kept.
    """

    rows: Range
    cols: Range
    size: int
    load: Callable[[Range, Range], Array]
    keep: int = 24
    _kept: OrderedDict[tuple[int, int], Stored] = field(default_factory=OrderedDict, repr=False, compare=False)
    _lock: Lock = field(default_factory=Lock, repr=False, compare=False)

    def outer(self, rows: Indices, cols: Indices) -> Array:
        """Values at all pairs of ascending rows and columns."""
        values = np.empty((rows.size, cols.size))
        for a, i in self._groups(rows):
            for b, j in self._groups(cols):
                values[i, j] = self._block(a, b).outer(rows[i], cols[j])
        return values

    def pairs(self, rows: Indices, cols: Indices) -> Array:
        """Values at points."""
        values = np.empty(rows.shape)
        i, j = rows // self.size, cols // self.size
        for a in np.unique(i):
            for b in np.unique(j[i == a]):
                there = (i == a) & (j == b)
                values[there] = self._block(int(a), int(b)).pairs(rows[there], cols[there])
        return values

    def _groups(self, indices: Indices) -> Iterator[tuple[int, slice]]:
        """Blocks that ascending indices fall into, and where in ``indices``."""
        start = 0
        while start < indices.size:
            block = int(indices[start]) // self.size
            end = int(np.searchsorted(indices, (block + 1) * self.size))
            yield block, slice(start, end)
            start = end

    def _block(self, a: int, b: int) -> Stored:
        with self._lock:
            if (a, b) in self._kept:
                self._kept.move_to_end((a, b))
                return self._kept[a, b]
            (i0, i1), (j0, j1) = (
                (max(k * self.size, known[0]), min((k + 1) * self.size, known[1])) for k, known in ((a, self.rows), (b, self.cols))
            )
            block = Stored(self.load((i0, i1), (j0, j1)), i0, j0)
            self._kept[a, b] = block
            if len(self._kept) > self.keep:
                self._kept.popitem(last=False)
            return block
