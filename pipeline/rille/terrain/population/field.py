"""Where the forms of a population may stand, and how densely."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.terrain.population.density import Density
from rille.terrain.population.zones import Polygon, Zone

Array = NDArray[np.float64]
Extent = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max [m] in W


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """Where forms may stand, and how densely. margin : forms outside the extent that reach in count, too (no region given)."""

    region: Polygon | None
    extent: Extent
    zones: list[Zone]
    clear: bool
    density: Density | None
    margin: bool

    @property
    def box(self) -> Extent:
        """Box around all centres, but for a margin."""
        return self.extent if self.region is None else self.region.box

    @property
    def peak(self) -> float:
        """Largest factor on the law."""
        return 1.0 if self.density is None else self.density.largest

    def sides(self, reach: Array) -> tuple[Array, Array]:
        """Width and height [m] of the box in which forms of that reach are drawn."""
        x0, y0, x1, y1 = self.box
        extra = 2.0 * reach if self.region is None and self.margin else np.zeros_like(reach)
        return x1 - x0 + extra, y1 - y0 + extra

    def place(self, reach: Array, u: Array, v: Array) -> tuple[Array, Array]:
        """Positions [m] by uniform numbers."""
        x0, y0, x1, y1 = self.box
        width, height = self.sides(reach)
        return (x0 + x1) / 2 + (u - 0.5) * width, (y0 + y1) / 2 + (v - 0.5) * height

    def share(self, x: Array, y: Array) -> Array:
        """Factor over the largest one, 0 outside the region: the probability that a form stays, but for zones."""
        keep = np.ones(np.shape(x))
        if self.region is not None:
            keep = np.where(self.region.distance(x, y) <= 0, keep, 0.0)
        if self.density is not None:
            keep = keep * self.density.factor(x, y) / self.density.largest
        return keep

    def free(self, x: Array, y: Array) -> Array:
        """Distance [m] to the nearest zone, infinite without zones."""
        distance = np.full(np.shape(x), np.inf)
        for zone in self.zones:
            distance = np.minimum(distance, zone.distance(x, y))
        return distance

    def stays(self, x: Array, y: Array, reach: Array, u: Array) -> NDArray[np.bool_]:
        """True for forms that stay; u uniform (n,)."""
        return (u < self.share(x, y)) & (self.free(x, y) > (reach if self.clear else 0.0))
