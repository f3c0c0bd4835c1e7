"""``rille terrain new|place|move|rotate|scale|set|remove|undo|redo|list SCENE``: a scene is edited, and every state of it is kept."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.places import require_png
from rille.cli.talk import Json, assignments, print_json, say

if TYPE_CHECKING:
    from rille.terrain.editing import Change
    from rille.terrain.history import Edited

Scene = Annotated[Path, typer.Argument(help="Scene (TOML).")]
Name = Annotated[str, typer.Argument(help="Name of what is placed.")]


def _png(picture: Path | None) -> Path | None:
    """Refuses, before anything is edited, a picture that is no PNG: it could be the scene itself."""
    require_png(picture)
    return picture


Picture = Annotated[Path | None, typer.Option(callback=_png, help="Also draw a map of the edited scene (PNG).")]


class Base(StrEnum):
    """Kinds of bases."""

    FLAT = "flat"
    PLANE = "plane"
    FRACTAL = "fractal"
    DEM = "dem"


class Kind(StrEnum):
    """What a scene holds by name."""

    LANDFORM = "landform"
    POPULATION = "population"
    SOIL_PATCH = "soil_patch"
    OBSTACLE = "obstacle"


Which = Annotated[Kind | None, typer.Option("--kind", help="Which, if two kinds have that name.")]

_shows: list[Callable[[Path, Path], None]] = []  # how a scene is drawn: (scene, picture); see attach


def attach(app: typer.Typer, show: Callable[[Path, Path], None]) -> None:
    """Add the verbs to ``rille terrain``; ``show`` draws a scene into a picture."""
    _shows[:] = [show]
    for verb in (new, place, move, rotate, scale, undo, redo, remove):
        app.command(verb.__name__)(verb)
    app.command("set")(set_)


def new(
    scene: Annotated[Path, typer.Argument(help="Scene to be written (TOML); an existing file is left alone.")],
    base: Annotated[Base, typer.Option(help="The ground before landforms.")] = Base.FRACTAL,
    size: Annotated[str | None, typer.Option(help="Extent along x and y; default 60 m,40 m, of a DEM all of it.")] = None,
    posting: Annotated[str | None, typer.Option(help="Distance of neighbouring heights; default 0.1 m, of a DEM its own.")] = None,
    dem: Annotated[str | None, typer.Option(help="File of the DEM; from the scene's folder, or with ${RILLE_DATA}.")] = None,
    name: Annotated[str | None, typer.Option(help="Name of the terrain; default: of the file.")] = None,
    soil: Annotated[str, typer.Option(help="Soil of the ground.")] = "lunar_sourcebook",
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Write a scene to begin with, with comments that say what can be written where.

    Example: rille terrain new site.toml --base fractal --size "80 m,60 m"
    """
    from rille.terrain.starter import new_scene

    extent = None if size is None else _pair(size, "size", "--size '80 m,60 m'")
    notes = new_scene(scene, name=name, base=base.value, size=extent, posting=posting, dem=dem, soil=soil)
    for note in () if as_json else notes:
        say(f"note: {note}")
    _tell(
        {"scene": str(scene), "done": ["new"], "notes": list(notes)},
        f"wrote {scene}; next: rille terrain place {quote(str(scene))} crater --set diameter=6m",
        as_json,
    )
    _draw(scene, picture)


def place(
    scene: Scene,
    landform: Annotated[str, typer.Argument(help="A registered landform; `rille terrain list` shows them.")],
    name: Annotated[str | None, typer.Option(help="Default: its kind and the next number, such as crater_3.")] = None,
    x: Annotated[str, typer.Option("--x", help="East [m, or with a unit].")] = "0 m",
    y: Annotated[str, typer.Option("--y", help="North [m, or with a unit].")] = "0 m",
    heading: Annotated[str | None, typer.Option(help='Turn from x towards y, such as "30 deg".')] = None,
    scale: Annotated[float | None, typer.Option(help="Enlarges it in all directions.")] = None,
    age: Annotated[str | None, typer.Option(help='Such as "300 Myr"; the older lie below the younger; without: on top.')] = None,
    soil: Annotated[str | None, typer.Option(help="Soil of its surface.")] = None,
    drivers: Annotated[list[str] | None, typer.Option("--set", help="DRIVER=VALUE, once for each driver.")] = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Place a registered landform.

    Example: rille terrain place site.toml crater --x 5 --y "-80 cm" --set diameter=6m --picture site.png
    """
    from rille.terrain import editing

    given = assignments(drivers, "--set diameter=6m")
    change = editing.place(
        scene, landform, name=name, x=x, y=y, heading=heading, scale=scale, age=age, soil=soil, drivers=given
    )  # fmt: skip
    _report(scene, change, picture, as_json)


def move(
    scene: Scene,
    name: Name,
    x: Annotated[str | None, typer.Option("--x", help="To this place east [m, or with a unit].")] = None,
    y: Annotated[str | None, typer.Option("--y", help="To this place north [m, or with a unit].")] = None,
    by: Annotated[str | None, typer.Option(help='By so much east and north, such as "1 m,-20 cm".')] = None,
    kind: Which = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Move a landform or an obstacle.

    Example: rille terrain move site.toml crater_1 --by "1 m,-20 cm"
    """
    from rille.terrain import editing

    distance = None if by is None else _pair(by, "distance", "--by '1 m,-20 cm'")
    _report(scene, editing.move(scene, name, x=x, y=y, by=distance, kind=_value(kind)), picture, as_json)


def rotate(
    scene: Scene,
    name: Name,
    to: Annotated[str | None, typer.Option(help='To this heading, from x towards y, such as "30 deg".')] = None,
    by: Annotated[str | None, typer.Option(help='By this angle, such as "-15 deg".')] = None,
    kind: Which = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Turn a landform or an obstacle.

    Example: rille terrain rotate site.toml ridge_1 --by "15 deg"
    """
    from rille.terrain import editing

    _report(scene, editing.rotate(scene, name, to=to, by=by, kind=_value(kind)), picture, as_json)


def scale(
    scene: Scene,
    name: Name,
    to: Annotated[float | None, typer.Option(help="To this scale; 1 is as its drivers say.")] = None,
    by: Annotated[float | None, typer.Option(help="By this factor.")] = None,
    kind: Which = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Enlarge (or shrink) a landform in all directions, or an obstacle.

    Example: rille terrain scale site.toml crater_1 --by 1.5
    """
    from rille.terrain import editing

    _report(scene, editing.scale(scene, name, to=to, by=by, kind=_value(kind)), picture, as_json)


def set_(
    scene: Scene,
    name: Name,
    drivers: Annotated[list[str] | None, typer.Argument(help="DRIVER=VALUE; DRIVER= takes it off again.")] = None,
    soil: Annotated[str | None, typer.Option(help="Soil of its surface; empty takes it off.")] = None,
    age: Annotated[str | None, typer.Option(help="Its age; empty takes it off.")] = None,
    landform: Annotated[str | None, typer.Option(help="Another kind, with the drivers that it has.")] = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Change drivers of a placed landform, its soil, its age or its kind.

    Example: rille terrain set site.toml crater_1 diameter=8m relief=0.5
    """
    from rille.terrain import editing

    given = assignments(drivers, "diameter=8m")
    _report(scene, editing.set_drivers(scene, name, given, soil=soil, age=age, landform=landform), picture, as_json)


def remove(
    scene: Scene,
    name: Annotated[str, typer.Argument(help="Name of a landform, population, soil patch or obstacle.")],
    kind: Which = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Take a landform, population, soil patch or obstacle out of a scene; `rille terrain undo` brings it back.

    Example: rille terrain remove site.toml crater_1
    """
    from rille.terrain import editing

    _report(scene, editing.remove(scene, name, kind=_value(kind)), picture, as_json)


def undo(
    scene: Scene,
    steps: Annotated[int, typer.Argument(help="Number of edits.")] = 1,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Undo edits, also those that were made by hand in between. No state is ever lost: `rille terrain redo` goes forward again.

    Example: rille terrain undo site.toml 2
    """
    from rille.terrain import editing

    _stepped(scene, editing.undo(scene, steps), "undone", picture, as_json)


def redo(
    scene: Scene,
    steps: Annotated[int, typer.Argument(help="Number of edits.")] = 1,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Do again what was undone.

    Example: rille terrain redo site.toml
    """
    from rille.terrain import editing

    _stepped(scene, editing.redo(scene, steps), "done again", picture, as_json)


def list_placed(scene: Path, as_json: bool) -> None:
    """Print what a scene holds: landforms, populations, soil patches, obstacles (``rille terrain list SCENE``)."""
    from rille.terrain.contents import contents

    held = contents(scene)
    if as_json:
        print_json(held)
        return
    rows = [row for kind in held["kinds"] for row in _rows(kind, held["kinds"][kind])]
    if not rows:
        say(f"{scene}: nothing is placed on its base ({held['base']})")
        return
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]) - 1)]
    for row in rows:
        print("  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[-1]]).rstrip())


def _rows(kind: str, entries: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    rows = []
    for entry in entries:
        where = "" if entry.get("x_m") is None else f"({entry['x_m']:g}, {entry['y_m']:g}) m"
        turned = "" if not entry.get("heading_deg") else f"{entry['heading_deg']:g} deg"
        rows.append((entry["name"], entry.get("of") or kind.replace("_", " "), where, turned, entry["facts"]))
    return rows


def _value(kind: Kind | None) -> str | None:
    return None if kind is None else kind.value


def _pair(text: str, what: str, example: str) -> tuple[str, str]:
    from rille.model import InputRefused

    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2 or not all(parts):
        raise InputRefused(f"the {what} is '{text}'; it must be two values with a comma between them, for example {example}")
    return parts[0], parts[1]


def _report(scene: Path, change: "Change", picture: Path | None, as_json: bool) -> None:
    edited = change.edited
    facts = {
        "scene": str(scene),
        "done": list(edited.what),
        "kind": change.kind,
        "name": change.name,
        "entry": change.entry,
        "undo": edited.undo,
        "redo": edited.redo,
        "note": change.note,
        "picture": None if picture is None else str(picture),
    }
    _draw(scene, picture)
    kind = change.kind.replace("_", " ")
    if not edited.what:
        text = f"{scene}: {kind} '{change.name}' is so already; nothing changed"
    elif change.entry is None:
        text = f"{scene}: took out {kind} '{change.name}'"
    else:
        shown = {key: value for key, value in change.entry.items() if key not in ("name", "landform", "kind", "drivers")}
        words = [*(f"{key} {value}" for key, value in shown.items()), *(f"{k} {v}" for k, v in change.entry.get("drivers", {}).items())]
        text = f"{scene}: {kind} '{change.name}' ({change.entry.get('landform') or change.entry.get('kind')}): {', '.join(words)}"
    _tell(facts, text + (f"; {change.note}" if change.note else ""), as_json)


def _stepped(scene: Path, edited: "Edited", word: str, picture: Path | None, as_json: bool) -> None:
    _draw(scene, picture)
    facts = {"scene": str(scene), word.replace(" ", "_"): list(edited.what), "undo": edited.undo, "redo": edited.redo}
    facts["picture"] = None if picture is None else str(picture)
    _tell(facts, f"{scene}: {word}: {', '.join(edited.what)}; {edited.undo} more to undo, {edited.redo} to redo", as_json)


def _draw(scene: Path, picture: Path | None) -> None:
    from rille.model import InputRefused

    if picture is None:
        return
    try:
        _shows[0](scene, picture)
    except InputRefused as refused:
        raise InputRefused(f"'{scene}' is edited, but its picture could not be drawn: {refused}") from None


def _tell(facts: dict[str, Any], text: str, as_json: bool) -> None:
    if as_json:
        print_json(facts)
    else:
        say(text)
