"""Scene files (TOML) -> Terrain: a base, landforms one after the other, soils."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rille import __version__
from rille.model import (
    InputRefused,
    LandformInstance,
    Material,
    MaterialPair,
    Soil,
    SoilPatch,
    SourceFile,
    Terrain,
    nearest_names,
)
from rille.model.quantity import to_si
from rille.model.sheet import Sheet, expand, read_sheet, source_of
from rille.terrain import base as ground
from rille.terrain.dem import read_dem, relative_to_data
from rille.terrain.obstacle import ObstacleSheet, place_obstacle
from rille.terrain.register import SoilSheet, landforms, soils

Array = NDArray[np.float64]
Number = float | int | str
Pair = list[Number]

MOST_HEIGHTS = 100_000_000  # a scene is evaluated at once, in memory


def pair(default: Pair | None = None):
    """Field of exactly two numbers."""
    return Field(default, min_length=2, max_length=2) if default is not None else Field(min_length=2, max_length=2)


class BaseSheet(Sheet):
    """[base]: the ground before landforms.

    size, center, posting : extent [m] and middle in W, distance of neighbouring heights.
    dem : file in a projection in metres; ``origin`` is the map point (east, north) that becomes the origin of W, default the middle.
    """

    kind: Literal["flat", "plane", "fractal", "dem"]
    size: Pair | None = Field(None, min_length=2, max_length=2)
    center: Pair = pair([0.0, 0.0])
    posting: Number | None = None
    slope: Number = 0.0
    direction: Number = 0.0
    hurst: float = Field(0.8, gt=0, lt=1)
    median_slope: Number = "2 deg"
    seed: int = 0
    file: str | None = None
    origin: Pair | None = Field(None, min_length=2, max_length=2)
    fill_holes: bool = False


class LandformSheet(Sheet):
    """[[landform]]: a registered landform, placed."""

    name: str = Field(min_length=1)
    landform: str
    x: Number
    y: Number
    heading: Number = 0.0
    drivers: dict[str, Number] = {}


class PatchSheet(Sheet):
    """[[soil_patch]]: a polygon with its own soil."""

    name: str = Field(min_length=1)
    soil: str
    polygon: list[Pair] = Field(min_length=3)


class PairSheet(Sheet):
    """[[pair]]: response of two materials, or of wheels on a soil; what is left out means any."""

    response: Literal["rigid", "bekker", "bekker_wong", "reece"]
    material: str | None = None
    other_material: str | None = None
    soil: str | None = None
    friction: float | None = Field(None, ge=0)
    restitution: float | None = Field(None, ge=0, le=1)


class MaterialSheet(Sheet):
    """[[material]]: what obstacles are made of."""

    name: str = Field(min_length=1)
    density: Number = "2700 kg/m^3"
    source: str = ""


class SceneSheet(Sheet):
    """The whole scene."""

    name: str = Field(min_length=1)
    soil: str
    response: Literal["bekker", "bekker_wong", "reece"] = "bekker_wong"
    base: BaseSheet
    landform: list[LandformSheet] = []
    soil_patch: list[PatchSheet] = []
    soils: list[SoilSheet] = []
    material: list[MaterialSheet] = []
    pair: list[PairSheet] = []
    obstacle: list[ObstacleSheet] = []


def build(scene: Path, *, progress: Callable[[str, float], None] | None = None) -> Terrain:
    """Evaluate a scene.

    Parameters
    ----------
    scene : path of the TOML file.
    progress : called with what is being done and the fraction done.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    say = progress or (lambda what, fraction: None)
    scene = Path(scene)
    page = read_sheet(scene, SceneSheet)
    known = soils() | {sheet.name: sheet.value() for sheet in page.soils}
    say("making the base", 0.0)
    terrain = _base(page, scene, known)
    heights = terrain.heights.copy()
    placed = []
    names = [sheet.name for sheet in page.landform]
    for count, sheet in enumerate(page.landform):
        say(f"placing {sheet.name}", 0.3 + 0.7 * count / len(page.landform))
        if names.count(sheet.name) > 1:
            raise InputRefused(f"the scene has {names.count(sheet.name)} landforms called '{sheet.name}'; give each its own name")
        instance = _instance(sheet)
        stamp(heights, terrain, instance)
        placed.append(instance)
    say("done", 1.0)
    patches = tuple(_patch(sheet, known) for sheet in page.soil_patch)
    used = list(dict.fromkeys([page.soil, *(patch.soil for patch in patches)]))
    for count, sheet in enumerate(page.obstacle):
        if any(other.name == sheet.name for other in page.obstacle[:count]):
            raise InputRefused(f"the scene has two obstacles called '{sheet.name}'; give each its own name")
    shaped = _with(terrain, heights=heights)
    return Terrain(
        **{
            name: getattr(terrain, name)
            for name in ("name", "posting_x", "posting_y", "x_west", "y_north", "soil", "crs", "map_origin", "source", "sources")
        },
        heights=heights,
        soils=tuple(known[name] for name in used),
        pairs=(*(MaterialPair(response=page.response, soil=name) for name in used), *(_pair(sheet, used) for sheet in page.pair)),
        obstacles=tuple(place_obstacle(sheet, shaped) for sheet in page.obstacle),
        materials=tuple(
            Material(name=m.name, density=to_si(m.density, "density", f"density of '{m.name}'"), provenance="stated", source=m.source)
            for m in page.material
        ),
        patches=patches,
        landforms=tuple(placed),
    )


def _pair(sheet: PairSheet, used: list[str]) -> MaterialPair:
    if sheet.soil is not None:
        if sheet.soil not in used:
            raise InputRefused(f"a pair names the soil '{sheet.soil}', which the scene does not use; {nearest_names(sheet.soil, used)}")
    elif sheet.response != "rigid":
        raise InputRefused(f"a pair with response '{sheet.response}' needs a soil; rigid pairs need none")
    if sheet.response == "rigid" and sheet.friction is None:
        raise InputRefused("a rigid pair needs its friction, for example friction = 0.6")
    return MaterialPair(**sheet.model_dump())


def _soil(name: str, known: dict[str, Soil], subject: str) -> str:
    if name not in known:
        raise InputRefused(f"{subject} names the soil '{name}', which neither the library nor the scene has; {nearest_names(name, known)}")
    return name


def _patch(sheet: PatchSheet, known: dict[str, Soil]) -> SoilPatch:
    subject = f"soil patch '{sheet.name}'"
    corners = tuple((to_si(x, "length", f"polygon of {subject}"), to_si(y, "length", f"polygon of {subject}")) for x, y in sheet.polygon)
    return SoilPatch(name=sheet.name, soil=_soil(sheet.soil, known, subject), polygon=corners)


def _instance(sheet: LandformSheet) -> LandformInstance:
    subject = f"landform '{sheet.name}'"
    register = landforms()
    if sheet.landform not in register:
        raise InputRefused(f"{subject} is a '{sheet.landform}', which is not registered; {nearest_names(sheet.landform, register)}")
    return LandformInstance(
        name=sheet.name,
        landform=sheet.landform,
        x=to_si(sheet.x, "length", f"x of {subject}"),
        y=to_si(sheet.y, "length", f"y of {subject}"),
        heading=to_si(sheet.heading, "angle", f"heading of {subject}"),
        drivers=register[sheet.landform].values(dict(sheet.drivers), subject),
    )


def stamp(heights: Array, terrain: Terrain, instance: LandformInstance) -> None:
    """Evaluate one landform into ``heights``, in place, within its footprint only.

    Grid coordinates are formed relative to the landform, so a shift by whole cells gives the same bytes.
    """
    landform = landforms()[instance.landform]
    reach = landform.footprint(instance.drivers)
    n_rows, n_cols = heights.shape
    column = (instance.x - terrain.x_west) / terrain.posting_x
    row = (terrain.y_north - instance.y) / terrain.posting_y
    j0, j1 = (
        int(np.clip(v, 0, n_cols)) for v in (np.ceil(column - reach / terrain.posting_x), np.floor(column + reach / terrain.posting_x) + 1)
    )
    i0, i1 = (int(np.clip(v, 0, n_rows)) for v in (np.ceil(row - reach / terrain.posting_y), np.floor(row + reach / terrain.posting_y) + 1))
    if j0 >= j1 or i0 >= i1:
        return
    dx = (np.arange(j0, j1) - column)[None, :] * terrain.posting_x
    dy = (row - np.arange(i0, i1))[:, None] * terrain.posting_y
    cosine, sine = np.cos(instance.heading), np.sin(instance.heading)
    x, y = cosine * dx + sine * dy, cosine * dy - sine * dx
    profile = landform.profile(x, y, instance.drivers)
    inside = np.hypot(dx, dy) <= reach
    window = heights[i0:i1, j0:j1]
    if landform.blend == "add":
        window += np.where(inside, profile, 0.0)
    elif landform.blend == "max":
        np.maximum(window, np.where(inside, profile, -np.inf), out=window)
    else:
        window[inside] = profile[inside]


def _base(page: SceneSheet, scene: Path, known: dict[str, Soil]) -> Terrain:
    sheet = page.base
    soil = _soil(page.soil, known, f"scene '{page.name}'")
    sources = (source_of(scene, f"terrain {page.name}", f"rille {__version__}"),)
    if sheet.kind == "dem":
        return _measured(page, scene, soil, sources)
    if sheet.size is None or sheet.posting is None:
        raise InputRefused(f"base of scene '{page.name}' is {sheet.kind} and needs `size` and `posting`")
    width, height = (to_si(v, "length", "size of the base") for v in sheet.size)
    east, north = (to_si(v, "length", "center of the base") for v in sheet.center)
    posting = to_si(sheet.posting, "length", "posting of the base")
    shape = _shape(width, height, posting, posting)
    x, y = _axes(shape, (posting, posting), (east - (shape[1] - 1) / 2 * posting, north + (shape[0] - 1) / 2 * posting))
    if sheet.kind == "fractal":
        heights = ground.fractal(shape, posting, sheet.hurst, to_si(sheet.median_slope, "angle", "median_slope of the base"), sheet.seed)
    else:
        slope = to_si(sheet.slope, "angle", "slope of the base") if sheet.kind == "plane" else 0.0
        heights = ground.plane(x, y, slope, to_si(sheet.direction, "angle", "direction of the base"))
    return Terrain(
        name=page.name,
        heights=heights,
        posting_x=posting,
        posting_y=posting,
        x_west=float(x[0]),
        y_north=float(y[0]),
        soil=soil,
        soils=(),
        pairs=(),
        source=f"synthetic: {sheet.kind}" + (f", seed {sheet.seed}" if sheet.kind == "fractal" else ""),
        sources=sources,
    )


def _axes(shape: tuple[int, int], posting: tuple[float, float], corner: tuple[float, float]) -> tuple[Array, Array]:
    """Coordinates of columns (n_cols,) and rows (n_rows,), descending, from the north-west value."""
    x = np.arange(shape[1], dtype=np.float64) * posting[0] + corner[0]
    y = corner[1] - np.arange(shape[0], dtype=np.float64) * posting[1]
    return np.asarray(x, np.float64), np.asarray(y, np.float64)


def _shape(width: float, height: float, posting_x: float, posting_y: float) -> tuple[int, int]:
    if posting_x <= 0 or posting_y <= 0 or width < posting_x or height < posting_y:
        raise InputRefused(f"the base measures {width:g} m x {height:g} m at a posting of {posting_x:g} m; it must hold at least one cell")
    shape = round(height / posting_y) + 1, round(width / posting_x) + 1
    if shape[0] * shape[1] > MOST_HEIGHTS:
        raise InputRefused(
            f"the base would have {shape[0]} x {shape[1]} heights, more than {MOST_HEIGHTS:.0e}; take a larger posting or a smaller size"
        )
    return shape


def _measured(page: SceneSheet, scene: Path, soil: str, sources: tuple[SourceFile, ...]) -> Terrain:
    """A measured DEM, cut to the region and, where a posting is given, resampled bilinearly."""
    sheet = page.base
    if sheet.file is None:
        raise InputRefused(f"base of scene '{page.name}' is a dem and needs `file`")
    path = expand(sheet.file, scene.parent)
    dem = read_dem(path)
    n_rows, n_cols = dem.heights.shape
    if sheet.origin is None:
        east = dem.x_west + dem.posting_x * ((n_cols - 1) // 2)
        north = dem.y_north - dem.posting_y * ((n_rows - 1) // 2)
    else:
        east, north = (to_si(v, "length", "origin of the base") for v in sheet.origin)
    whole = Terrain(
        name=page.name,
        heights=_filled(dem.heights, sheet.fill_holes, path),
        posting_x=dem.posting_x,
        posting_y=dem.posting_y,
        x_west=dem.x_west - east,
        y_north=dem.y_north - north,
        soil=soil,
        soils=(),
        pairs=(),
        crs=dem.crs,
        map_origin=(east, north, 0.0),
        source=relative_to_data(path),
        sources=(*sources, source_of(path, f"terrain {page.name}", f"rille {__version__}")),
    )
    region = _region(whole, sheet)
    center = region.heights[(region.heights.shape[0] - 1) // 2, (region.heights.shape[1] - 1) // 2]
    zero = float(np.round(center if np.isfinite(center) else np.nanmean(region.heights)))
    return _with(region, heights=region.heights - zero, map_origin=(east, north, zero))


def _with(terrain: Terrain, **changes: object) -> Terrain:
    from dataclasses import replace

    return replace(terrain, **changes)  # type: ignore[arg-type]


def _filled(heights: Array, fill: bool, path: Path) -> Array:
    holes = np.isnan(heights)
    if not holes.any():
        return heights
    if not fill:
        row, column = np.argwhere(holes)[0]
        raise InputRefused(
            f"'{path}' has {int(holes.sum())} heights missing, the first at row {row}, column {column}; choose a region without, or set "
            "fill_holes = true to interpolate them"
        )
    if holes.all():
        raise InputRefused(f"'{path}' has no height at all")
    from rasterio.fill import fillnodata

    return fillnodata(np.where(holes, 0.0, heights), mask=(~holes).astype(np.uint8), max_search_distance=float(max(heights.shape)))


def _region(whole: Terrain, sheet: BaseSheet) -> Terrain:
    from rille.terrain.dem import height_at

    if sheet.size is None and sheet.posting is None:
        return whole
    n_rows, n_cols = whole.heights.shape
    width, height = (n_cols - 1) * whole.posting_x, (n_rows - 1) * whole.posting_y
    center = [whole.x_west + width / 2, whole.y_north - height / 2]
    if sheet.size is not None:
        width, height = (to_si(v, "length", "size of the base") for v in sheet.size)
        center = [to_si(v, "length", "center of the base") for v in sheet.center]
    posting_x, posting_y = whole.posting_x, whole.posting_y
    if sheet.posting is not None:
        posting_x = posting_y = to_si(sheet.posting, "length", "posting of the base")
    shape = _shape(width, height, posting_x, posting_y)
    x_west, y_north = center[0] - (shape[1] - 1) * posting_x / 2, center[1] + (shape[0] - 1) * posting_y / 2
    if sheet.posting is None:  # keep the DEM's own values: move the region onto its grid
        x_west = whole.x_west + round((x_west - whole.x_west) / posting_x) * posting_x
        y_north = whole.y_north - round((whole.y_north - y_north) / posting_y) * posting_y
        j, i = round((x_west - whole.x_west) / posting_x), round((whole.y_north - y_north) / posting_y)
        if i < 0 or j < 0 or i + shape[0] > n_rows or j + shape[1] > n_cols:
            raise _outside(whole)
        heights = whole.heights[i : i + shape[0], j : j + shape[1]]
    else:
        x, y = _axes(shape, (posting_x, posting_y), (x_west, y_north))
        heights = height_at(whole, x[None, :], y[:, None])
        if np.isnan(heights).any():
            raise _outside(whole)
    return _with(whole, heights=heights, posting_x=posting_x, posting_y=posting_y, x_west=x_west, y_north=y_north)


def _outside(whole: Terrain) -> InputRefused:
    n_rows, n_cols = whole.heights.shape
    return InputRefused(
        f"the region reaches beyond the DEM, which spans x {whole.x_west:.1f} to {whole.x_west + (n_cols - 1) * whole.posting_x:.1f} m "
        f"and y {whole.y_north - (n_rows - 1) * whole.posting_y:.1f} to {whole.y_north:.1f} m around its origin; change center or size"
    )
