"""Materials: of the sheet, of a file beside it, of rille's library, in this order."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from rille.cad.entries import positive
from rille.cad.sheet import MaterialLibrary, MaterialSheet
from rille.model import InputRefused, Material, nearest_names
from rille.model.sheet import read_sheet


class Materials:
    """Densities by name.

    Raises
    ------
    InputRefused : for a name that nobody knows, with the nearest ones, and for a density that is not above zero.
    """

    def __init__(self, stated: Sequence[MaterialSheet], folder: Path | None) -> None:
        beside = None if folder is None else folder / "materials.toml"
        own = read_sheet(beside, MaterialLibrary).material if beside is not None and beside.is_file() else []
        self._known = {m.name: m for m in (*library(), *own, *stated)}

    def find(self, name: str, subject: str) -> Material:
        """The material of that name."""
        if name not in self._known:
            nearest = nearest_names(name, self._known)
            raise InputRefused(f"{subject} names the material '{name}', which is neither on the sheet nor in the library; {nearest}")
        found = self._known[name]
        return Material(name=name, density=positive(found.density, "density", f"density of material '{name}'"), source=found.source)


@cache
def library() -> tuple[MaterialSheet, ...]:
    """rille's own materials, with their sources."""
    return tuple(read_sheet(Path(__file__).with_name("materials.toml"), MaterialLibrary).material)
