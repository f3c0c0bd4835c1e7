"""Which recordings of a database are meant, and under which gravity they were made."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rille.model.rover import Vector

MEANT = "default: all; 'acrobot', like 'acrobot/*', stands for all parts of a split."


def chosen_recordings(known: Sequence[str], wanted: Sequence[str] | None, database: Path) -> list[str]:
    """Names out of ``known``, each once: as written, else all parts of a split of that name, else all that fit a pattern; none wanted: all.

    Raises
    ------
    InputRefused : if the database holds none, or none fits.
    """
    from rille.model import InputRefused, nearest_names

    if not known:
        raise InputRefused(f"'{database}' holds no recording; bring one in: `rille import MANIFEST.toml -o {quote(str(database))}`")
    chosen: dict[str, None] = {}
    for name in wanted or known:
        fitting = [name] if name in known else [other for other in known if other.startswith(f"{name}/") or fnmatchcase(other, name)]
        if not fitting:
            raise InputRefused(f"'{database}' has no recording '{name}'; {nearest_names(name, known)}")
        chosen |= dict.fromkeys(fitting)
    return list(chosen)


def gravity_of(database: Path, scenario: str | None) -> "Vector | None":
    """[m/s^2] of a recording's scenario; None: it states none, or the database has it no more."""
    from rille import store

    return store.read_scenario(database, scenario).gravity if scenario in store.scenario_names(database) else None
