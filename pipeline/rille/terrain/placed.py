"""One landform placed on the ground, and how it meets what lies below it."""

import hashlib
import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import LandformInstance, Population
from rille.terrain.grid import Grid, Window, cosine_sine
from rille.terrain.landform import Landform, border_weight

Array = NDArray[np.float64]

RING = 64  # points around an outline at which the ground below is asked for
FINEST = 2.0**30  # parts of a cell to which positions are taken on a grid: decimal numbers of metres are no whole cells otherwise


@dataclass(frozen=True, slots=True, kw_only=True)
class Datum:
    """Plane z + gx (x - x0) + gy (y - y0) [m] in W around the landform's origin: what its height zero stands on."""

    z: float = 0.0
    gx: float = 0.0
    gy: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """A landform at its place. datum : ground that it replaces, covers or stands on; landforms that add need none."""

    instance: LandformInstance
    landform: Landform
    datum: Datum = Datum()

    @property
    def half(self) -> tuple[float, float]:
        """Half lengths [m] of its footprint along its own axes."""
        half_x, half_y = self.landform.footprint(self.instance.drivers)
        return half_x * self.instance.scale, half_y * self.instance.scale

    @property
    def needs_datum(self) -> bool:
        """True if it does more than add to the ground."""
        return self.landform.blend != "add"

    @property
    def digest(self) -> str:
        """Changes when what it does to the ground changes; its name does not."""
        i = self.instance
        facts = (
            i.landform,
            self.landform.digest,
            i.x,
            i.y,
            i.heading,
            i.scale,
            sorted(i.drivers.items()),
            self.datum.z,
            self.datum.gx,
            self.datum.gy,
        )
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()

    def window(self, grid: Grid) -> Window:
        """The values of a grid that it may change."""
        return grid.around(self.instance.x, self.instance.y, *self.half, self.instance.heading)

    def ring(self) -> tuple[Array, Array]:
        """Points (n,) in W [m] along its outline, evenly spaced, where the ground below is asked for its datum."""
        corners = self.outline()
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.hypot(*sides.T)
        along = (np.arange(RING) / RING) * lengths.sum()
        k = np.clip(np.searchsorted(np.cumsum(lengths), along, side="right"), 0, len(corners) - 1)
        share = (along - (np.cumsum(lengths) - lengths)[k]) / np.where(lengths[k] > 0, lengths[k], 1.0)
        points = corners[k] + share[:, None] * sides[k]
        return points[:, 0], points[:, 1]

    def stand(self, heights: Array) -> Datum:
        """Its datum on the ground of these heights (n,) at :meth:`ring`; heights that are missing do not count.

        ``max`` stands level on the lowest of them, so that nothing floats; ``replace`` and ``drape`` lie on the plane that fits best,
        or level on its middle.
        """
        known = np.isfinite(heights)
        if not known.any():
            return Datum()
        if self.landform.blend == "max":
            return Datum(z=float(heights[known].min()))
        x, y = (v[known] for v in self.ring())
        columns = np.column_stack([np.ones_like(x), x - self.instance.x, y - self.instance.y])
        z, gx, gy = (float(v) for v in np.linalg.lstsq(columns, heights[known], rcond=None)[0])
        return Datum(z=z) if self.landform.level else Datum(z=z, gx=gx, gy=gy)

    def stamp(self, heights: Array, grid: Grid, window: Window) -> None:
        """Change ``heights`` of a window of a grid, in place.

        Coordinates are formed relative to the landform, so a shift by whole cells gives the same bytes, and so does any tiling. Its
        place on the grid is rounded to 2^-30 of a cell: 1.1 m is not 11 times 0.1 m, and a vertical face would jump by a cell.
        """
        mine = self.window(grid).meet(window)
        if mine.empty:
            return
        column, row = (round(float(v) * FINEST) / FINEST for v in grid.index(self.instance.x, self.instance.y))
        dx = (np.arange(mine.col0, mine.col1, dtype=np.float64) - column)[None, :] * grid.posting_x
        dy = (row - np.arange(mine.row0, mine.row1, dtype=np.float64))[:, None] * grid.posting_y
        part = heights[mine.row0 - window.row0 : mine.row1 - window.row0, mine.col0 - window.col0 : mine.col1 - window.col0]
        part[:] = self._on(part, dx, dy, self.instance.heading - grid.heading, grid.heading)

    def at(self, heights: Array, x: Array, y: Array) -> Array:
        """Heights (n,) [m] at points of W after it was placed on these."""
        return self._on(heights, x - self.instance.x, y - self.instance.y, self.instance.heading, 0.0)

    def _on(self, ground: Array, dx: Array, dy: Array, turn: float, frame: float) -> Array:
        """The ground with the landform on it. dx, dy [m] from its origin, in axes turned by ``frame`` against W."""
        cosine, sine = cosine_sine(turn)
        scale, drivers = self.instance.scale, self.instance.drivers
        x, y = (cosine * dx + sine * dy) / scale, (cosine * dy - sine * dx) / scale
        half_x, half_y = self.landform.footprint(drivers)
        inside = (np.abs(x) <= half_x) & (np.abs(y) <= half_y)
        profile = np.where(inside, scale * self.landform.profile(x, y, drivers), 0.0)
        blend = self.landform.blend
        if blend == "add":
            return ground + profile
        if blend == "max":
            return np.where(inside & (profile > 0), np.maximum(ground, self.datum.z + profile), ground)
        c, s = cosine_sine(frame)
        plane = self.datum.z + self.datum.gx * (c * dx - s * dy) + self.datum.gy * (s * dx + c * dy)
        fade = self.landform.weight
        weight = border_weight(x, y, half_x, half_y) if fade is None else fade(x, y, drivers)
        weight = np.where(inside, weight, 0.0)
        above = plane + profile - ground
        return ground + weight * (np.maximum(above, 0.0) if blend == "drape" else above)

    def children(self) -> list[Population]:
        """What is scattered with it, as populations in W."""
        if self.landform.children is None:
            return []
        found = []
        for k, scattered in enumerate(self.landform.children(self.instance.drivers)):
            x, y = self._to_scene(self.instance.scale * scattered.x, self.instance.scale * scattered.y)
            found.append(
                Population(
                    name=f"{self.instance.name}.{k + 1}",
                    landform=scattered.landform,
                    x=x,
                    y=y,
                    heading=scattered.heading + self.instance.heading,
                    drivers=scattered.drivers,
                    scale=self.instance.scale,
                    law={"with": self.instance.name},
                )
            )
        return found

    def footprint(self) -> Array:
        """Corners (4, 2) [m] in W of the box outside of which it changes nothing."""
        half_x, half_y = self.half
        return np.column_stack(self._to_scene(half_x * np.array([-1, 1, 1, -1]), half_y * np.array([-1, -1, 1, 1])))

    def outline(self) -> Array:
        """Corners (n, 2) [m] in W of the region that takes its soil."""
        corners = self.landform.border(self.instance.drivers) * self.instance.scale
        return np.column_stack(self._to_scene(corners[:, 0], corners[:, 1]))

    def _to_scene(self, x: Array, y: Array) -> tuple[Array, Array]:
        cosine, sine = cosine_sine(self.instance.heading)
        return self.instance.x + cosine * x - sine * y, self.instance.y + sine * x + cosine * y
