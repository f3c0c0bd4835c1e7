"""Ground as a recipe: a base, and what lies on it in the order of age. Any window of any grid can be evaluated by itself."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.model.grid import bilinear
from rille.terrain.base import Base
from rille.terrain.crowd import Crowd
from rille.terrain.grid import Grid, Window
from rille.terrain.landform import Landform
from rille.terrain.placed import Datum, Placed

Array = NDArray[np.float64]
Item = Placed | Crowd


class Heights(Protocol):
    """Heights (n_rows, n_cols) [m], read by two slices."""

    def __getitem__(self, key: tuple[slice, slice], /) -> Array:
        """Values of rows and columns."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Composition:
    """The ground of a scene. grid : its own grid. items : oldest first; every landform stands on its datum already."""

    grid: Grid
    base: Base
    items: tuple[Item, ...] = ()

    def render(self, grid: Grid, window: Window, *, base: Array | None = None) -> Array:
        """Heights [m], of the window's shape. A pure function: tiles hold the same bytes as the whole.

        base : heights of the base there, where they are known already; they are not changed.
        """
        heights = np.array(self.base.window(grid, window) if base is None else base, np.float64, order="C")
        for item in self.items:
            item.stamp(heights, grid, window)
        return heights

    def at(self, x: Array, y: Array) -> Array:
        """Heights (n,) [m] at points (n,) of W, evaluated there and not interpolated."""
        return _at(self.base, self.items, np.asarray(x, np.float64), np.asarray(y, np.float64))


def compose(
    grid: Grid,
    base: Base,
    items: Iterable[Item],
    register: dict[str, Landform],
    known: dict[str, Datum] | None = None,
    kept: Heights | None = None,
) -> tuple[Composition, dict[str, Datum]]:
    """Put items (oldest first) on a base: what is scattered with a landform follows it, and each finds its datum on what lies below.

    Parameters
    ----------
    known : datums of an earlier composition by what they depended on, so that the ground is not asked again.
    kept : heights of the base on the grid, where they are known already.

    Returns
    -------
    The composition, and the datums to be passed next time.
    """
    done: list[Item] = []
    datums: dict[str, Datum] = {}
    for item in items:
        if isinstance(item, Placed):
            if item.needs_datum:
                key = _context(grid, base, done, item)
                datum = (known or {}).get(key)
                item = replace(item, datum=item.stand(_ground(grid, base, kept, done, *item.ring())) if datum is None else datum)
                datums[key] = item.datum
            done.append(item)
            done += [Crowd(population=p, landform=register[p.landform]) for p in item.children()]
        else:
            done.append(item)
    return Composition(grid=grid, base=base, items=tuple(done)), datums


def _ground(grid: Grid, base: Base, kept: Heights | None, below: Iterable[Item], x: Array, y: Array) -> Array:
    """Heights (n,) [m] at points, of the base between its values on the grid (so that they may come from where they are kept)."""
    column, row = grid.index(x, y)
    inside = (column >= 0) & (row >= 0) & (column <= grid.n_cols - 1) & (row <= grid.n_rows - 1)
    if not inside.all():
        return _at(base, below, x, y)
    row0, col0 = (min(int(v.min()), n - 2) for v, n in ((row, grid.n_rows), (column, grid.n_cols)))
    window = Window(row0=row0, row1=int(row.max()) + 2, col0=col0, col1=int(column.max()) + 2).meet(grid.whole)
    corner = grid.x_west + col0 * grid.posting_x, grid.y_north - row0 * grid.posting_y
    values = base.window(grid, window) if kept is None else kept[window.slices]
    heights = bilinear(values, corner, (grid.posting_x, grid.posting_y), x, y, clamp=True)
    return _on(below, heights, x, y)


def _at(base: Base, items: Iterable[Item], x: Array, y: Array) -> Array:
    return _on(items, np.array(base.at(x, y), np.float64), x, y)


def _on(items: Iterable[Item], heights: Array, x: Array, y: Array) -> Array:
    for item in items:
        heights = item.at(heights, x, y)
    return heights


def _context(grid: Grid, base: Base, below: list[Item], item: Placed) -> str:
    """What the datum of an item depends on: the base and where its heights stand, the item, and what lies below it at its footprint."""
    x, y = item.ring()
    box = Grid(n_rows=2, n_cols=2, posting_x=float(np.ptp(x)), posting_y=float(np.ptp(y)), x_west=float(x.min()), y_north=float(y.max()))
    reach = [other.digest for other in below if _touches(other, box)]
    return "|".join([repr(grid), base.digest, item.digest, *reach])


def _touches(item: Item, box: Grid) -> bool:
    """True if an item may change the ground within the box of a grid's border."""
    east, south = box.x_west + box.posting_x, box.y_north - box.posting_y
    if isinstance(item, Crowd):
        p, r = item.population, item.reaches
        return bool(((p.x + r >= box.x_west) & (p.x - r <= east) & (p.y + r >= south) & (p.y - r <= box.y_north)).any())
    half = float(np.hypot(*item.half))
    x, y = item.instance.x, item.instance.y
    return x + half >= box.x_west and x - half <= east and y + half >= south and y - half <= box.y_north
