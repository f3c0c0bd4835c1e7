"""``rille terrain preview``: pictures of a scene or of the ground in a database, redrawn while the scene is edited."""

import time
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.talk import Json, print_json, progress, say

if TYPE_CHECKING:
    from rille.model import Rover, Terrain
    from rille.view.terrain_pictures import Mark

POLL = 0.15  # [s] between two looks at the files
OTHER_PICTURES = (".jpg", ".jpeg", ".tif", ".tiff", ".svg", ".pdf", ".gif", ".bmp", ".webp", ".eps", ".ps", ".avif", ".jp2")


class Kind(StrEnum):
    """Kinds of pictures."""

    SHADE = "shade"
    SLOPE = "slope"
    SOIL = "soil"
    OBLIQUE = "3d"
    PROFILE = "profile"


def preview(
    ground: Annotated[Path, typer.Argument(help="Scene (TOML), or database with a terrain.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder, or PNG if it is one picture.")] = Path("terrain_pictures"),
    kind: Annotated[list[Kind] | None, typer.Option(help="Which pictures; default: all that can be made.")] = None,
    line: Annotated[str | None, typer.Option(help="Line of the profile in metres: x1,y1,x2,y2.")] = None,
    rover: Annotated[Path | None, typer.Option(help="Database with the rover that stands in the 3-D view for scale.")] = None,
    at: Annotated[str | None, typer.Option(help="Where it stands in metres: x,y; without a rover, a rod of 2 m.")] = None,
    heading: Annotated[str | None, typer.Option(help='Heading of the rover, for example "30 deg".')] = None,
    name: Annotated[str | None, typer.Option(help="Terrain of the database, if it holds several.")] = None,
    watch: Annotated[bool, typer.Option(help="Draw again whenever the scene or a file it uses changes, until Ctrl-C.")] = False,
    as_json: Json = False,
) -> None:
    """Draw the ground: map with contours and landforms, slopes, soils, 3-D view with a rover for scale, profile along a line.

    Example: rille terrain preview examples/terrain/composed.toml --kind shade -o composed.png --watch
    """
    wanted = list(dict.fromkeys(kind or [k for k in Kind if k is not Kind.PROFILE or line is not None]))
    targets = _targets(wanted, output)
    options = _options(line, at, heading)
    options["rover"] = _rover(rover)
    if Kind.PROFILE in wanted and options["line"] is None:
        raise _refused("a profile needs its line, for example --line=-20,0,20,0")
    if not watch:
        with progress(f"drawing {ground.name}") as update:
            terrain = _evaluated(ground, name, update)
            facts = draw(terrain, marks_of(terrain, own_folders(ground)), targets, options, update)
        _tell(facts, as_json)
        return
    _watch(ground, name, targets, options, as_json)


def draw(
    terrain: "Terrain", marks: "list[Mark]", targets: dict[Kind, Path], options: dict[str, Any], update: Callable[[str, float], None]
) -> dict[str, Any]:
    """Draw pictures of a terrain; returns their paths, measures by kind and notes about what could not be drawn."""
    from rille.view import terrain_pictures as pictures

    measures: dict[str, Any] = {}
    notes: list[str] = []
    for count, (kind, path) in enumerate(targets.items()):
        update(kind.value, 0.4 + 0.6 * count / len(targets))
        _make_room(path)
        try:
            if kind is Kind.SHADE:
                pictures.draw_shade(terrain, path, marks=marks)
            elif kind is Kind.SLOPE:
                measures["slope"] = pictures.draw_slope(terrain, path, marks=marks)
            elif kind is Kind.SOIL:
                measures["soil"] = {"shares": pictures.draw_soil(terrain, path, marks=marks)}
            elif kind is Kind.PROFILE:
                measures["profile"] = pictures.draw_profile(terrain, path, options["line"], marks=marks)
            else:
                place = {"rover": options["rover"], "at": options["at"], "heading": options["heading"]}
                notes += pictures.draw_oblique(terrain, path, marks=marks, **place)
        except OSError as error:
            raise _refused(f"the picture '{path}' cannot be written: {error.strerror or error}") from None
    return {"terrain": terrain.name, "pictures": [str(p) for p in targets.values() if p.is_file()], **measures, "notes": notes}


def marks_of(terrain: "Terrain", folders: Sequence[Path] = ()) -> list["Mark"]:
    """Where the landforms of a terrain stand, how they are turned, and the outlines of their footprints.

    folders : with own landforms of the scene. A landform that is not registered here has no outline.
    """

    from rille import terrain as ground
    from rille.terrain.placed import Placed
    from rille.view.terrain_pictures import Mark

    register = ground.landforms(folders)
    marks = []
    for placed in terrain.landforms:
        outline = None
        if placed.landform in register:
            outline = Placed(instance=placed, landform=register[placed.landform]).outline()
        marks.append(Mark(name=placed.name, x=placed.x, y=placed.y, heading=placed.heading, outline=outline))
    return marks


def quick_picture(terrain: "Terrain", scene: Path, path: Path) -> None:
    """The map of an evaluated scene, for verbs that edit it: drawn in about a tenth of a second."""
    draw(terrain, marks_of(terrain, own_folders(scene)), {Kind.SHADE: path}, {}, lambda what, fraction: None)


def _tell(facts: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print_json(facts)
        return
    for picture in facts["pictures"]:
        print(picture)
    for note in facts["notes"]:
        say(note)


def _refused(sentence: str) -> Exception:
    from rille.model import InputRefused

    return InputRefused(sentence)


def _numbers(text: str, count: int, what: str, example: str) -> tuple[float, ...]:
    import math

    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(v) for v in values):
        raise _refused(f"{what} is '{text}'; it must be {count} numbers in metres with commas between them, for example {example}")
    return values


def _options(line: str | None, at: str | None, heading: str | None) -> dict[str, Any]:
    from rille.model.quantity import angle_with_unit

    return {
        "line": None if line is None else _numbers(line, 4, "the line", "--line=-20,0,20,0"),
        "at": None if at is None else _numbers(at, 2, "the place of the rover", "--at=-7,0"),
        "heading": None if heading is None else angle_with_unit(heading, "heading of the rover"),
    }


def _targets(kinds: Sequence[Kind], output: Path) -> dict[Kind, Path]:
    if output.suffix.lower() == ".png":
        if len(kinds) != 1:
            raise _refused(f"'{output}' is one picture, but {len(kinds)} kinds are asked for; give one --kind, or a folder")
        return {kinds[0]: output}
    if output.suffix.lower() in OTHER_PICTURES and not output.is_dir():
        raise _refused(f"'{output}' is named as a picture that is no PNG; name it {output.with_suffix('.png')}, or give a folder")
    return {kind: output / f"{kind.value}.png" for kind in kinds}


def _make_room(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _refused(f"the folder '{path.parent}' cannot be made: {error.strerror or error}") from None


def _rover(path: Path | None) -> "Rover | None":
    if path is None:
        return None
    from rille import store

    rover = store.read_rover(path)
    if not rover.parts:
        raise _refused(f"'{path}' holds no rover to stand on the ground; name a database made by `rille cad build`")
    return rover


def _evaluated(ground: Path, name: str | None, update: Callable[[str, float], None]) -> "Terrain":
    """The terrain of a scene, evaluated, or of a database."""
    if ground.suffix.lower() == ".toml":
        from rille import terrain

        return terrain.build(ground, progress=lambda what, fraction: update(what, 0.4 * fraction), tell=say)
    from rille import store

    return store.read_terrain(ground, name, heights=False)


def _stamps(files: Sequence[Path]) -> dict[Path, tuple[int, int] | None]:
    """Time and size of files; None for those that are not there."""
    found: dict[Path, tuple[int, int] | None] = {}
    for file in files:
        try:
            state = file.stat()
            found[file] = (state.st_mtime_ns, state.st_size)
        except OSError:
            found[file] = None
    return found


def _watch(ground: Path, name: str | None, targets: dict[Kind, Path], options: dict[str, Any], as_json: bool) -> None:
    from rille.model import InputRefused

    if not ground.is_file():
        raise InputRefused(f"there is no scene or database '{ground}' to watch")
    say(f"watching {ground}; Ctrl-C ends")
    while True:
        files = used_files(ground)
        before = _stamps(files)
        start = time.perf_counter()
        try:
            _tell(_drawn(ground, name, targets, options), as_json)
            say(f"drew {', '.join(kind.value for kind in targets)} in {time.perf_counter() - start:.2f} s")
        except InputRefused as refusal:
            say(f"not drawn: {refusal}")
        while _stamps(files) == before:
            time.sleep(POLL)


def _drawn(ground: Path, name: str | None, targets: dict[Kind, Path], options: dict[str, Any]) -> dict[str, Any]:
    """Evaluate and draw; the ground is let go before the next one, which could not use what is kept of a large one otherwise."""
    terrain = _evaluated(ground, name, lambda what, fraction: None)
    return draw(terrain, marks_of(terrain, own_folders(ground)), targets, options, lambda what, fraction: None)


def used_files(ground: Path) -> list[Path]:
    """The scene and the files that it names: its DEM, density maps, and everything in folders of its own landforms."""
    page = _page(ground)
    named = [(page.get("base"), "file")]
    populations = page.get("population")
    for population in populations if isinstance(populations, list) else []:
        named.append((population.get("density") if isinstance(population, dict) else None, "map"))
    texts = [table.get(key) for table, key in named if isinstance(table, dict)]
    files = [ground]
    for path in [*(text for text in texts if isinstance(text, str)), *page.get("library", [])]:
        files += _below(path, ground)
    return files


def own_folders(ground: Path) -> list[Path]:
    """Folders with own landforms that a scene names; of a database none."""
    from rille.model.sheet import expand

    library = _page(ground).get("library", [])
    return [expand(folder, ground.parent) for folder in library]


def _below(text: str, ground: Path) -> list[Path]:
    from rille.model import InputRefused
    from rille.model.sheet import expand

    try:
        path = expand(text, ground.parent)
    except InputRefused:
        return []
    return sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]


def _page(ground: Path) -> dict[str, Any]:
    """Content of a scene as far as it can be read now; a database has none."""
    import tomllib

    if ground.suffix.lower() != ".toml":
        return {}
    try:
        page = tomllib.loads(ground.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    library = page.get("library", [])
    page["library"] = [folder for folder in library if isinstance(folder, str)] if isinstance(library, list) else []
    return page
