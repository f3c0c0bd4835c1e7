"""Scene files (TOML) -> Terrain: a base, landforms and populations in the order of their age, soils, obstacles."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rille import __version__
from rille.model import (
    InputRefused,
    LandformInstance,
    Material,
    MaterialPair,
    Obstacle,
    Population,
    Soil,
    SoilPatch,
    SourceFile,
    Terrain,
    nearest_names,
)
from rille.model.polygon import is_simple
from rille.model.quantity import to_si
from rille.model.sheet import Sheet, expand, read_sheet, source_of
from rille.terrain.base import BaseSheet, Ground, make_base
from rille.terrain.base.ground import Holes
from rille.terrain.composition import Composition, Item, compose
from rille.terrain.crowd import Crowd
from rille.terrain.dem import height_at
from rille.terrain.grid import Grid, place_of
from rille.terrain.landform import Landform
from rille.terrain.obstacle import ObstacleSheet, place_obstacle
from rille.terrain.placed import Placed
from rille.terrain.population import Frame, PopulationSheet, collision_bodies, draw
from rille.terrain.register import Register, SoilSheet, read_register, soils
from rille.terrain.surface import TILE, Kept, Surface, evaluate, kept
from rille.terrain.unseen import unseen

Array = NDArray[np.float64]
Number = float | int | str
Pair = list[Number]
Progress = Callable[[str, float], None]


def pair():
    """Field of exactly two numbers."""
    return Field(min_length=2, max_length=2)


class LandformSheet(Sheet):
    """[[landform]]: a registered landform, placed.

    scale : enlarges it in all directions. age : the older lie below the younger ("300 Myr", or in all the scene bare numbers of any
    unit); those without lie on top, in the order of the file. soil : of its surface.
    """

    name: str = Field(min_length=1)
    landform: str
    x: Number
    y: Number
    heading: Number = 0.0
    scale: float = Field(1.0, gt=0, le=1000)
    age: Number | None = None
    soil: str = ""
    drivers: dict[str, Number] = {}


class PatchSheet(Sheet):
    """[[soil_patch]]: a polygon with its own soil."""

    name: str = Field(min_length=1)
    soil: str
    polygon: list[Annotated[Pair, pair()]] = Field(min_length=3)


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
    """The whole scene. library : folders of own landforms, relative to the scene."""

    name: str = Field(min_length=1)
    soil: str
    response: Literal["bekker", "bekker_wong", "reece"] = "bekker_wong"
    library: list[str] = []
    base: BaseSheet
    landform: list[LandformSheet] = []
    population: list[PopulationSheet] = []
    soil_patch: list[PatchSheet] = []
    soils: list[SoilSheet] = []
    material: list[MaterialSheet] = []
    pair: list[PairSheet] = []
    obstacle: list[ObstacleSheet] = []


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A scene that was read and checked, before any height is evaluated."""

    page: SceneSheet
    file: SourceFile
    ground: Ground
    register: dict[str, Landform]
    soils: dict[str, Soil]
    instances: tuple[LandformInstance, ...]
    populations: tuple[Population, ...]
    patches: tuple[SoilPatch, ...]
    items: tuple[Item, ...]

    @property
    def unseen(self) -> dict[str, str]:
        """What it places without a trace on its own grid, and why: see :func:`rille.terrain.unseen.unseen`."""
        return unseen(self.ground.grid, self.items, self.patches[len(self.patches) - len(self.page.soil_patch) :])

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences worth telling the user."""
        return (*self.ground.notes, *(f"{subject} {why}" for subject, why in self.unseen.items()))


def build(scene: Path, *, progress: Progress | None = None, tell: Callable[[str], None] | None = None) -> Terrain:
    """Evaluate a scene; of one that was evaluated before, only what changed.

    Parameters
    ----------
    scene : path of the TOML file.
    progress : called with what is being done and the fraction done. tell : called with what the user should know.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    with composed(scene, progress=progress, tell=tell) as (read, composition, store, datums):
        heights = evaluate(composition, store, datums, progress)
        return terrain_of(read, heights)


@contextmanager
def composed(
    scene: Path, *, progress: Progress | None = None, tell: Callable[[str], None] | None = None
) -> Iterator[tuple[Scene, Composition, Kept, dict]]:
    """A scene as a composition that can be evaluated anywhere, what is kept of its last evaluation, and its datums."""
    read = read_scene(scene, progress=progress)
    if tell is not None:
        for note in read.notes:
            tell(note)
    with kept(Path(scene)) as store:
        grid, base = read.ground.grid, read.ground.base
        composition, datums = compose(grid, base, read.items, read.register, store.datums, store.base(base.digest, grid))
        yield read, composition, store, datums


def read_scene(scene: Path, *, progress: Progress | None = None) -> Scene:
    """Read a scene and check everything in it that can be checked without evaluating it.

    Raises
    ------
    InputRefused : with one sentence for whatever cannot be used.
    """
    say = progress or (lambda what, fraction: None)
    scene = Path(scene)
    page = read_sheet(scene, SceneSheet)
    found = read_register(expand(folder, scene.parent) for folder in page.library)
    register = found.landforms
    known = soils() | {sheet.name: sheet.value() for sheet in page.soils}
    _soil(page.soil, known, f"scene '{page.name}'")
    for kind in ("landform", "population", "soil_patch", "obstacle"):
        _distinct([sheet.name for sheet in getattr(page, kind)], kind.replace("_", " "))
    instances = [_instance(sheet, found, known) for sheet in page.landform]
    say("making the base", 0.0)
    ground = make_base(page.base, scene, say)
    frame = Frame(crs=ground.crs, origin=ground.map_origin[:2])
    populations = []
    for count, sheet in enumerate(page.population):
        say(f"drawing {sheet.name}", count / len(page.population))
        populations.append(draw(sheet, _extent(ground.grid), register, placed=instances, frame=frame, folder=scene.parent))
    placed = [Placed(instance=i, landform=register[i.landform]) for i in instances]
    crowds = [Crowd(population=p, landform=register[p.landform]) for p in populations]
    _comparable({f"{kind} '{sheet.name}'": sheet.age for kind in ("population", "landform") for sheet in getattr(page, kind)})
    aged = [
        (_age(sheet.age, f"{kind} '{sheet.name}'"), item)
        for kind, sheets, items in (("population", page.population, crowds), ("landform", page.landform, placed))
        for sheet, item in zip(sheets, items, strict=True)
    ]
    aged.sort(key=lambda pair: -pair[0])
    by_age = [item for _, item in aged if isinstance(item, Placed)]
    return Scene(
        page=page,
        file=source_of(scene, "terrain", f"rille {__version__}"),
        ground=ground,
        register=register,
        soils=known,
        instances=tuple(instances),
        populations=tuple(populations),
        patches=(
            *_bound_patches(by_age, known),
            *(_patch(sheet, known) for sheet in page.soil_patch),
        ),
        items=tuple(item for _, item in aged),
    )


def terrain_of(scene: Scene, heights: Surface) -> Terrain:
    """The evaluated scene: heights on its own grid, soils, obstacles standing on them."""
    page, ground = scene.page, scene.ground
    used = list(dict.fromkeys([page.soil, *(patch.soil for patch in scene.patches)]))
    terrain = Terrain(
        name=page.name,
        heights=heights,  # type: ignore[arg-type]
        posting_x=ground.grid.posting_x,
        posting_y=ground.grid.posting_y,
        x_west=ground.grid.x_west,
        y_north=ground.grid.y_north,
        soil=page.soil,
        soils=tuple(scene.soils[name] for name in used),
        pairs=(*(MaterialPair(response=page.response, soil=name) for name in used), *(_pair(sheet, used) for sheet in page.pair)),
        materials=tuple(
            Material(name=m.name, density=to_si(m.density, "density", f"density of '{m.name}'"), provenance="stated", source=m.source)
            for m in page.material
        ),
        patches=scene.patches,
        landforms=scene.instances,
        populations=scene.populations,
        crs=ground.crs,
        map_origin=ground.map_origin,
        filled=filled_on(ground.grid, ground.holes),
        source=ground.source,
        sources=tuple(replace(file, subject=f"terrain {page.name}") for file in (scene.file, *ground.sources)),
    )
    return replace(terrain, obstacles=obstacles(scene, terrain))


def filled_on(grid: Grid, holes: Holes | None) -> NDArray[np.bool_] | None:
    """Where the base had no height and one was interpolated, at the points of a grid; None: nowhere."""
    if holes is None:
        return None
    filled = np.empty(grid.shape, bool)
    for tile in grid.tiles(TILE):
        filled[tile.slices] = holes(grid, tile)
    return filled


def obstacles(scene: Scene, terrain: Terrain) -> tuple[Obstacle, ...]:
    """Obstacles of the scene and collision bodies of its rocks, standing on a terrain; those beside it are left out."""
    stated = [place_obstacle(sheet, terrain) for sheet in scene.page.obstacle]
    return (*stated, *rock_bodies(scene, scene.populations, lambda x, y: height_at(terrain, x, y)))


def rock_bodies(scene: Scene, populations: Iterable[Population], at: Callable[[Array, Array], Array]) -> list[Obstacle]:
    """Collision bodies of the scene's rocks on its ground.

    Parameters
    ----------
    populations : those of the scene, in any frame. at : (x, y) (n,) [m] in that frame -> heights (n,) [m], NaN where unknown.
    """
    return [
        body
        for sheet, population in zip(scene.page.population, populations, strict=True)
        for body in collision_bodies(sheet, population, scene.register[population.landform], at)
    ]


def _distinct(names: list[str], kind: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise InputRefused(f"the scene has {count} {kind}s called '{name}'; give each its own name")


def _extent(grid: Grid) -> tuple[float, float, float, float]:
    east = grid.x_west + (grid.n_cols - 1) * grid.posting_x
    return grid.x_west, grid.y_north - (grid.n_rows - 1) * grid.posting_y, east, grid.y_north


def _age(age: Number | None, subject: str) -> float:
    """An age to be compared with others of its scene: [s] where it has a unit, a bare number as it is; none is younger than all."""
    if age is None:
        return -np.inf
    try:
        value = float(age) if _bare(age) else to_si(age, "time", "age")
    except InputRefused:
        raise InputRefused(
            f"age of {subject} is '{age}'; it must be a number or a time, for example 3.5 or \"300 Myr\" (the older lie below the younger)"
        ) from None
    if not np.isfinite(value):
        raise InputRefused(f"age of {subject} is {value}; it must be finite")
    return value


def _bare(age: Number) -> bool:
    """Whether an age has no unit."""
    try:
        float(age)
    except ValueError:
        return False
    return True


def _comparable(ages: Mapping[str, Number | None]) -> None:
    """Refuse ages of which some have a unit and some have none: nobody can say which is older. ages : by whose they are."""
    bare = [subject for subject, age in ages.items() if age is not None and _bare(age) and float(age) != 0]
    timed = [subject for subject, age in ages.items() if age is not None and not _bare(age)]
    if bare and timed:
        raise InputRefused(
            f"age of {bare[0]} is {ages[bare[0]]} without a unit, and that of {timed[0]} is '{ages[timed[0]]}'; "
            "give all ages of the scene a unit, or none"
        )


def _bound_patches(placed: list[Placed], known: dict[str, Soil]) -> Iterator[SoilPatch]:
    """Soil bound to landforms: it moves with them. placed : the older come first, as in the heights; later patches lie on top."""
    for item in placed:
        name = item.instance.soil or item.landform.soil
        if name:
            subject = f"landform '{item.instance.name}'"
            corners = tuple((float(x), float(y)) for x, y in item.outline())
            yield SoilPatch(name=item.instance.name, soil=_soil(name, known, subject), polygon=corners)


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
    what = f"polygon of {subject}"
    corners = tuple((place_of(x, what), place_of(y, what)) for x, y in sheet.polygon)
    if not is_simple(corners):
        raise InputRefused(f"the {what} crosses itself or has no area; list its corners in order around it")
    return SoilPatch(name=sheet.name, soil=_soil(sheet.soil, known, subject), polygon=corners)


def _instance(sheet: LandformSheet, register: Register, known: dict[str, Soil]) -> LandformInstance:
    subject = f"landform '{sheet.name}'"
    landform = register.find(sheet.landform, subject)
    if sheet.soil:
        _soil(sheet.soil, known, subject)
    return LandformInstance(
        name=sheet.name,
        landform=sheet.landform,
        x=place_of(sheet.x, f"x of {subject}"),
        y=place_of(sheet.y, f"y of {subject}"),
        heading=to_si(sheet.heading, "angle", f"heading of {subject}"),
        scale=sheet.scale,
        drivers=landform.values(dict(sheet.drivers), subject),
        soil=sheet.soil,
        age=None if sheet.age is None else _age(sheet.age, subject),
    )
