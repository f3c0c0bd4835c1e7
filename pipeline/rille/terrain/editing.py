"""Edits of a scene file: what is placed, moved, turned, scaled, set, removed. The file keeps its comments and its layout."""

import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rille.model import InputRefused, nearest_names
from rille.model.quantity import angle_with_unit, to_si
from rille.model.sheet import expand
from rille.terrain import history
from rille.terrain.blocks import Block, added, blocks, changed, removed
from rille.terrain.history import Edited
from rille.terrain.landform import Driver, Landform
from rille.terrain.register import read_register
from rille.terrain.scene import Scene, read_scene

KINDS = ("landform", "population", "soil_patch", "obstacle")
MOVABLE = ("landform", "obstacle")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """An edit that was done. kind, name : of what was edited. entry : as it is written now; None if it is gone. note : what to look at."""

    kind: str
    name: str
    entry: dict[str, Any] | None
    edited: Edited
    note: str = ""


class _Check:
    """Reads the edited scene, which refuses what is no good, and keeps it for a look."""

    read: Scene

    def __call__(self, file: Path) -> None:
        self.read = read_scene(file)

    def note(self, name: str) -> str:
        """Says if a landform leaves no trace on the ground."""
        why = self.read.unseen.get(f"landform '{name}'")
        return f"it {why}" if why else ""


def place(
    scene: Path,
    landform: str,
    *,
    name: str | None = None,
    x: str = "0 m",
    y: str = "0 m",
    heading: str | None = None,
    scale: float | None = None,
    age: str | None = None,
    soil: str | None = None,
    drivers: Mapping[str, str] | None = None,
) -> Change:
    """Place a registered landform.

    Parameters
    ----------
    name : default: its kind and the next number, such as ``crater_3``.
    x, y : place in W, with a unit; bare numbers are metres. heading : with a unit. drivers : as texts by name, bare lengths in metres.

    Raises
    ------
    InputRefused : for anything that a scene would be refused for; nothing is written then. Likewise all other edits of this module.
    """
    at = {"x": _length(x, "x"), "y": _length(y, "y")}

    def change(text: str) -> tuple[str, str]:
        page = _page(text, scene)
        called = name or _next_name(landform, page)
        subject = f"landform '{called}'"
        form = _register(page, scene).find(landform, subject)
        entry: dict[str, Any] = {"name": called, "landform": landform, **at}
        if heading is not None:
            entry["heading"] = _angle(heading, "heading")
        if scale is not None:
            entry["scale"] = scale
        if age is not None:
            entry["age"] = _plain(age)
        if soil is not None:
            entry["soil"] = soil
        given = _driver_values(form, drivers or {}, subject)
        form.values(given, subject)
        if given:
            entry["drivers"] = given
        made.append((called, entry))
        return added(text, "landform", entry), f"place {called}"

    made: list[tuple[str, dict[str, Any]]] = []
    check = _Check()
    edited = history.edit(scene, change, check)
    called, entry = made[-1]
    return Change(kind="landform", name=called, entry=entry, edited=edited, note=check.note(called))


def move(
    scene: Path, name: str, *, x: str | None = None, y: str | None = None, by: tuple[str, str] | None = None, kind: str | None = None
) -> Change:
    """Move a landform or an obstacle to a place, or by a distance; without ``x`` (or ``y``) it keeps its own."""
    if (by is None) == (x is None and y is None):
        raise InputRefused(f"moving '{name}' needs --x and --y, or --by; give one of both, for example --by '1 m,-20 cm'")
    to = {key: _length(value, key) for key, value in (("x", x), ("y", y)) if value is not None}

    def change(table: Any) -> None:
        for key, value in to.items():
            table[key] = value
        if by is not None:
            for key, distance in zip(("x", "y"), by, strict=True):
                table[key] = _plus(table[key], _length(distance, f"distance along {key}"), "m", f"{key} of '{name}'")

    return _change(scene, name, "move", change, kind, MOVABLE)


def rotate(scene: Path, name: str, *, to: str | None = None, by: str | None = None, kind: str | None = None) -> Change:
    """Turn a landform or an obstacle to a heading or by an angle, counterclockwise from above; angles carry their unit."""
    if (by is None) == (to is None):
        raise InputRefused(f"turning '{name}' needs --to or --by; give one of both, for example --by '15 deg'")
    angle = _angle(to or by or "", "angle")

    def change(table: Any) -> None:
        table["heading"] = angle if by is None else _turned(table.get("heading", 0.0), angle, f"heading of '{name}'")

    return _change(scene, name, "rotate", change, kind, MOVABLE)


def scale(scene: Path, name: str, *, to: float | None = None, by: float | None = None, kind: str | None = None) -> Change:
    """Enlarge a landform in all directions, to a scale or by a factor; an obstacle by a factor."""
    if (by is None) == (to is None):
        raise InputRefused(f"scaling '{name}' needs --to or --by; give one of both, for example --by 1.5")
    for factor in (to, by):
        if factor is not None and not (math.isfinite(factor) and factor > 0):
            raise InputRefused(f"the scale of '{name}' is {factor:g}; it must be larger than 0, for example 1.5")

    def change(table: Any) -> None:
        if "size" not in table:  # a landform
            table["scale"] = _rounded(to if by is None else float(table.get("scale", 1.0)) * by)
            return
        if by is None:
            raise InputRefused(f"obstacle '{name}' has sizes instead of a scale; scale it --by a factor")
        for k, size in enumerate(list(table["size"])):
            number, unit = _split(size, "m")
            table["size"][k] = _joined(number * by, unit)

    return _change(scene, name, "scale", change, kind, MOVABLE)


def set_drivers(
    scene: Path, name: str, drivers: Mapping[str, str], *, soil: str | None = None, age: str | None = None, landform: str | None = None
) -> Change:
    """Change drivers of a landform, its soil or its age, or what kind it is. An empty text takes a driver, soil or age off again."""
    if not drivers and soil is None and age is None and landform is None:
        raise InputRefused(f"nothing is to be set on '{name}'; give drivers, for example diameter=8m, or --soil, --age")
    found: list[tuple[Landform, dict[str, Any]]] = []

    def change(table: Any) -> None:
        form, given = found[0]
        if landform is not None:
            table["landform"] = landform
        for key, text in (("soil", soil), ("age", None if age is None else _plain(age))):
            if text == "":
                table.pop(key, None)
            elif text is not None:
                table[key] = text
        if given and "drivers" not in table:
            import tomlkit

            table["drivers"] = tomlkit.inline_table()
        for driver, value in given.items():
            if value == "":
                if driver not in table["drivers"]:
                    raise InputRefused(f"landform '{name}' does not set the driver '{driver}'; {nearest_names(driver, table['drivers'])}")
                table["drivers"].pop(driver)
            else:
                table["drivers"][driver] = value
        form.values(dict(table.get("drivers", {})), f"landform '{name}'")

    def prepare(page: dict[str, Any], block: Block) -> None:
        subject = f"landform '{name}'"
        form = _register(page, scene).find(landform or block.content["landform"], subject)
        kept = {driver: "" for driver, text in drivers.items() if text == ""}
        found.append((form, {**_driver_values(form, {d: t for d, t in drivers.items() if t != ""}, subject), **kept}))

    return _change(scene, name, "set", change, "landform", ("landform",), prepare)


def remove(scene: Path, name: str, *, kind: str | None = None) -> Change:
    """Take a landform, population, soil patch or obstacle out."""
    made: list[Block] = []

    def change(text: str) -> tuple[str, str]:
        block = _find(text, scene, name, kind, KINDS)
        made.append(block)
        return removed(text, block), f"remove {name}"

    edited = history.edit(scene, change, read_scene)
    return Change(kind=made[-1].kind, name=name, entry=None, edited=edited)


def undo(scene: Path, steps: int = 1) -> Edited:
    """Go back by edits, also by those that were made by hand."""
    return history.step(scene, -_count(steps, "undo"))


def redo(scene: Path, steps: int = 1) -> Edited:
    """Do again what was undone."""
    return history.step(scene, _count(steps, "redo"))


def _count(steps: int, verb: str) -> int:
    if steps < 1:
        raise InputRefused(f"the number of edits to {verb} is {steps}; it must be at least 1")
    return steps


def _change(
    scene: Path,
    name: str,
    verb: str,
    change: Callable[[Any], None],
    kind: str | None,
    kinds: tuple[str, ...],
    prepare: Callable[[dict[str, Any], Block], None] = lambda page, block: None,
) -> Change:
    made: list[tuple[str, dict[str, Any]]] = []

    def apply(text: str) -> tuple[str, str]:
        block = _find(text, scene, name, kind, kinds)
        prepare(_page(text, scene), block)
        new = changed(text, block, change)
        _page(new, scene)
        made.append((block.kind, _find(new, scene, name, block.kind, kinds).content))
        return new, f"{verb} {name}"

    check = _Check()
    edited = history.edit(scene, apply, check)
    note = check.note(name) if edited.what and made[-1][0] == "landform" else ""
    return Change(kind=made[-1][0], name=name, entry=made[-1][1], edited=edited, note=note)


def _page(text: str, scene: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputRefused(f"'{scene}' is not valid TOML: {error}; correct it, or `rille terrain undo` goes back to what it was") from None


def _register(page: dict[str, Any], scene: Path) -> Any:
    folders = page.get("library", [])
    return read_register(
        expand(folder, scene.parent) for folder in (folders if isinstance(folders, list) else []) if isinstance(folder, str)
    )


def _entries(page: Mapping[str, Any], kind: str) -> list[dict[str, Any]]:
    found = page.get(kind, [])
    return [entry for entry in found if isinstance(entry, dict)] if isinstance(found, list) else []


def _next_name(landform: str, page: dict[str, Any]) -> str:
    """The landform's name and the number after the highest that is used."""
    pattern = re.compile(re.escape(landform) + r"_(\d+)")
    names = [str(entry.get("name")) for kind in KINDS for entry in _entries(page, kind)]
    used = [int(match.group(1)) for n in names if (match := pattern.fullmatch(n))]
    return f"{landform}_{max(used, default=0) + 1}"


def _find(text: str, scene: Path, name: str, kind: str | None, kinds: tuple[str, ...]) -> Block:
    page = _page(text, scene)
    if kind is not None and kind not in kinds:
        raise InputRefused(f"the kind '{kind}' is none of {', '.join(kinds)}")
    wanted = kinds if kind is None else (kind,)
    named = [block for block in blocks(text) if block.kind in wanted and block.content.get("name") == name]
    if len(named) > 1:
        kinds_named = sorted({block.kind for block in named})
        if len(kinds_named) == 1:
            raise InputRefused(f"'{scene}' has {len(named)} {kinds_named[0]}s called '{name}'; give each its own name in the file")
        raise InputRefused(f"'{name}' is the name of {' and '.join(kinds_named)} in '{scene}'; say which with --kind {kinds_named[0]}")
    if named:
        return named[0]
    for other in wanted:
        if any(entry.get("name") == name for entry in _entries(page, other)):
            raise InputRefused(f"{other} '{name}' is written within one array; write it as a table that begins with [[{other}]] to edit it")
    names = [str(entry.get("name")) for other in wanted for entry in _entries(page, other)]
    what = " or ".join(w.replace("_", " ") for w in wanted)
    raise InputRefused(f"'{scene}' has no {what} called '{name}'; {nearest_names(name, names)}")


# Quantities as a person writes them


def _split(value: object, unit: str) -> tuple[float, str]:
    """Number and unit of a written quantity; bare numbers are SI."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value), unit
    match = _NUMBER.fullmatch(str(value))
    if match is None:
        return to_si(str(value), unit, "the value"), unit
    return float(match.group(1)), match.group(2) or unit


def _joined(number: float, unit: str) -> str:
    return f"{_rounded(number):.10g} {unit}"


def _rounded(number: float | None) -> float:
    """Without the noise of binary fractions; -0 is 0."""
    return float(f"{number:.10g}") + 0.0


def _length(text: str, what: str) -> str:
    """A length with its unit; a bare number is in metres."""
    to_si(text if not _bare(text) else float(text), "m", what)
    return _tidy(text, "m")


def _angle(text: str, what: str) -> str:
    """An angle with its unit, which only 0 needs not have."""
    angle_with_unit(text, what)
    return _tidy(text, "deg")


def _bare(text: str) -> bool:
    match = _NUMBER.fullmatch(text)
    return match is not None and not match.group(2)


def _tidy(text: str, unit: str) -> str:
    """``5m`` to ``5 m``; a bare number gets the unit."""
    match = _NUMBER.fullmatch(text)
    if match is None:
        return text.strip()
    return f"{match.group(1).lstrip('+')} {match.group(2) or unit}"


def _plain(text: str) -> Any:
    """A number where the text is one, else the text."""
    if not _bare(text):
        return text
    number = float(text)
    return int(number) if re.fullmatch(r"\s*[-+]?\d+\s*", text) else number


def _plus(value: object, more: str, unit: str, what: str) -> str:
    """A quantity plus another, in its own unit."""
    number, own = _split(value, unit)
    return _joined(number + to_si(more, unit, what) / to_si(f"1 {own}", unit, what), own)


def _turned(value: object, by: str, what: str) -> str:
    """A heading plus an angle, in degrees above -180 up to 180."""
    degrees = math.degrees(to_si(value, "rad", what) + to_si(by, "rad", what))
    return _joined(180.0 - (180.0 - _rounded(degrees)) % 360.0, "deg")


def _driver_values(form: Landform, texts: Mapping[str, str], subject: str) -> dict[str, Any]:
    """Driver values as they are written into the scene."""
    known = {driver.name: driver for driver in form.drivers}
    return {name: _driver_value(known[name], text, subject) if name in known else _plain(text) for name, text in texts.items()}


def _driver_value(driver: Driver, text: str, subject: str) -> Any:
    what = f"driver '{driver.name}' of {subject}"
    if driver.unit == "dimensionless":
        return _plain(text)
    if driver.unit == "rad":
        return _angle(text, what)
    to_si(float(text) if _bare(text) else text, driver.unit, what)
    return _tidy(text, driver.unit)
