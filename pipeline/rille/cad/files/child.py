"""Work with OCCT in a child process, so that a crash, a hang or a hunger for memory of it is a sentence, not the end.

The job goes to the child on its standard input; what it says comes back on a pipe of its own, a JSON object a line:
``say`` and ``at`` (progress), ``allow`` (processor seconds from now on), ``done`` (the result), ``refused`` (a sentence),
``full`` (the cache cannot be written), ``bug``.
"""

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import IO, Any

from rille.cad.files import cache
from rille.cad.files.limits import patience
from rille.model import InputRefused

START = 120.0  # [s] that a child may take until it first says how long it needs; times the patience


class ChildDied(RuntimeError):
    """The child ended without an answer. how : end of a sentence. stage : what it was doing. crashed : not by our limit."""

    def __init__(self, how: str, stage: str, *, crashed: bool) -> None:
        super().__init__(f"{how} while {stage}")
        self.how = how
        self.stage = stage
        self.crashed = crashed


def run(job: dict[str, Any], *, progress: Callable[[str, float], None] | None = None, talk: bool = False) -> Any:
    """Have a job (JSON-able, see :mod:`rille.cad.files.read_process`) done by a child; its result.

    progress : called with what is being done and the fraction done. talk : what the job prints goes to stderr.

    Raises
    ------
    InputRefused : as the job does, and when the child cannot start in time. ChildDied : killed by a signal, or by us after its time.
    """
    try:
        return _run(job, progress or (lambda what, fraction: None), talk)
    except _Full as full:
        if not cache.abandon():
            raise InputRefused(f"{full}; set RILLE_CACHE to a folder with room") from full
        return run(job, progress=progress, talk=talk)


class _Full(RuntimeError):
    """The child could not write into the cache."""


def _run(job: dict[str, Any], say: Callable[[str, float], None], talk: bool) -> Any:
    read, write = os.pipe()
    out = sys.stderr.fileno() if talk and _has_number(sys.stderr) else subprocess.DEVNULL
    child = subprocess.Popen(
        [sys.executable, "-m", "rille.cad.files.read_process", str(write)],
        stdin=subprocess.PIPE,
        stdout=out,
        stderr=out,
        pass_fds=(write,),
        env={**os.environ, "RILLE_CACHE": str(cache.folder()), "RILLE_CACHE_VERSION": cache.version()},
    )
    os.close(write)
    try:
        assert child.stdin is not None
        with contextlib.suppress(BrokenPipeError), child.stdin as stdin:
            stdin.write(json.dumps(job).encode())
        with os.fdopen(read, "rb") as pipe:
            return _listen(child, pipe, say)
    finally:
        child.kill()
        child.wait()


def _given_up(allowed: float | None) -> str:
    return "was given up: its processor time is used up" if allowed is None else f"was given up after {allowed:.0f} s"


def _not_started(waited: float) -> InputRefused:
    """Importing the kernel took too long: no file is to blame."""
    return InputRefused(
        f"the CAD reader could not start within {waited:.0f} s; the machine is busy: try again, or set RILLE_PATIENCE=10 to wait ten times "
        "as long"
    )


def _has_number(stream: Any) -> bool:
    try:
        stream.fileno()
    except (OSError, AttributeError, ValueError):
        return False
    return True


def _listen(child: "subprocess.Popen[bytes]", pipe: IO[bytes], say: Callable[[str, float], None]) -> Any:
    start = START * patience()
    stage, allowed, deadline, heard = "starting", start, time.monotonic() + start, False
    os.set_blocking(pipe.fileno(), False)
    rest = b""
    with selectors.DefaultSelector() as selector:
        selector.register(pipe, selectors.EVENT_READ)
        while True:
            if not selector.select(None if deadline is None else max(deadline - time.monotonic(), 0.0)):
                raise ChildDied(_given_up(allowed), stage, crashed=False) if heard else _not_started(start)
            chunk = pipe.read(1 << 20)
            if not chunk:
                break
            heard = True
            *lines, rest = (rest + chunk).split(b"\n")
            for message in map(json.loads, lines):
                if "say" in message:
                    stage = message["say"]
                    say(stage, message["at"])
                elif "allow" in message:
                    allowed = message["allow"]
                    # The child ends itself when its processor time is used up; this is for one that sleeps.
                    deadline = None if allowed is None else time.monotonic() + 3 * allowed + 20
                elif "done" in message:
                    return message["done"]
                elif "refused" in message:
                    raise InputRefused(message["refused"])
                elif "full" in message:
                    raise _Full(message["full"])
                else:
                    raise RuntimeError(message["bug"])
    code = child.wait()
    if code == -signal.SIGXCPU:
        raise ChildDied(_given_up(allowed), stage, crashed=False)
    if code < 0:
        raise ChildDied(f"makes the geometry kernel crash ({signal.Signals(-code).name})", stage, crashed=True)
    raise ChildDied(f"makes the geometry kernel end (exit code {code})", stage, crashed=True)
