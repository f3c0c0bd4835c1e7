"""Which recordings of a database are meant."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from shlex import quote

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
