"""Where evaluated ground and tables are kept: ``$RILLE_CACHE/terrain``, else ``~/.cache/rille/terrain``.

All of it may vanish at any time.
"""

import functools
import hashlib
import os
from pathlib import Path

from rille import __version__, _terrain  # pyright: ignore[reportMissingModuleSource]
from rille.terrain.register import library_folder


def folder() -> Path:
    """The folder; it need not exist.

    Raises
    ------
    RuntimeError : if there is no home.
    """
    wanted = os.environ.get("RILLE_CACHE")
    return (Path(wanted) if wanted else Path.home() / ".cache" / "rille") / "terrain"


def writable() -> Path | None:
    """The folder, made if it is absent; None where that cannot be."""
    try:
        found = folder()
        found.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return found if os.access(found, os.W_OK) else None


@functools.cache
def version() -> str:
    """What results depend on besides the scene: release, and the code that evaluates, compiled code included."""
    code = hashlib.sha256()
    package = Path(__file__).parent
    for place in (package, package.parent / "model", library_folder(), Path(_terrain.__file__)):
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            code.update(f"{file.name} {file.stat().st_mtime_ns} {file.stat().st_size}".encode())
    return f"rille {__version__} {code.hexdigest()[:16]}"
