"""``rille terrain extract``: a region of a scene or of a stored terrain, in any format."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.talk import Force, Json, number, print_json, progress, say
from rille.cli.terrain_facts import facts_of, sentence_of, write_database

if TYPE_CHECKING:
    from rille.model import Terrain

ENDINGS = (
    ".tif GeoTIFF, .cog.tif COG, .asc ESRI ASCII, .xml PDS4, .png 16 bits with JSON, .npy with JSON, .obj, .stl, .glb, .gltf, "
    ".mjcf MuJoCo, .sdf Gazebo, .soil.tif soil map, .db model database"
)


def extract(
    source: Annotated[Path, typer.Argument(help="Scene (TOML), evaluated at the region's points, or a database (.db), interpolated.")],
    output: Annotated[list[Path], typer.Option("--output", "-o", help=f"What to write, once for each, by its ending: {ENDINGS}.")],
    box: Annotated[str | None, typer.Option(help="Two opposite corners [m]: X,Y,X,Y.")] = None,
    center: Annotated[str | None, typer.Option(help="Middle [m]: X,Y; default: that of the scene.")] = None,
    size: Annotated[str | None, typer.Option(help="Extent [m]: WIDTH,HEIGHT or one number for a square.")] = None,
    polygon: Annotated[str | None, typer.Option(help="Corners [m]: 'X,Y X,Y X,Y ...', or a GeoJSON file with one polygon.")] = None,
    in_map: Annotated[bool, typer.Option("--map", help="Coordinates are easting and northing; the heading counts from east.")] = False,
    heading: Annotated[str, typer.Option(help="Turn of the region's x, for example '30 deg'; its frame is then its own.")] = "0",
    posting: Annotated[
        str | None, typer.Option(help="Distance of points [m]: one number, or X,Y; default: the scene's own points.")
    ] = None,
    origin: Annotated[str | None, typer.Option(help="Point X,Y that becomes the origin of the region's frame.")] = None,
    name: Annotated[str | None, typer.Option(help="Name of the extracted terrain; default: that of the scene.")] = None,
    terrain: Annotated[str | None, typer.Option(help="Which terrain of a database that has several.")] = None,
    format_name: Annotated[str | None, typer.Option("--format", "-f", help="Format by name, where the ending does not tell.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Extract a region at any posting, evaluated once, delivered in every format that is asked for. Without a region: everything.

    Example: rille terrain extract examples/terrain/composed.toml --center 5,0 --size 20,10 --posting 0.05 -o site.tif -o site.glb
    """
    from rille.model.quantity import angle_with_unit
    from rille.terrain import delivery

    where = {
        "box": _numbers(box, 4, "--box"),
        "center": _numbers(center, 2, "--center"),
        "size": _pair(size, "--size"),
        "polygon": _corners(polygon),
        "in_map": in_map,
        "heading": angle_with_unit(heading, "--heading"),
        "posting": _pair(posting, "--posting"),
        "origin": _numbers(origin, 2, "--origin"),
    }
    databases = [path for path in output if path.suffix == ".db" and format_name is None]
    files = delivery.plan([path for path in output if path not in databases], format_name)
    with progress(f"extracting from {source.name}") as update:
        ground = _terrain(source, terrain, name, where, update)
        for database in databases:
            write_database(ground, database, force, update)
        written = [*databases, *delivery.deliver(ground, files, update)]
    if gaps := delivery.left_out(ground, files):
        say(f"note: {gaps}")
    facts = {
        **facts_of(ground),
        "x_west_m": ground.x_west,
        "y_north_m": ground.y_north,
        "map_origin_m": list(ground.map_origin),
        "map_heading_rad": ground.map_heading,
        "files": [str(file) for file in written],
    }
    if as_json:
        print_json(facts)
        return
    say(sentence_of(facts))
    for file in written:
        say(f"wrote {file}")


def _terrain(source: Path, stored: str | None, name: str | None, where: dict[str, Any], update: Any) -> "Terrain":
    from rille.model import InputRefused
    from rille.terrain.extraction import extract_from_scene, extract_from_terrain

    if source.suffix != ".toml":
        from rille import store

        return extract_from_terrain(store.read_terrain(source, stored, heights=False), name=name, **where)
    if stored is not None:
        raise InputRefused(f"--terrain names a terrain of a database, but '{source}' is a scene; leave it out")
    return extract_from_scene(source, name=name, progress=update, tell=say, **where)


def _numbers(text: str | None, count: int, option: str) -> tuple[float, ...] | None:
    """``"1,2"`` or ``"1 m,2 m"`` as lengths [m]."""
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != count:
        raise InputRefused(f"{option} is '{text}'; it needs {count} numbers, separated by commas")
    return tuple(to_si(number(part), "length", option) for part in parts)


def _pair(text: str | None, option: str) -> tuple[float, ...] | None:
    """Two numbers, or one for both."""
    if text is not None and "," not in text:
        text = f"{text},{text}"
    return _numbers(text, 2, option)


def _corners(text: str | None) -> Sequence[tuple[float, ...]] | None:
    """Corners of a polygon from the command line or a GeoJSON file."""
    if text is None:
        return None
    if Path(text).suffix.lower() in (".json", ".geojson"):
        return _from_geojson(Path(text))
    return [_numbers(corner, 2, "a corner of --polygon") or () for corner in text.replace(";", " ").split()]


def _from_geojson(path: Path) -> Sequence[tuple[float, ...]]:
    from rille.model import InputRefused

    if not path.is_file():
        raise InputRefused(f"there is no file '{path}'")
    from shapely import GeometryCollection, Polygon, from_geojson
    from shapely.errors import ShapelyError

    try:
        shape = from_geojson(path.read_text())
    except (ShapelyError, UnicodeDecodeError) as error:
        raise InputRefused(f"'{path}' is no GeoJSON: {str(error).splitlines()[0]}") from None
    if isinstance(shape, GeometryCollection) and len(shape.geoms) == 1:
        shape = shape.geoms[0]
    if not isinstance(shape, Polygon):
        raise InputRefused(f"'{path}' holds a {shape.geom_type}; it must hold one Polygon")
    if shape.interiors:
        raise InputRefused(f"the polygon of '{path}' has {len(shape.interiors)} holes; a region has none, so take its outline alone")
    return [(float(corner[0]), float(corner[1])) for corner in shape.exterior.coords[:-1]]
