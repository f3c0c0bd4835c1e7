"""A scene file that is edited by commands: replaced whole or not at all, and every state that it ever had is kept."""

import contextlib
import fcntl
import hashlib
import json
import os
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rille.model import InputRefused

PATIENCE = 10.0  # [s] to wait for another command that edits the same file
HAND = "edited by hand"


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A state of the file. digest : SHA-256 of its bytes. what : the edit that led to it. time : UTC, ISO 8601."""

    digest: str
    what: str
    time: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Journal:
    """States in the order in which they were made, and which one the file is in. Nothing is ever taken out.

    An edit after an undo does not drop what was undone: the state that the edit starts from is put on the end again, then the new
    one, so that going back passes through every state.
    """

    states: tuple[State, ...] = ()
    at: int = -1

    def then(self, *new: State) -> "Journal":
        """With new states after the present one."""
        back = () if self.at == len(self.states) - 1 else (self.states[self.at],)
        states = (*self.states, *back, *new)
        return Journal(states=states, at=len(states) - 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Edited:
    """What came of an edit. what : done, undone or done again, one for each step; none if nothing changed. undo, redo : steps left."""

    what: tuple[str, ...]
    undo: int
    redo: int


def folder_of(file: Path) -> Path:
    """Folder with the history of a file, beside it: ``.scene.toml.history``."""
    return file.with_name(f".{file.name}.history")


def edit(file: Path, what: Callable[[str], tuple[str, str]], check: Callable[[Path], Any]) -> Edited:
    """Replace a file by an edited one.

    Everything that can fail is done before: the new text is written beside the file, checked there, and brought to disk with its
    state and journal; then the file is replaced by renaming. A crash leaves the old file or the new one.

    Parameters
    ----------
    what : text -> (new text, what was done in words). check : refuses a file that is no good.

    Raises
    ------
    InputRefused : by ``what`` and ``check``; if the file is missing, changed meanwhile, is being edited by another command, or cannot
        be written. The file is as it was then.
    """
    file = _present(file)
    with _locked(file):
        before = _read(file)
        journal = _caught_up(file, before)
        text, done = what(_decoded(before, file))
        after = text.encode("utf-8")
        if after == before:
            return _edited(journal, ())
        journal = journal.then(_state(after, done))
        _replace(file, before, after, journal, check)
    return _edited(journal, (done,))


def step(file: Path, steps: int) -> Edited:
    """Go back (steps < 0) or forward again through the states of a file; edits made by hand are states, too.

    Raises
    ------
    InputRefused : if there are not so many states, or as of :func:`edit`.
    """
    file = _present(file)
    with _locked(file):
        before = _read(file)
        journal = _caught_up(file, before)
        target = journal.at + steps
        if not 0 <= target < len(journal.states):
            left = journal.at if steps < 0 else len(journal.states) - 1 - journal.at
            verb = "undo" if steps < 0 else "redo"
            raise InputRefused(f"'{file}' has {_edits(left)} to {verb}, not {abs(steps)}; take a smaller number")
        passed = journal.states[target + 1 : journal.at + 1][::-1] if steps < 0 else journal.states[journal.at + 1 : target + 1]
        kept = folder_of(file) / f"{journal.states[target].digest}.toml"
        try:
            after = kept.read_bytes()
        except OSError as error:
            raise InputRefused(f"the state of '{file}' to go to cannot be read: '{kept}': {error.strerror}; take another number") from None
        if hashlib.sha256(after).hexdigest() != kept.stem:
            raise InputRefused(f"the state of '{file}' to go to was changed on disk: '{kept}'; take another number")
        journal = Journal(states=journal.states, at=target)
        _replace(file, before, after, journal, lambda path: None)
    return _edited(journal, tuple(state.what for state in passed))


def create(file: Path, text: str, check: Callable[[Path], Any]) -> None:
    """Write a new file, checked, whole or not at all.

    Raises
    ------
    InputRefused : if the file exists already (it is left alone), does not pass, or cannot be written.
    """
    beside = file.with_name(f".{file.name}.new")
    if os.path.lexists(file):
        raise InputRefused(f"'{file}' exists already; choose another name, or remove it first")
    with _saying("written", file):
        _write(beside, text.encode("utf-8"), None)
    try:
        _checked(check, beside, file)
        with _saying("written", file):
            try:
                os.link(beside, file)  # unlike a rename, never overwrites
            except FileExistsError:
                raise InputRefused(f"'{file}' was made by someone else just now; choose another name") from None
            except OSError:  # a file system without links
                beside.replace(file)
            _settle(file.parent)
    finally:
        beside.unlink(missing_ok=True)


def read_journal(file: Path) -> Journal:
    """The history of a file; empty if it has none.

    Raises
    ------
    InputRefused : if it cannot be read.
    """
    path = folder_of(file) / "journal.json"
    try:
        content = json.loads(path.read_bytes())
        journal = Journal(states=tuple(State(**state) for state in content["states"]), at=int(content["at"]))
        if not 0 <= journal.at < len(journal.states):
            raise ValueError("it points at no state")
        return journal
    except FileNotFoundError:
        return Journal()
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputRefused(
            f"the history of '{file}' cannot be read ({path}: {error}); move the folder '{path.parent}' away to begin a new one; the scene "
            "itself is as it was"
        ) from None


def _edits(count: int) -> str:
    return "no edit" if count == 0 else f"{count} edit{'s' if count > 1 else ''}"


def _edited(journal: Journal, what: tuple[str, ...]) -> Edited:
    return Edited(what=what, undo=journal.at, redo=len(journal.states) - 1 - journal.at)


def _present(file: Path) -> Path:
    if not file.is_file():
        raise InputRefused(f"there is no scene '{file}'; `rille terrain new {file}` writes one")
    return file.resolve() if file.is_symlink() else file  # a link stays a link: what it points at is edited


def _state(content: bytes, what: str) -> State:
    return State(digest=hashlib.sha256(content).hexdigest(), what=what, time=datetime.now(UTC).isoformat(timespec="seconds"))


def _caught_up(file: Path, content: bytes) -> Journal:
    """The journal, with what was done to the file since by other means as one more state."""
    journal = read_journal(file)
    found = _state(content, HAND if journal.states else "as it was found")
    if journal.states and journal.states[journal.at].digest == found.digest:
        return journal
    journal = journal.then(found) if journal.states else Journal(states=(found,), at=0)
    with _saying("kept in its history", file):
        _keep(file, content)
    return journal


def _keep(file: Path, content: bytes) -> None:
    """Put a state on disk, under its digest."""
    kept = folder_of(file) / f"{hashlib.sha256(content).hexdigest()}.toml"
    if not kept.is_file():
        part = kept.with_suffix(".part")
        _write(part, content, None)
        part.replace(kept)


def _replace(file: Path, before: bytes, after: bytes, journal: Journal, check: Callable[[Path], Any]) -> None:
    beside, folder = file.with_name(f".{file.name}.new"), folder_of(file)
    states = [{"digest": s.digest, "what": s.what, "time": s.time} for s in journal.states]
    try:
        with _saying("written", file):
            _write(beside, after, file.stat())
        _checked(check, beside, file)
        with _saying("written", file):
            _keep(file, after)
            _write(folder / "journal.part", json.dumps({"at": journal.at, "states": states}, indent=1).encode(), None)
            _settle(folder)
            if _read(file) != before:
                raise InputRefused(f"'{file}' was changed by someone else just now; nothing was written; look at it and try again")
            beside.replace(file)
            (folder / "journal.part").replace(folder / "journal.json")
            _settle(file.parent)
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)


def _checked(check: Callable[[Path], Any], beside: Path, file: Path) -> None:
    """Check what would become the file; sentences name the file."""
    try:
        check(beside)
    except InputRefused as refused:
        refused.args = (str(refused).replace(str(beside), str(file)),)
        raise


def _write(path: Path, content: bytes, like: os.stat_result | None) -> None:
    """Write bytes and bring them to disk; with the mode and the owner of another file. What was begun is removed if that fails."""
    try:
        with path.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
            if like is not None:
                os.fchmod(stream.fileno(), stat.S_IMODE(like.st_mode))
                if (like.st_uid, like.st_gid) != (os.geteuid(), os.getegid()):
                    with contextlib.suppress(PermissionError):
                        os.fchown(stream.fileno(), like.st_uid, like.st_gid)
    except OSError:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
        raise


def _settle(folder: Path) -> None:
    """Bring renames in a folder to disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise InputRefused(f"'{file}' cannot be read: {error.strerror}") from None


def _decoded(content: bytes, file: Path) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputRefused(f"'{file}' is not UTF-8 text: {error}") from None


@contextmanager
def _saying(verb: str, file: Path) -> Iterator[None]:
    """Troubles with the disk as a sentence."""
    try:
        yield
    except OSError as error:
        trouble = error.strerror or error
        fix = "copy it to a folder of yours" if isinstance(error, PermissionError) else "make room, or choose another folder"
        raise InputRefused(f"'{file}' cannot be {verb} ({trouble}); nothing was changed; {fix}") from None


@contextmanager
def _locked(file: Path) -> Iterator[None]:
    """Only one command at a time edits a file; the lock falls with the process that holds it."""
    folder = folder_of(file)
    with _saying("edited", file):
        folder.mkdir(exist_ok=True)
        ignore = folder / ".gitignore"
        if not ignore.exists():
            ignore.write_text("*\n")
        lock = (folder / "lock").open("a")
    with lock:
        end = time.monotonic() + PATIENCE
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError:
                if time.monotonic() > end:
                    raise InputRefused(f"another command is editing '{file}'; nothing was written; try again when it is done") from None
                time.sleep(0.05)
        yield
