"""The ground under the wheels: heights, the plane under a footprint, soils, and the ruts that wheels leave."""

import numpy as np
from numpy.typing import NDArray

from rille.model import PhysicsFailed, Terrain

Array = NDArray[np.float64]


class Ground:
    """Heights and soils of a terrain."""

    def __init__(self, terrain: Terrain) -> None:
        self.terrain = terrain
        self._soils = {soil.name: k for k, soil in enumerate(terrain.soils)}

    def height(self, x: Array, y: Array) -> Array:
        """Bilinear heights [m] at points of any shape.

        Raises
        ------
        PhysicsFailed : outside the terrain or beside a missing height.
        """
        t = self.terrain
        rows, columns = t.heights.shape
        column, row = (x - t.x_west) / t.posting_x, (t.y_north - y) / t.posting_y
        if not ((column >= 0).all() and (row >= 0).all() and (column <= columns - 1).all() and (row <= rows - 1).all()):
            raise PhysicsFailed(f"a wheel left terrain '{t.name}' near x = {np.mean(x):.2f} m, y = {np.mean(y):.2f} m; use a shorter drive")
        j, i = np.minimum(column.astype(int), columns - 2), np.minimum(row.astype(int), rows - 2)
        east, south = column - j, row - i
        h = t.heights
        north_edge = h[i, j] + east * (h[i, j + 1] - h[i, j])
        south_edge = h[i + 1, j] + east * (h[i + 1, j + 1] - h[i + 1, j])
        found = north_edge + south * (south_edge - north_edge)
        if np.isnan(found).any():
            raise PhysicsFailed(f"a wheel met a missing height of terrain '{t.name}' near x = {np.mean(x):.2f} m, y = {np.mean(y):.2f} m")
        return found

    def plane(self, place: Array, heading: Array, half_length: Array, half_width: Array) -> tuple[Array, Array]:
        """Planes under footprints: heights (n,) [m] at their middles and normals (n, 3).

        Through the heights at the four ends of a cross: the slope along either arm is that between its ends, the height their mean.

        place : (n, 2) [m]. heading : (n, 2), unit. half_length, half_width : (n,) [m], half arms of the cross.
        """
        left = np.column_stack([-heading[:, 1], heading[:, 0]])
        along, across = half_length[:, None] * heading, half_width[:, None] * left
        points = np.stack([place + along, place - along, place + across, place - across])
        front, back, port, starboard = self.height(points[..., 0], points[..., 1])
        rise, tilt = 0.5 * (front - back) / half_length, 0.5 * (port - starboard) / half_width
        normal = np.column_stack([-rise[:, None] * heading - tilt[:, None] * left, np.ones(len(place))])
        return 0.25 * (front + back + port + starboard), normal / np.sqrt(1 + rise**2 + tilt**2)[:, None]

    def soil(self, x: float, y: float) -> int:
        """Number of the soil at a place: that of the last patch whose corners go round it (Sunday 2001, winding number), else the base."""
        for patch in reversed(self.terrain.patches):
            east, north = (np.array(patch.polygon) - (x, y)).T
            around = np.arctan2(north, east)
            turned = (np.roll(around, -1) - around + np.pi) % (2 * np.pi) - np.pi
            if abs(turned.sum()) > np.pi:
                return self._soils[patch.soil]
        return self._soils[self.terrain.soil]


class Ruts:
    """Depths of ruts [m]: the largest sinkage that each cell of a square grid met.

    cell : [m]. A wheel marks, and reads, the cells under a line across it, at points half a cell apart.
    """

    def __init__(self, cell: float) -> None:
        self.cell = cell
        self._depth: dict[tuple[int, int], float] = {}

    def _cells(self, place: Array, left: Array, width: float) -> list[tuple[int, int]]:
        n = 2 * int(np.ceil(width / self.cell)) + 1
        points = place + np.linspace(-0.5, 0.5, n)[:, None] * width * left
        return [(int(x), int(y)) for x, y in np.floor(points / self.cell)]

    def mark(self, place: Array, left: Array, width: float, sinkage: float) -> None:
        """A wheel of that width [m] stands at ``place`` (2,) [m], its axle along ``left`` (2,), so deep [m]."""
        for cell in self._cells(place, left, width):
            self._depth[cell] = max(self._depth.get(cell, 0.0), sinkage)

    def depth(self, place: Array, left: Array, width: float) -> float:
        """Mean depth [m] across the path of a wheel; untouched soil counts as 0."""
        return float(np.mean([self._depth.get(cell, 0.0) for cell in self._cells(place, left, width)]))
