"""Results keyed by content: named arrays in files that may vanish at any time.

The folder is ``$RILLE_CACHE`` or ``~/.cache/rille``. An entry is one file, written aside and renamed, so that any number of
processes may read and write; one that cannot be read is dropped and made anew. Where the folder cannot be written, a
temporary one serves this process.
"""

import atexit
import contextlib
import functools
import hashlib
import os
import shutil
import tempfile
import zipfile
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille import __version__

Arrays = dict[str, NDArray[Any]]

LIMIT = 2 * 1024**3  # [byte]; above it, what was not used for longest goes first


@functools.cache
def version() -> str:
    """What the results depend on besides the key: release, OCCT and the code that computes them.

    A child process takes it from its parent (``$RILLE_CACHE_VERSION``): both mean the same entries even while code is edited.
    """
    given = os.environ.get("RILLE_CACHE_VERSION")
    if given:
        return given
    code = hashlib.sha256()
    for file in sorted(Path(__file__).parent.parent.rglob("*.py")):
        code.update(file.read_bytes())
    try:
        kernel = metadata.version("cadquery-ocp")
    except metadata.PackageNotFoundError:
        kernel = "unknown"
    return f"rille {__version__} ocp {kernel} code {code.hexdigest()}"


def folder() -> Path:
    """The folder in use; it exists and can be written."""
    if _abandoned:
        return _temporary()
    wanted = os.environ.get("RILLE_CACHE")
    try:
        return _usable(Path(wanted) if wanted else Path.home() / ".cache" / "rille")
    except RuntimeError:  # no home
        return _temporary()


def abandon() -> bool:
    """Use a temporary folder from now on, since the cache is full; False if that is in use already."""
    if folder() == _temporary():
        return False
    _abandoned.append(True)
    return True


_abandoned: list[bool] = []


@functools.cache
def _usable(wanted: Path) -> Path:
    try:
        wanted.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=wanted, prefix="probe-") as probe:
            probe.write(bytes(4096))
    except OSError:
        return _temporary()
    return wanted


@functools.cache
def _temporary() -> Path:
    made = tempfile.mkdtemp(prefix="rille-cache-")
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return Path(made)


def _file(key: str) -> Path:
    name = hashlib.sha256(f"{version()}\n{key}".encode()).hexdigest()
    return folder() / name[:2] / f"{name}.npz"


def get(key: str) -> Arrays | None:
    """The arrays that were put under a key by this version; None if there are none (any more)."""
    path = _file(key)
    try:
        with np.load(path, allow_pickle=False) as entry:
            arrays = {name: entry[name] for name in entry.files}
        os.utime(path)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        drop(key)
        return None
    return arrays


def put(key: str, arrays: Arrays) -> bool:
    """Keep named arrays under a key; False if they could not be kept (a full disk), which is no error."""
    path = _file(key)
    aside = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix="aside-", suffix=".npz", delete=False) as file:
            aside = Path(file.name)
            np.savez(file, **arrays)  # type: ignore[arg-type]
        aside.replace(path)
    except OSError:
        if aside is not None:
            with contextlib.suppress(OSError):
                aside.unlink()
        return False
    return True


def has(key: str) -> bool:
    """Is there an entry? It may still turn out to be broken."""
    return _file(key).is_file()


def drop(key: str) -> None:
    """Forget a key."""
    with contextlib.suppress(OSError):
        _file(key).unlink()


def size() -> int:
    """Bytes in the cache."""
    return sum(bytes_ for _, bytes_, _ in _entries())


def clear() -> None:
    """Forget everything."""
    for _, _, path in _entries():
        with contextlib.suppress(OSError):
            path.unlink()


def prune(limit: int = LIMIT) -> None:
    """Forget what was not used for longest until at most ``limit`` bytes are left."""
    entries = _entries()
    excess = sum(bytes_ for _, bytes_, _ in entries) - limit
    for _, bytes_, path in sorted(entries):
        if excess <= 0:
            return
        with contextlib.suppress(OSError):
            path.unlink()
            excess -= bytes_


def _entries() -> list[tuple[float, int, Path]]:
    """(time of last use, bytes, file) of every entry."""
    found = []
    for path in folder().glob("??/*.npz"):
        with contextlib.suppress(OSError):
            stat = path.stat()
            found.append((stat.st_mtime, stat.st_size, path))
    return found
