"""Single parts of a database: to reuse them in another model, and the part library, which is a database like any other."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rille.model import InputRefused, Material, Part, nearest_names
from rille.store.database import create, reading, writing
from rille.store.rover import read_material, read_parts, write_part


def part_library() -> Path:
    """The database of the part library: RILLE_PARTS, else ``~/.local/share/rille/parts.db``."""
    return Path(os.environ.get("RILLE_PARTS") or Path.home() / ".local/share/rille/parts.db")


def list_parts(path: Path) -> tuple[tuple[Part, Material | None], ...]:
    """All parts of a database with their materials.

    Raises
    ------
    InputRefused : if the file is no database of rille.
    """
    with reading(path) as connection:
        materials = {r["name"]: read_material(r) for r in connection.execute("SELECT * FROM material")}
        return tuple((part, materials.get(part.material or "")) for part in read_parts(connection))


def find_part(path: Path | None, name: str) -> tuple[Part, Material | None]:
    """A part by its name or the beginning (8 digits or more) of its digest; without a path, of the part library.

    Raises
    ------
    InputRefused : if there is none, with the nearest names.
    """
    where = part_library() if path is None else path
    if path is None and not where.exists():
        raise InputRefused(f"the part library '{where}' does not exist yet; put parts into it with `rille cad part add MODEL.db PART`")
    there = list_parts(where)
    for part, material in there:
        if part.name == name or (len(name) >= 8 and part.brep_hash.startswith(name)):
            return part, material
    raise InputRefused(f"'{where}' has no part '{name}'; {nearest_names(name, [part.name for part, _ in there])}")


def add_part(path: Path, part: Part, material: Material | None, *, replace_other: bool = False) -> str:
    """Put a part into a library, made if absent; its digest is its key.

    Returns
    -------
    "added", or "renewed" if the same geometry was there under that name.

    Raises
    ------
    InputRefused : if the name belongs to other geometry and ``replace_other`` is false, or the same geometry has another name.
    """
    path = Path(path)
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        create(path)
    digests: Mapping[str, str] = {there.name: there.brep_hash for there, _ in list_parts(path)}
    other = next((name for name, digest in digests.items() if digest and digest == part.brep_hash and name != part.name), None)
    if other is not None:
        raise InputRefused(f"'{path}' has the same geometry as part '{other}'; use that, or put it in as `--as {other}`")
    same = digests.get(part.name) == part.brep_hash
    if part.name in digests and not same and not replace_other:
        raise InputRefused(
            f"'{path}' has another part '{part.name}' (digest {digests[part.name][:12]}); choose a name with --as, or --force"
        )
    with writing(path) as connection:
        connection.execute("DELETE FROM part WHERE name = ?", (part.name,))
        write_part(connection, replace(part, material=None if material is None else material.name), material)
    return "renewed" if same else "added"
