"""A target region of a scene: a box or a polygon, perhaps turned, at any posting, with a frame of its own."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, LandformInstance, Obstacle, Population, Pose, SoilPatch, Terrain
from rille.model.grid import bilinear
from rille.model.polygon import inside_polygon
from rille.model.rotation import from_rpy, matrix_of, quaternion
from rille.terrain.grid import Grid, Window
from rille.terrain.landform import Landform
from rille.terrain.placed import Placed

Array = NDArray[np.float64]
Point = tuple[float, float]

MOST_POINTS = 10_000_000_000  # of a region
AROUND = 16  # points around an obstacle at which it meets the ground
BORDER = 1e-6  # [postings] points so close to the border of a polygon belong to it


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFrame:
    """Where W lies on the map: (E, N) = origin + R(heading) (x, y) [m], heading [rad]."""

    origin: Point = (0.0, 0.0)
    heading: float = 0.0

    def to_map(self, x: Array | float, y: Array | float) -> tuple[Array, Array]:
        """Easting and northing [m] of points of W."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        return np.asarray(self.origin[0] + c * x - s * y), np.asarray(self.origin[1] + s * x + c * y)

    def from_map(self, east: float, north: float) -> Point:
        """Point of W [m] at an easting and northing."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        dx, dy = east - self.origin[0], north - self.origin[1]
        return c * dx + s * dy, c * dy - s * dx


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """Points that are asked for. grid : of the region, with its own frame W'. outline : corners (n, 2) [m] in W'; None: all points."""

    grid: Grid
    outline: Array | None = None

    def inside(self, window: Window) -> NDArray[np.bool_]:
        """Which values of a window belong to the region; those on the border do."""
        if self.outline is None:
            return np.ones(window.shape, bool)
        return inside_polygon(self.outline, *self.grid.axes(window))


def make_region(
    scene: Grid,
    frame: MapFrame | None = None,
    *,
    box: tuple[float, float, float, float] | None = None,
    center: Point | None = None,
    size: Point | None = None,
    polygon: Sequence[Point] | None = None,
    in_map: bool = False,
    heading: float = 0.0,
    posting: Point | None = None,
    origin: Point | None = None,
) -> Region:
    """A region of a scene.

    Without a posting the region takes the scene's; if it is not turned, too, its points are those of the scene that lie in it, so that
    nothing is interpolated. A region that is not turned keeps the scene's frame W; a turned one gets its own, W', with its origin in
    the region's middle, or at ``origin``.

    Parameters
    ----------
    scene : grid of the scene, in W. frame : where W lies on the map.
    box : x, y of one corner and x, y of the opposite one [m]. center, size : of a box [m]; no center: that of the scene.
    polygon : corners [m], closed by themselves. None of them: the whole scene.
    in_map : coordinates are easting and northing, and ``heading`` counts from east; otherwise x and y of W, from x.
    heading : of the region's x [rad], towards y (north). posting : in x and y [m].
    origin : where W' has its origin [m].

    Raises
    ------
    InputRefused : for a region outside the scene (with the scene's extent), an impossible size or posting, too many points, a polygon
        that crosses itself, or a box and a polygon at once.
    """
    frame = frame or MapFrame()
    turn = math.remainder(heading - (frame.heading if in_map else 0.0), math.tau)
    turn = 0.0 if abs(turn) < 1e-15 else turn
    place = frame.from_map if in_map else lambda x, y: (x, y)
    asked = sum((box is not None, size is not None or center is not None, polygon is not None))
    if asked > 1:
        raise InputRefused("the region is given twice; give a box, or a center and a size, or a polygon")
    if center is not None and size is None:
        raise InputRefused("the region has a center but no size; give both")
    posting_x, posting_y = posting or (scene.posting_x, scene.posting_y)
    if not (posting_x > 0 and posting_y > 0 and math.isfinite(posting_x + posting_y)):
        raise InputRefused(f"the posting of the region is {posting_x:g} m x {posting_y:g} m; it must be above 0")
    axes = Grid(n_rows=2, n_cols=2, posting_x=1, posting_y=1, x_west=0, y_north=0, heading=turn)  # parallel to W', origin of W
    corners = _corners(scene, axes, place, box, center, size, polygon, turn)
    outline = None if polygon is None else corners
    _require_inside(scene, frame, axes, corners, in_map)
    (west, south), (east, north) = corners.min(axis=0), corners.max(axis=0)
    same = turn == 0.0 and (posting_x, posting_y) == (scene.posting_x, scene.posting_y)
    x_west, n_cols = _along(west, east, posting_x, scene.x_west if same else None)
    depth, n_rows = _along(-north, -south, posting_y, -scene.y_north if same else None)
    y_north = -depth
    if n_rows < 2 or n_cols < 2:
        raise InputRefused(
            f"the region measures {east - west:g} m x {north - south:g} m, which holds {max(n_cols, 0)} x {max(n_rows, 0)} points "
            f"{posting_x:g} m x {posting_y:g} m apart; at least 2 x 2 are needed, so take a larger region or a smaller posting"
        )
    if n_rows * n_cols > MOST_POINTS:
        raise InputRefused(
            f"the region would have {n_cols} x {n_rows} points, more than {MOST_POINTS:.0e}; take a larger posting or a smaller region"
        )
    middle: Point = (0.0, 0.0)
    zero: Point = (0.0, 0.0)
    if origin is not None:
        middle = place(*origin)
        zero = _pair(axes.from_scene(*middle))
    elif turn != 0.0:
        zero = (x_west + (n_cols - 1) * posting_x / 2, y_north - (n_rows - 1) * posting_y / 2)
        middle = _pair(axes.to_scene(np.asarray(zero[0]), np.asarray(zero[1])))
    grid = Grid(
        n_rows=n_rows,
        n_cols=n_cols,
        posting_x=posting_x,
        posting_y=posting_y,
        x_west=x_west - zero[0],
        y_north=y_north - zero[1],
        origin=middle,
        heading=turn,
    )
    return Region(grid=grid, outline=None if outline is None else _with_border(outline - zero, min(posting_x, posting_y)))


def _pair(point: tuple[Array, Array]) -> Point:
    return float(point[0]), float(point[1])


def _corners(scene: Grid, axes: Grid, place: Any, box: Any, center: Any, size: Any, polygon: Any, turn: float) -> Array:
    """Corners (n, 2) of what is asked for, in axes parallel to W' around the origin of W."""
    east, south = scene.x_west + (scene.n_cols - 1) * scene.posting_x, scene.y_north - (scene.n_rows - 1) * scene.posting_y
    if polygon is not None:
        points = np.array([place(float(x), float(y)) for x, y in polygon], np.float64).reshape(-1, 2)
        _require_simple(points)
        return np.column_stack(axes.from_scene(points[:, 0], points[:, 1]))
    if size is not None:
        if not (size[0] > 0 and size[1] > 0):
            raise InputRefused(f"the region measures {size[0]:g} m x {size[1]:g} m; both must be above 0")
        at = ((scene.x_west + east) / 2, (scene.y_north + south) / 2) if center is None else place(*center)
        x, y = (float(v) for v in axes.from_scene(*at))
        low, high = (x - size[0] / 2, y - size[1] / 2), (x + size[0] / 2, y + size[1] / 2)
    else:
        if box is None and turn != 0.0:
            raise InputRefused("a turned region needs its extent; give a size (and a center), a box or a polygon")
        first, second = ((scene.x_west, south), (east, scene.y_north)) if box is None else (place(*box[:2]), place(*box[2:]))
        ends = np.array([[float(v) for v in axes.from_scene(*p)] for p in (first, second)])
        low, high = ends.min(axis=0), ends.max(axis=0)
    return np.array([(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])], np.float64)


def _along(low: float, high: float, posting: float, zero: float | None) -> tuple[float, int]:
    """First coordinate and number of points between two bounds; ``zero``: where points of the scene stand, None: centred."""
    if zero is not None:
        first, last = math.ceil((low - zero) / posting - BORDER), math.floor((high - zero) / posting + BORDER)
        return zero + first * posting, last - first + 1
    count = math.floor((high - low) / posting + BORDER) + 1
    return float((low + high) / 2 - (count - 1) * posting / 2), count


def _require_inside(scene: Grid, frame: MapFrame, axes: Grid, corners: Array, in_map: bool) -> None:
    east, south = scene.x_west + (scene.n_cols - 1) * scene.posting_x, scene.y_north - (scene.n_rows - 1) * scene.posting_y
    x, y = axes.to_scene(corners[:, 0], corners[:, 1])
    tolerance = BORDER * min(scene.posting_x, scene.posting_y)
    beyond = np.maximum.reduce([scene.x_west - x, x - east, south - y, y - scene.y_north])
    if (beyond <= tolerance).all():
        return
    k = int(np.argmax(beyond))
    if in_map:
        reach = frame.to_map(x[k], y[k])
        ends = frame.to_map(np.array([scene.x_west, east, east, scene.x_west]), np.array([south, south, scene.y_north, scene.y_north]))
        names, spans = ("E", "N"), [(float(v.min()), float(v.max())) for v in ends]
    else:
        reach, names, spans = (x[k], y[k]), ("x", "y"), [(scene.x_west, east), (south, scene.y_north)]
    raise InputRefused(
        f"the region reaches {names[0]} = {reach[0]:.2f} m, {names[1]} = {reach[1]:.2f} m, outside the scene, which spans "
        f"{names[0]} {spans[0][0]:.2f} to {spans[0][1]:.2f} m and {names[1]} {spans[1][0]:.2f} to {spans[1][1]:.2f} m; move or shrink it"
    )


def _require_simple(points: Array) -> None:
    if len(points) < 3:
        raise InputRefused(f"the polygon of the region has {len(points)} corners; it needs at least 3")
    from shapely import Polygon
    from shapely.validation import explain_validity

    shape = Polygon(points)
    if not shape.is_valid or shape.area == 0:
        reason = explain_validity(shape) if not shape.is_valid else "it has no area"
        raise InputRefused(f"the polygon of the region cannot be used ({reason}); give its corners in order around it")


def _with_border(outline: Array, posting: float) -> Array:
    """A polygon grown so little that the points on its border are inside, whatever their rounding."""
    from shapely import Polygon

    grown = Polygon(outline).buffer(BORDER * posting, join_style="mitre")
    return np.array(grown.exterior.coords)[:-1]


def grid_of(terrain: Terrain) -> Grid:
    """The grid of a terrain, in its own frame."""
    n_rows, n_cols = terrain.heights.shape
    return Grid(
        n_rows=n_rows,
        n_cols=n_cols,
        posting_x=terrain.posting_x,
        posting_y=terrain.posting_y,
        x_west=terrain.x_west,
        y_north=terrain.y_north,
    )


def own_points(scene: Grid, grid: Grid) -> tuple[int, int] | None:
    """Row and column of a scene at which a grid begins whose points are all the scene's; None if they are not."""
    column, row = (grid.x_west - scene.x_west) / scene.posting_x, (scene.y_north - grid.y_north) / scene.posting_y
    same = grid.aligned and (grid.posting_x, grid.posting_y) == (scene.posting_x, scene.posting_y)
    if not same or max(abs(column - round(column)), abs(row - round(row))) >= BORDER:
        return None
    first, left = round(row), round(column)
    inside = first >= 0 and left >= 0 and first + grid.n_rows <= scene.n_rows and left + grid.n_cols <= scene.n_cols
    return (first, left) if inside else None


class MaskedSurface:
    """Heights of a region: NaN outside its outline. Only asked for windows, so they may be larger than memory."""

    def __init__(self, heights: Any, region: Region) -> None:
        self._heights, self._region = heights, region
        self.shape = region.grid.shape

    def __getitem__(self, window: tuple[slice, slice]) -> Array:
        """Heights [m] of rows and columns."""
        piece = _window(window, self.shape)
        return np.where(self._region.inside(piece), self._heights[piece.slices], np.nan)


class ResampledSurface:
    """Bilinear heights of a stored terrain on another grid, window by window; its own values where both stand on the same points."""

    def __init__(self, terrain: Terrain, grid: Grid) -> None:
        self._terrain, self._grid = terrain, grid
        self.shape = grid.shape
        self._shift = own_points(grid_of(terrain), grid)

    def __getitem__(self, window: tuple[slice, slice]) -> Array:
        """Heights [m] of rows and columns."""
        piece, terrain = _window(window, self.shape), self._terrain
        if self._shift is not None:
            row, column = self._shift
            return np.array(terrain.heights[piece.row0 + row : piece.row1 + row, piece.col0 + column : piece.col1 + column], np.float64)
        x, y = self._grid.points(piece)
        n_rows, n_cols = terrain.heights.shape
        columns, rows = (x - terrain.x_west) / terrain.posting_x, (terrain.y_north - y) / terrain.posting_y
        return _interpolated(terrain.heights, _onto(rows, n_rows), _onto(columns, n_cols))


def _onto(index: Array, count: int) -> Array:
    """Fractional indices, those beside the border by rounding alone moved onto it."""
    index = np.where(np.abs(index) < BORDER, 0.0, index)
    return np.where(np.abs(index - (count - 1)) < BORDER, count - 1.0, index)


def _window(key: tuple[slice, slice], shape: tuple[int, int]) -> Window:
    (row0, row1, _), (col0, col1, _) = (s.indices(n) for s, n in zip(key, shape, strict=True))
    return Window(row0=row0, row1=max(row1, row0), col0=col0, col1=max(col1, col0))


def masked(heights: Any, region: Region) -> Any:
    """Heights on a region's grid without those outside its outline; an array stays an array."""
    if region.outline is None:
        return heights
    surface = MaskedSurface(heights, region)
    return surface[:, :] if isinstance(heights, np.ndarray) else surface


def terrain_of_region(
    terrain: Terrain,
    region: Region,
    heights: Any,
    *,
    register: Mapping[str, Landform],
    name: str | None = None,
    filled: Any = None,
) -> Terrain:
    """The terrain of a region in its own frame W': heights on its grid, and whatever of the scene stands or lies in it.

    Soil patches, landforms and obstacles are moved and turned into W', and so is the place of W' on the map. Obstacles keep their shape
    and their depth below the ground: they move up or down by what the ground around them does, which other points change a little.

    Parameters
    ----------
    terrain : the scene, in W. heights : (n_rows, n_cols) [m] on the region's grid, evaluated or resampled.
    register : landforms by name; those whose footprint does not meet the region are left out, those that it does not know are kept.
    name : of the new terrain; None: that of the scene. filled : marks on the region's grid.
    """
    grid = region.grid
    name = name or terrain.name
    patches = tuple(p for p in (_moved_patch(patch, grid) for patch in terrain.patches) if _meets(np.array(p.polygon), grid))
    landforms = tuple(_moved_landform(form, grid) for form in terrain.landforms if _stands_in(form, register.get(form.landform), grid))
    populations = (_members_in(population, register.get(population.landform), grid) for population in terrain.populations)
    used = {terrain.soil, *(p.soil for p in patches), *(form.soil for form in landforms if form.soil)}
    c, s = math.cos(terrain.map_heading), math.sin(terrain.map_heading)
    east, north, zero = terrain.map_origin
    x, y = grid.origin
    moved = replace(
        terrain,
        name=name,
        heights=masked(heights, region),
        posting_x=grid.posting_x,
        posting_y=grid.posting_y,
        x_west=grid.x_west,
        y_north=grid.y_north,
        soils=tuple(soil for soil in terrain.soils if soil.name in used),
        pairs=tuple(pair for pair in terrain.pairs if pair.soil is None or pair.soil in used),
        patches=patches,
        landforms=landforms,
        populations=tuple(moved_population(population, grid) for population in populations),
        obstacles=(),
        map_origin=(east + c * x - s * y, north + s * x + c * y, zero),
        map_heading=terrain.map_heading + grid.heading,
        filled=filled,
        source=terrain.source if name == terrain.name else f"region of {terrain.name}: {terrain.source}".rstrip(": "),
        sources=tuple(replace(source, subject=f"terrain {name}") for source in terrain.sources),
    )
    obstacles = tuple(o for o in (_moved_obstacle(obstacle, terrain, moved, region) for obstacle in terrain.obstacles) if o is not None)
    materials = {o.material for o in obstacles} | {v for p in moved.pairs for v in (p.material, p.other_material)}
    return replace(moved, obstacles=obstacles, materials=tuple(m for m in terrain.materials if m.name in materials))


def _moved_patch(patch: SoilPatch, grid: Grid) -> SoilPatch:
    corners = np.asarray(patch.polygon, np.float64)
    x, y = grid.from_scene(corners[:, 0], corners[:, 1])
    return replace(patch, polygon=tuple(zip(x.tolist(), y.tolist(), strict=True)))


def _meets(corners: Array, grid: Grid) -> bool:
    east, south = grid.x_west + (grid.n_cols - 1) * grid.posting_x, grid.y_north - (grid.n_rows - 1) * grid.posting_y
    (low_x, low_y), (high_x, high_y) = corners.min(axis=0), corners.max(axis=0)
    return bool(high_x >= grid.x_west and low_x <= east and high_y >= south and low_y <= grid.y_north)


def _stands_in(instance: LandformInstance, landform: Landform | None, grid: Grid) -> bool:
    return landform is None or not Placed(instance=instance, landform=landform).window(grid).empty


def _members_in(population: Population, landform: Landform | None, grid: Grid) -> Population:
    """The members whose circle meets the box of the region."""
    if landform is None or landform.radial is None or len(population.x) == 0:
        return population
    a, b = landform.radial.semi_axes(population.drivers)
    reach = population.scale * landform.radial.reach * np.maximum(a, b)
    x, y = grid.from_scene(population.x, population.y)
    east, south = grid.x_west + (grid.n_cols - 1) * grid.posting_x, grid.y_north - (grid.n_rows - 1) * grid.posting_y
    near = (x + reach >= grid.x_west) & (x - reach <= east) & (y + reach >= south) & (y - reach <= grid.y_north)
    return replace(
        population,
        x=population.x[near],
        y=population.y[near],
        heading=population.heading[near],
        drivers={name: values[near] for name, values in population.drivers.items()},
    )


def _moved_landform(landform: LandformInstance, grid: Grid) -> LandformInstance:
    x, y = grid.from_scene(landform.x, landform.y)
    return replace(landform, x=float(x), y=float(y), heading=landform.heading - grid.heading)


def moved_population(population: Population, grid: Grid) -> Population:
    """The population in the frame of a grid."""
    x, y = grid.from_scene(population.x, population.y)
    return replace(population, x=x, y=y, heading=population.heading - grid.heading)


def _moved_obstacle(obstacle: Obstacle, before: Terrain, after: Terrain, region: Region) -> Obstacle | None:
    """The obstacle in W', as deep in the ground as it was; None if it stands outside the region.

    It moves by what the lowest known ground around it does: at its centre there may be the bump that it is itself, which a coarser grid
    does not hold.
    """
    x, y, z = obstacle.pose.position
    around = np.arange(AROUND) * (math.tau / AROUND)
    reach = _reach(obstacle)
    ring_x, ring_y = np.append(x + reach * np.cos(around), x), np.append(y + reach * np.sin(around), y)
    turned_x, turned_y = region.grid.from_scene(ring_x, ring_y)
    old, new = _ground(before, ring_x, ring_y), _ground(after, turned_x, turned_y)
    if math.isnan(new[-1]):
        return None
    known = np.isfinite(old[:-1]) & np.isfinite(new[:-1])
    shift = float(new[:-1][known].min() - old[:-1][known].min()) if known.any() else 0.0
    rotation = obstacle.pose.rotation
    if region.grid.heading != 0.0:
        rotation = quaternion(from_rpy(0.0, 0.0, -region.grid.heading) @ matrix_of(rotation))
    return replace(obstacle, pose=Pose(position=(float(turned_x[-1]), float(turned_y[-1]), z + shift), rotation=rotation))


def _reach(obstacle: Obstacle) -> float:
    """Largest horizontal distance of its points from its centre [m]."""
    if obstacle.vertices is not None:
        points = obstacle.vertices @ matrix_of(obstacle.pose.rotation).T
        return float(np.hypot(points[:, 0], points[:, 1]).max())
    if obstacle.kind == "cylinder":
        return math.hypot(obstacle.size[0], obstacle.size[1] / 2)
    return obstacle.size[0] if obstacle.kind == "sphere" else math.hypot(*obstacle.size) / 2


def _ground(terrain: Terrain, x: Array, y: Array) -> Array:
    """Bilinear heights [m] at points (n,), reading only the cells around them; NaN outside."""
    n_rows, n_cols = terrain.heights.shape
    columns = _onto((x - terrain.x_west) / terrain.posting_x, n_cols)
    rows = _onto((terrain.y_north - y) / terrain.posting_y, n_rows)
    return _interpolated(terrain.heights, rows, columns)


def _interpolated(heights: Any, rows: Array, columns: Array) -> Array:
    """Bilinear heights at fractional rows and columns, reading only the window that holds them; NaN outside."""
    n_rows, n_cols = heights.shape
    r0, r1 = (int(np.clip(v, 0, n_rows - 2)) for v in (np.floor(rows.min()), np.floor(rows.max())))
    c0, c1 = (int(np.clip(v, 0, n_cols - 2)) for v in (np.floor(columns.min()), np.floor(columns.max())))
    block = np.asarray(heights[r0 : r1 + 2, c0 : c1 + 2], np.float64)
    return bilinear(block, (float(c0), float(-r0)), (1.0, 1.0), columns, -rows)
