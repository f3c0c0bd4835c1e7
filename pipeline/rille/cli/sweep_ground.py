"""The ground of a study's cases: the scene with other numbers, evaluated and put under the model."""

import shutil
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rille.model.process import environment

if TYPE_CHECKING:
    from rille.model import Scenario
    from rille.model.study import Change

FILES = ("file", "map")  # keys of a scene that name files; "library" names folders


def scene_text(scene: Path) -> str:
    """Text of a scene that means the same wherever it lies: files that it names are named in full."""
    import tomlkit

    document: Any = tomlkit.parse(scene.read_text(encoding="utf-8"))
    if "library" in document:
        document["library"] = [_in_full(folder, scene) for folder in document["library"]]
    for tables in ([document.get("base", {})], document.get("population", [])):
        for table in tables:
            for key in FILES:
                if isinstance(table.get(key), str):
                    table[key] = _in_full(table[key], scene)
    return tomlkit.dumps(document)


def _in_full(text: str, scene: Path) -> str:
    from rille.model.sheet import expand

    return str(expand(text, scene.resolve().parent))


def with_numbers(text: str, numbers: "Mapping[Change, float]") -> str:
    """The scene with other numbers [SI] of landforms and base."""
    import tomlkit

    document: Any = tomlkit.parse(text)
    for change, value in numbers.items():
        if change.name == "base":
            document["base"][change.number] = round(value) if change.number == "seed" else value
            continue
        entry = next(entry for entry in document["landform"] if entry["name"] == change.name)
        if change.number in ("x", "y", "heading", "scale", "age"):
            entry[change.number] = value
        else:
            entry.setdefault("drivers", tomlkit.inline_table())[change.number] = value
    return tomlkit.dumps(document)


def require_scene(folder: Path, text: str) -> None:
    """Read and compose a scene, without evaluating its heights.

    Raises
    ------
    InputRefused : for whatever the scene is refused for.
    """
    from rille.terrain.scene import composed

    scene = folder / "scene.toml"
    scene.write_text(text, encoding="utf-8")
    with _own_cache(folder / "cache"), composed(scene):
        pass


def require_sendable(text: str) -> None:
    """Refuse ground that workers elsewhere would have to read from files.

    Raises
    ------
    InputRefused : with the first file or folder that a scene names.
    """
    import tomllib

    from rille.model import InputRefused

    scene = tomllib.loads(text)
    tables = [scene.get("base", {}), *scene.get("population", [])]
    files = [*scene.get("library", []), *(table[key] for table in tables for key in FILES if isinstance(table.get(key), str))]
    if files:
        raise InputRefused(
            f"the ground that varies is made from '{files[0]}', which workers of a cluster do not have; run it without --scheduler"
        )


def put_under(database: Path, model: Path, text: str, scenario: "Scenario") -> None:
    """Make a database of the model with a scene in place of its ground.

    Raises
    ------
    InputRefused : for whatever the scene is refused for.
    """
    from rille import store, terrain

    scene = database.with_suffix(".toml")  # always the same, so that only what changed is evaluated anew
    scene.write_text(text, encoding="utf-8")
    with _own_cache(database.parent / "cache"):
        ground = terrain.build(scene)
        shutil.copyfile(model, database)
        store.write_terrain(database, ground, replace=True)
    store.write_scenario(database, scenario)


def _own_cache(folder: Path) -> AbstractContextManager[None]:
    """Evaluated ground goes into this folder meanwhile: a thousand variants have no place among what a user keeps."""
    return environment({"RILLE_CACHE": str(folder)})
