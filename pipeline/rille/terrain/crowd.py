"""A population on the ground: many radial landforms at once."""

import hashlib
import json
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Population
from rille.terrain.grid import Grid, Window
from rille.terrain.landform import Landform, Radial
from rille.terrain.stamping import stamp, stamp_points

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """A population and the landform that it consists of.

    Raises
    ------
    InputRefused : if the landform is not radial, or does more than add to the ground.
    """

    population: Population
    landform: Landform
    reaches: Array = field(init=False, repr=False, compare=False)  # (n,) [m] largest distance from its centre that each may change
    digest: str = field(init=False, compare=False)  # changes when what it does to the ground changes

    def __post_init__(self) -> None:
        """Measure how far each reaches, and sum it up."""
        radial = self.radial
        a, b = radial.semi_axes(self.population.drivers)
        reach = self.population.scale * radial.reach * np.maximum(a, b)
        object.__setattr__(self, "reaches", np.broadcast_to(np.asarray(reach, float), self.population.x.shape))
        p = self.population
        state = hashlib.sha256(json.dumps([p.landform, self.landform.digest, p.scale, self.landform.crowd]).encode())
        for values in (p.x, p.y, p.heading, *(p.drivers[name] for name in sorted(p.drivers))):
            state.update(np.ascontiguousarray(values, np.float64).tobytes())
        object.__setattr__(self, "digest", state.hexdigest())

    @property
    def radial(self) -> Radial:
        """The radial form of its members."""
        if self.landform.radial is None or self.landform.blend != "add":
            raise InputRefused(
                f"population '{self.population.name}' is of '{self.landform.name}', which is not a radial form that adds to the ground; "
                "place it one by one, or take another landform (`rille terrain list`)"
            )
        return self.landform.radial

    def window(self, grid: Grid) -> Window:
        """The values of a grid that it may change; one more on each side, for what rounding puts on the border."""
        if len(self.population.x) == 0:
            return Window(row0=0, row1=0, col0=0, col1=0)
        x, y = grid.from_scene(self.population.x, self.population.y)
        low, high = (x - self.reaches).min(), (x + self.reaches).max()
        south, north = (y - self.reaches).min(), (y + self.reaches).max()
        return Window(
            row0=int(np.clip(np.ceil((grid.y_north - north) / grid.posting_y) - 1, 0, grid.n_rows)),
            row1=int(np.clip(np.floor((grid.y_north - south) / grid.posting_y) + 2, 0, grid.n_rows)),
            col0=int(np.clip(np.ceil((low - grid.x_west) / grid.posting_x) - 1, 0, grid.n_cols)),
            col1=int(np.clip(np.floor((high - grid.x_west) / grid.posting_x) + 2, 0, grid.n_cols)),
        )

    def stamp(self, heights: Array, grid: Grid, window: Window, threads: int = 1) -> None:
        """Change ``heights`` of a window of a grid, in place."""
        stamp(heights, window, grid, self.landform, self.population, threads=threads)

    def at(self, heights: Array, x: Array, y: Array) -> Array:
        """Heights (n,) [m] at points of W after it was placed on these."""
        found = np.array(heights, np.float64)
        stamp_points(found, x, y, self.landform, self.population)
        return found
