"""The folder of own landforms: ``<folder>/<name>/landform.toml`` with its data; it can be shared and versioned as it is."""

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rille.model import InputRefused, nearest_names
from rille.model.sheet import read_sheet, source_of, toml_string
from rille.terrain.landform import Blend, Landform
from rille.terrain.own.own_size import height_driver, size_driver
from rille.terrain.own.proof import WALL, prove
from rille.terrain.own.reading import read_own
from rille.terrain.own.relief import Relief
from rille.terrain.own.sheet import OwnSheet

SHEET = "landform.toml"
WALL_OF_MAP = "let it fade out there (a larger --fade, or --zero plane or border), or take --blend replace if a wall is meant"


def own_folder() -> Path:
    """The library of own landforms: ``RILLE_LANDFORMS``, else ``~/.local/share/rille/landforms``."""
    return Path(os.environ.get("RILLE_LANDFORMS") or Path.home() / ".local/share/rille/landforms")


def own_files(folder: Path) -> list[Path]:
    """Sheets of a library: ``<name>/landform.toml`` and ``<name>.toml``."""
    return sorted([*folder.glob("*.toml"), *folder.glob(f"[!.]*/{SHEET}")])


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """A landform that was taken in. file : its sheet. replaced : one of that name was there."""

    landform: Landform
    file: Path
    replaced: bool


def name_from(path: Path) -> str:
    """A name from that of a file.

    Raises
    ------
    InputRefused : if it has no letter to begin with.
    """
    name = re.sub(r"[^a-z0-9]+", "_", path.stem.lower()).strip("_")
    return check_name(name, path)


def check_name(name: str, path: Path) -> str:
    """The name, refused unless it is one word of small letters, digits and underscores."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputRefused(
            f"'{name}' cannot name the landform of '{path}'; state --name with small letters, digits and underscores, a letter first"
        )
    return name


def keep_profile(file: Path, *, folder: Path, builtin: Collection[str], soils: Collection[str], name: str | None, replace: bool) -> Kept:
    """Take in a TOML profile, with its comments; and the grid beside it if it has one.

    Raises
    ------
    InputRefused : for a file that is no landform or keeps not what it must (:func:`prove`), and a name that is taken.
    """
    sheet = read_sheet(file, OwnSheet)
    text = file.read_text(encoding="utf-8")
    if name is not None:
        import tomlkit

        page = tomlkit.parse(text)
        page["name"] = check_name(name, file)
        text = tomlkit.dumps(page)
    beside = [] if sheet.heights is None else [_inside(file.parent, sheet.heights.file, file)]

    def write(into: Path) -> None:
        (into / SHEET).write_text(text, encoding="utf-8")
        for path in beside:
            shutil.copyfile(path, into / path.name)

    return _keep(name or sheet.name, write, folder, builtin, soils, replace)


def keep_heights(
    relief: Relief,
    *,
    made_from: Path,
    folder: Path,
    builtin: Collection[str],
    soils: Collection[str],
    name: str | None,
    meaning: str | None,
    source: str | None,
    blend: Blend | None,
    soil: str,
    replace: bool,
) -> Kept:
    """Take in heights of a map or a solid, as 32-bit numbers, with a sheet that says how they were made.

    Raises
    ------
    InputRefused : as :func:`keep_profile`.
    """
    solid = relief.embedded is not None
    name = name_from(made_from) if name is None else check_name(name, made_from)
    grid, heights = relief.grid, relief.heights.astype(np.float32)
    # Both are only units, in which the drivers count: six digits make the sheet readable and lose nothing.
    length, height = (float(f"{v:.6g}") for v in (relief.length, heights.max() if solid else np.abs(heights).max()))
    what = "height of its top above height zero" if solid else "largest height or depth; negative: upside down"
    drivers = [
        size_driver("length", "length along x; the width follows", length),
        height_driver(what, height, "length", length, mirrored=not solid),
    ]
    rows = [
        ("name", name),
        ("meaning", meaning or f"{'solid' if solid else 'height map'} {made_from.name}"),
        ("frame", relief.frame),
        ("source", source or f"own: {made_from.name}"),
        ("kind", "heights"),
        ("blend", blend or ("max" if solid else "add")),
        ("soil", soil),
    ]
    lines = [f"{key} = {toml_string(value)}" for key, value in rows] + [f"steep = {str(solid).lower()}"]
    for driver in drivers:
        lines += [
            "",
            "[[driver]]",
            f"name = {toml_string(driver.name)}",
            'unit = "m"',
            f"meaning = {toml_string(driver.meaning)}",
            f"range = [{driver.lower!r}, {driver.upper!r}]",
            f"default = {driver.default!r}" if driver.link is None else f"link = {toml_string(driver.law)}",
            f"reason = {toml_string(driver.reason)}",
            f"source = {toml_string(driver.source)}",
        ]
    if relief.embedded is not None:
        lines += [
            "",
            "[[driver]]",
            'name = "embedded"',
            'unit = "dimensionless"',
            'meaning = "fraction of its height below the ground"',
            "range = [0.0, 0.95]",
            f"default = {min(relief.embedded, 0.95)!r}",
            'reason = "nothing is seen of what is embedded entirely"',
            'source = "stated when it was registered"',
        ]
    lines += [
        "",
        "[heights]  # row 0 is the northernmost, column 0 the westernmost",
        'file = "heights.npy"',
        f"posting = [{grid.posting_x!r}, {grid.posting_y!r}]",
        f"west = {grid.x_west!r}",
        f"north = {grid.y_north!r}",
        f"length = {length!r}",
        f"height = {height!r}",
        f"solid = {str(solid).lower()}",
        f"made_from = {toml_string(made_from.name)}",
        f"sha256 = {toml_string(source_of(made_from, name, '').sha256)}",
        f"reference = {toml_string(relief.reference)}",
    ]

    def write(into: Path) -> None:
        (into / SHEET).write_text("\n".join(lines) + "\n", encoding="utf-8")
        np.save(into / "heights.npy", heights)

    return _keep(name, write, folder, builtin, soils, replace, WALL_OF_MAP)


def remove(name: str, folder: Path) -> Path:
    """Take a landform out of a library, also one that is broken; the path that is gone.

    Raises
    ------
    InputRefused : if it is not there.
    """
    known = {(file.parent.name if file.name == SHEET else file.stem): file for file in own_files(folder)}
    if name not in known:
        raise InputRefused(f"the library '{folder}' has no landform '{name}'; {nearest_names(name, known)}")
    file = known[name]
    try:
        if file.name == SHEET:
            shutil.rmtree(file.parent)
            return file.parent
        file.unlink()
    except OSError as error:
        raise InputRefused(f"'{file}' could not be removed: {error.strerror}") from None
    return file


def _inside(folder: Path, name: str, file: Path) -> Path:
    path = folder / name
    if not path.is_file() or Path(name).name != name:
        raise InputRefused(f"'{file}' names the heights '{name}', which do not lie beside it; put both into one folder")
    return path


def _keep(
    name: str,
    write: Callable[[Path], None],
    folder: Path,
    builtin: Collection[str],
    soils: Collection[str],
    replace: bool,
    wall: str = WALL,
) -> Kept:
    """Write into a folder of its own, read it back, prove it; only then it takes its place. wall : what to do about one at its border."""
    if name in builtin:
        raise InputRefused(f"'{name}' is the name of a built-in landform; choose another with --name")
    place = folder / name
    single = folder / f"{name}.toml"
    there = place.exists() or single.exists()
    if there and not replace:
        raise InputRefused(
            f"the library '{folder}' has a landform '{name}' already; choose another name with --name, or --force to replace it"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".taking-in-", dir=folder) as trial:
            new = Path(trial) / name
            new.mkdir()
            write(new)
            try:
                landform = read_own(new / SHEET)
                prove(landform, wall)
            except InputRefused as refused:
                raise InputRefused(str(refused).removeprefix(f"'{new / SHEET}': ")) from None
            if landform.soil and landform.soil not in soils:
                raise InputRefused(
                    f"landform '{name}' has the soil '{landform.soil}', which the library does not have; "
                    f"{nearest_names(landform.soil, soils)}"
                )
            if place.exists():
                place.rename(Path(trial) / "old")
            single.unlink(missing_ok=True)
            new.rename(place)
    except OSError as error:
        raise InputRefused(f"the library '{folder}' could not be written: {error.strerror or error}") from None
    return Kept(landform=read_own(place / SHEET), file=place / SHEET, replaced=there)
