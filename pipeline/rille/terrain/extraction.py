"""Extraction of a region: of a scene, evaluated on the region's own points, or of a stored terrain, interpolated between its heights."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Obstacle, Terrain
from rille.model.grid import bilinear
from rille.terrain.composition import Composition
from rille.terrain.grid import Grid, Window
from rille.terrain.region import (
    MapFrame,
    Region,
    ResampledSurface,
    grid_of,
    make_region,
    moved_population,
    own_points,
    terrain_of_region,
)
from rille.terrain.register import landforms
from rille.terrain.scene import Scene, composed, filled_on, rock_bodies, terrain_of
from rille.terrain.surface import IN_MEMORY, evaluate, evaluate_aside

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]


def extract_from_scene(
    scene: Path,
    *,
    name: str | None = None,
    progress: Progress | None = None,
    tell: Callable[[str], None] | None = None,
    **where: Any,
) -> Terrain:
    """Evaluate a region of a scene at its own points: base and landforms there, not interpolated from the scene's grid.

    Parameters
    ----------
    name : of the terrain; None: that of the scene. where : as of :func:`rille.terrain.region.make_region`.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    with composed(scene, progress=progress, tell=tell) as (read, composition, store, datums):
        grid = composition.grid
        region = make_region(grid, MapFrame(origin=read.ground.map_origin[:2]), **where)
        solid = bool(read.page.obstacle) or any(sheet.collide is not None for sheet in read.page.population)
        whole: Any = _Shape(grid)
        if solid or region.grid == grid:
            whole = evaluate(composition, store, datums, progress)
        shift = own_points(grid, region.grid)
        asked = composition if shift is None else _Cut(composition, grid, shift)
        heights = whole if region.grid == grid else evaluate_aside(asked, region.grid, progress)  # type: ignore[arg-type]
        holes = read.ground.holes
        read = replace(read, ground=replace(read.ground, holes=None))  # marks are asked for where they are wanted
        filled = filled_on(region.grid, holes)
        piece = terrain_of_region(terrain_of(read, whole), region, heights, register=read.register, name=name, filled=filled)
        return piece if shift is not None else replace(piece, obstacles=_on_own_ground(piece, read, region.grid, heights))


def extract_from_terrain(terrain: Terrain, *, name: str | None = None, **where: Any) -> Terrain:
    """A region of a stored terrain: its own heights where points coincide, else bilinear between them, as the solver sees them.

    Parameters
    ----------
    terrain : its heights may stay in their database. name, where : as of :func:`extract_from_scene`.

    Raises
    ------
    InputRefused : for a region that cannot be.
    """
    region = make_region(grid_of(terrain), MapFrame(origin=terrain.map_origin[:2], heading=terrain.map_heading), **where)
    surface = ResampledSurface(terrain, region.grid)
    heights = surface[:, :] if region.grid.n_rows * region.grid.n_cols <= IN_MEMORY else surface
    return terrain_of_region(terrain, region, heights, register=landforms(), name=name, filled=_marks(terrain, region))


def _on_own_ground(piece: Terrain, scene: Scene, grid: Grid, heights: Any) -> tuple[Obstacle, ...]:
    """Obstacles of a region whose points are not the scene's: its rocks have their bodies made anew on its own heights.

    Between points the ground is bilinear, so that other points give the flank of a rock another shape: centimetres where it is as large
    as a few postings, which no shift makes good. Rocks that reach beyond the region keep the scene's body.
    """

    def at(x: Array, y: Array) -> Array:
        return bilinear(heights, (grid.x_west, grid.y_north), (grid.posting_x, grid.posting_y), x, y)

    anew = {body.name: body for body in rock_bodies(scene, [moved_population(p, grid) for p in scene.populations], at)}
    return tuple(anew.get(obstacle.name, obstacle) for obstacle in piece.obstacles)


def _marks(terrain: Terrain, region: Region) -> NDArray[np.bool_] | None:
    """Points of a region whose height depends on one that was filled."""
    if terrain.filled is None:
        return None
    surface = ResampledSurface(replace(terrain, heights=terrain.filled), region.grid)
    marks = np.empty(region.grid.shape, bool)
    for window in region.grid.tiles(512):
        marks[window.slices] = surface[window.slices] > 0
    return marks if marks.any() else None


class _Cut:
    """A composition asked for points of its scene's grid by a grid that begins elsewhere: the same bytes as the scene's."""

    def __init__(self, composition: Composition, grid: Grid, shift: tuple[int, int]) -> None:
        self._composition, self._grid, self._shift, self.base = composition, grid, shift, self

    def _there(self, window: Window) -> Window:
        row, column = self._shift
        return Window(row0=window.row0 + row, row1=window.row1 + row, col0=window.col0 + column, col1=window.col1 + column)

    def window(self, grid: Grid, window: Window) -> NDArray[np.float64]:
        """Heights of the base."""
        return self._composition.base.window(self._grid, self._there(window))

    def render(self, grid: Grid, window: Window, *, base: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Heights of the scene."""
        return self._composition.render(self._grid, self._there(window), base=base)


class _Shape:
    """Heights of a scene that nobody asks for."""

    def __init__(self, grid: Grid) -> None:
        self.shape = grid.shape

    def __getitem__(self, window: tuple[slice, slice]) -> NDArray[np.float64]:
        """No height is known."""
        rows, columns = (range(*s.indices(n)) for s, n in zip(window, self.shape, strict=True))
        return np.full((len(rows), len(columns)), np.nan)
