"""Results of the stages of a long computation, kept until it is done, so that an interrupted one goes on where it was.

They lie in the user's own cache folder, not beside the database: they are pickled, and a pickle that came along with somebody's database
could run his program.
"""

import hashlib
import pickle
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
KEPT = 8  # computations whose stages are kept


class Stages:
    """``stages(name, compute)`` returns what was kept under a name for the same key, or computes and keeps it.

    found : names that came from an earlier, interrupted computation.
    """

    def __init__(self, key: str, folder: Path | None = None) -> None:
        """key : everything that the results depend on; the same key, the same results. folder : None: below the user's cache."""
        self._root = folder or _cache()
        self._folder = self._root / hashlib.sha256(key.encode()).hexdigest()
        self._values: dict[str, Any] = {}
        self.found: list[str] = []

    def __call__(self, name: str, compute: Callable[[], T]) -> T:
        if name in self._values:
            return self._values[name]
        kept = self._read(name)
        if kept is not None:
            self.found.append(name)
            value = kept[0]
        else:
            value = compute()
            self._write(name, value)
        self._values[name] = value
        return value

    def get(self, name: str) -> Any:
        """What a stage of this computation gave; None if there was none of that name."""
        return self._values.get(name)

    def _file(self, name: str) -> Path:
        return self._folder / f"{hashlib.sha256(name.encode()).hexdigest()[:24]}.pickle"

    def _read(self, name: str) -> tuple[Any] | None:
        with suppress(OSError, EOFError, pickle.PickleError, AttributeError, ImportError, IndexError, TypeError, ValueError):
            return (pickle.loads(self._file(name).read_bytes()),)
        return None

    def _write(self, name: str, value: object) -> None:
        """Keep a value; one that cannot be kept (a full disk, a value that no pickle can hold) is computed again after an interruption."""
        aside = self._file(name).with_suffix(".part")
        with suppress(OSError, pickle.PickleError, TypeError, AttributeError):
            self._folder.mkdir(parents=True, exist_ok=True)
            aside.write_bytes(pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL))
            aside.replace(self._file(name))
            return
        with suppress(OSError):
            aside.unlink()

    def done(self) -> None:
        """The computation came to its end: older ones than the last ``KEPT`` are forgotten."""
        folders = sorted((f for f in self._root.glob("*") if f.is_dir()), key=lambda f: f.stat().st_mtime, reverse=True)
        for folder in folders[KEPT:]:
            shutil.rmtree(folder, ignore_errors=True)

    def forget(self) -> None:
        """Begin anew."""
        shutil.rmtree(self._folder, ignore_errors=True)


def _cache() -> Path:
    from rille.cad.files.cache import folder

    return folder() / "diagnosis"
