"""A room: one folder in which a command runs, and out of which it can read nothing but Python and the system's libraries.

Landlock shuts it where the kernel has it. Else another user runs the command, where the parent is root and that user can reach Python:
files of mode 600 and the parent's memory stay closed, its command line does not. Else nothing protects the truth. ``isolation`` says
which, and the ledger states it.
"""

import ctypes
import json
import os
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import IO, Literal

from rille.model import InputRefused
from rille.model.ledger import AnswerStatus
from rille.model.process import ONE_THREAD
from rille.proof import landlock
from rille.proof.places import KERNEL, OUTWARD, SETTINGS, SYSTEM, python_folders

OTHER_USER = "nobody"
REFUSALS = (3, 4)  # exit codes of `rille`
SHORT = 60.0  # [s] for what takes a moment
NOT_DUMPABLE = (4, 0, 0, 0, 0)  # prctl(PR_SET_DUMPABLE, 0): others of this user cannot read this process


class RoomFailed(RuntimeError):
    """A room could not be shut, or the command not be started in it: one sentence with the reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stay:
    """How a command fared in a room.

    kind : ``done`` with exit ``code``, ``too long``, or ``crashed`` by ``signal``. begun, ended : [s] since 1970-01-01 UTC. seconds : wall
    time [s]. output, errors : what it wrote. isolation : what kept other files from it ("landlock 7", "other user", "none").
    """

    kind: Literal["done", "too long", "crashed"]
    code: int | None
    signal: str
    begun: float
    ended: float
    seconds: float
    output: str
    errors: str
    isolation: str

    @property
    def status(self) -> AnswerStatus:
        """The same in the ledger's words: rille refuses by exit code 3 (input) or 4 (physics)."""
        if self.kind != "done":
            return self.kind
        return "done" if self.code == 0 else "refused" if self.code in REFUSALS else "crashed"


@cache
def isolation() -> str:
    """What a room of this machine is shut by: "landlock N" with its version, "other user", or "none"."""
    have = landlock.version()
    if have:
        return f"landlock {have}"
    return "other user" if os.geteuid() == 0 and _other_user_reaches_python() else "none"


def _other_user_reaches_python() -> bool:
    try:
        command = [sys.executable, "-I", "-c", "import rille.proof.enter"]
        return subprocess.run(command, **_as_other_user(), capture_output=True, timeout=SHORT, cwd="/").returncode == 0
    except (OSError, KeyError, subprocess.TimeoutExpired):
        return False


def _as_other_user() -> dict:
    other = pwd.getpwnam(OTHER_USER)
    return {"user": other.pw_uid, "group": other.pw_gid, "extra_groups": []}


def stay(
    command: Sequence[str | Path],
    folder: Path,
    *,
    limit: float,
    readable: Sequence[Path] = (),
    secrets: Sequence[Path] = (),
    environment: Mapping[str, str] | None = None,
    memory: int | None = None,
) -> Stay:
    """Run a command in a folder that is all it may write and, but for Python and libraries, all it may read.

    command : program and arguments; the program by its path. folder : the room. limit : wall time [s]; then the whole process group is
    killed. readable : more that it may read. secrets : paths that must lie outside all of these. environment : more variables; none of this
    process is handed on. memory : address space [bytes]. Its temporary files go to a folder of its own that is removed.

    Raises
    ------
    InputRefused : if the folder is missing, or a secret lies where the command may read.
    RoomFailed : if the room cannot be shut or the command not be started.
    """
    folder = Path(folder).resolve()
    if not folder.is_dir():
        raise InputRefused(f"the room '{folder}' does not exist; make the folder first")
    read = (*python_folders(), *(Path(path).resolve() for path in readable))
    _refuse_open_secrets(secrets, (folder, *read, *map(Path, SYSTEM)))
    how = isolation()
    if how == "none":
        ctypes.CDLL(None).prctl(*NOT_DUMPABLE)
    with _private_folder() as private:
        if how == "other user":
            _hand_over(folder, private)
        setting = {
            "landlock": how.startswith("landlock"),
            "read": [str(path) for path in (*read, *SYSTEM, *SETTINGS, *KERNEL)],
            "write": [str(folder), str(private), *OUTWARD],
            "memory": memory,
            "parent": os.getpid(),
        }
        with (private / "output").open("w+b") as output, (private / "errors").open("w+b") as errors:
            begun, clock = time.time(), time.monotonic()
            kind, code = _run(command, folder, setting, _environment(private) | dict(environment or {}), limit, output, errors, how)
            seconds = time.monotonic() - clock
            return Stay(
                kind=kind,
                code=code if kind == "done" else None,
                signal=next((s.name for s in signal.Signals if s == -code), str(-code)) if kind == "crashed" else "",
                begun=begun,
                ended=begun + seconds,
                seconds=seconds,
                output=_text(output),
                errors=_text(errors),
                isolation=how,
            )


def _refuse_open_secrets(secrets: Sequence[Path], places: Sequence[Path]) -> None:
    for secret in secrets:
        for place in places:
            if Path(secret).resolve().is_relative_to(place):
                raise InputRefused(f"the secret '{secret}' lies in '{place}', which the room may read; put it elsewhere")


def _environment(private: Path) -> dict[str, str]:
    """All that the command learns of its surroundings: where Python is, that everything private belongs into one folder, and that linear
    algebra has one processor: there are as many rooms as processors.
    """
    own = ("HOME", "TMPDIR", "MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "NUMBA_CACHE_DIR", "RILLE_CACHE")
    return {
        "PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONNOUSERSITE": "1",
        **ONE_THREAD,
        **dict.fromkeys(own, str(private)),
    }


@contextmanager
def _private_folder() -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="rille-room-")).resolve()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _hand_over(*folders: Path) -> None:
    """Give folders and all in them to the other user."""
    other = pwd.getpwnam(OTHER_USER)
    for folder in folders:
        for path in (folder, *folder.rglob("*")):
            os.chown(path, other.pw_uid, other.pw_gid, follow_symlinks=False)


def _run(
    command: Sequence[str | Path],
    folder: Path,
    setting: Mapping[str, object],
    environment: Mapping[str, str],
    limit: float,
    output: IO[bytes],
    errors: IO[bytes],
    how: str,
) -> tuple[Literal["done", "too long", "crashed"], int]:
    """Kind of end and exit code (-signal) of the command behind the door."""
    listen, status = os.pipe()
    door = [sys.executable, "-I", "-m", "rille.proof.enter", json.dumps({**setting, "status": status}), *map(str, command)]
    with os.fdopen(listen, "rb") as said:
        try:
            child = subprocess.Popen(
                door,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                pass_fds=(status,),
                start_new_session=True,
                **(_as_other_user() if how == "other user" else {}),
            )
        except OSError as error:
            raise RoomFailed(f"the room '{folder}' cannot be entered: {error}") from error
        finally:
            os.close(status)
        try:
            code = child.wait(limit)
            kind = "done" if code >= 0 else "crashed"
        except subprocess.TimeoutExpired:
            kind, code = "too long", -signal.SIGKILL
        finally:
            with suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)  # what it left behind ends too
            child.wait()
        wrong = said.read().decode(errors="replace")
    if wrong:
        raise RoomFailed(f"the room '{folder}' could not be shut for '{command[0]}': {wrong}")
    return kind, code


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")
