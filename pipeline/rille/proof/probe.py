"""What can be read from within a room, found out by trying."""

import json
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rille.model import InputRefused
from rille.proof.room import RoomFailed, stay

PATIENCE = 60.0  # [s]
TRY_PATHS = """
import json, os, sys
def attempt(path):
    try:
        if os.path.isdir(path):
            return f"{len(os.listdir(path))} names were listed"
        with open(path, "rb") as file:
            if path.endswith("/mem"):
                return "it was opened"
            return f"{len(file.read(64))} bytes were read"
    except OSError as error:
        return error.errno
print(json.dumps([attempt(path) for path in sys.argv[1:]]))
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """What came of reading a secret from within a room. said : what was read, or why nothing."""

    path: str
    readable: bool
    said: str


def probe(folder: Path, secrets: Sequence[Path], *, readable: Sequence[Path] = ()) -> tuple[Attempt, ...]:
    """Try to read secrets from within a room, and the memory, environment and command line of this process.

    A file that was just put into the room is read too, to show that the attempts mean something.

    Raises
    ------
    InputRefused : if a secret does not exist: then nothing would be shown.
    RoomFailed : if the room's own file cannot be read.
    """
    missing = [path for path in secrets if not Path(path).exists()]
    if missing:
        raise InputRefused(f"the secret '{missing[0]}' does not exist, so that nothing is shown by not reading it; write it first")
    process = [f"/proc/{os.getpid()}/{name}" for name in ("environ", "mem", "cmdline")]
    wanted = [*(str(Path(path).resolve()) for path in secrets), *process]
    with tempfile.NamedTemporaryFile(dir=folder, prefix="probe-") as own:
        own.write(b"seen")
        own.flush()
        Path(own.name).chmod(0o644)
        command = [sys.executable, "-I", "-c", TRY_PATHS, str(Path(own.name).resolve()), *wanted]
        done = stay(command, folder, limit=PATIENCE, readable=readable)
    if done.code != 0:
        raise RoomFailed(
            f"the probe of the room '{folder}' ended with {done.code or done.signal or done.kind}: {done.errors.strip()[-300:]}"
        )
    control, *found = json.loads(done.output)
    if control != "4 bytes were read":
        raise RoomFailed(f"from within the room '{folder}' its own file could not be read ({_said(control)}); look at its rights")
    return tuple(Attempt(path=path, readable=isinstance(one, str), said=_said(one)) for path, one in zip(wanted, found, strict=True))


def _said(found: str | int) -> str:
    return found if isinstance(found, str) else os.strerror(found)
