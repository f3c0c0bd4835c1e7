"""The child process that reads, weighs and tessellates: ``python -m rille.cad.files.read_process PIPE``, its job on stdin.

See :mod:`rille.cad.files.child` for what it says, :mod:`rille.cad.files.reading` for who asks.
"""

import contextlib
import ctypes
import json
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rille.cad.files import saved
from rille.cad.files.limits import mesh_limit, read_limit
from rille.model import InputRefused

Say = Callable[..., None]

MEMORY = 0.8  # of the machine's memory that a child may take


def read(path: Path, n_bytes: int, face_names: bool, say: Say) -> dict[str, Any]:
    """Read a STEP file; shapes and weights go into the cache, the rest is the result."""
    import OCP  # noqa: F401  # pyright: ignore[reportMissingImports]

    from rille.cad.files.step_reader import read_step

    allow(read_limit(n_bytes), say)
    return saved.plain(read_step(path, progress=lambda what, at: say(say=what, at=at), make=saved.keep, face_names=face_names))


def read_all(files: list[dict[str, Any]], say: Say) -> None:
    """Read STEP files one after the other; all that they hold goes into the cache. One that is refused is left out."""
    for done, file in enumerate(files):
        path = Path(file["path"])

        def heard(*, done: int = done, **message: Any) -> None:
            if "say" in message:
                message["at"] = (done + message["at"]) / len(files)
            say(**message)

        heard(say=f"reading {path.name}", at=0.0)
        with contextlib.suppress(InputRefused):
            saved.keep_structure(file["key"], read(path, file["bytes"], True, heard))


def run_script(path: Path, say: Say) -> dict[str, Any]:
    """Run a CadQuery script and read the assembly that its ``build()`` returns."""
    from rille.cad.files.script_reader import read_script

    allow(None, say)  # a script may build for as long as it likes
    say(say=f"running {path.name}", at=0.0)
    return saved.plain(read_script(path, progress=lambda what, at: say(say=what, at=at), make=saved.keep))


def mesh(parts: list[dict[str, Any]], tolerance: float, say: Say) -> None:
    """Tessellate parts that are in the cache."""
    import OCP  # noqa: F401  # pyright: ignore[reportMissingImports]

    for done, part in enumerate(parts):
        allow(mesh_limit(part["bytes"]), say)
        say(say=f"meshing {part['name']}", at=done / len(parts))
        saved.keep_mesh(part["digest"], tolerance)


def allow(seconds: float | None, say: Say) -> None:
    """End this process when it has used that many more seconds of processor time; None: no end."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    soft = hard if seconds is None else int(used.ru_utime + used.ru_stime + max(seconds, 1.0))
    resource.setrlimit(resource.RLIMIT_CPU, (soft if hard < 0 or soft < 0 else min(soft, hard), hard))
    say(allow=seconds)


def do(job: dict[str, Any], say: Say) -> dict[str, Any]:
    """Do one job; the message that answers it."""
    try:
        if job["do"] == "read":
            return {"done": read(Path(job["path"]), job["bytes"], job["face_names"], say)}
        if job["do"] == "read all":
            return {"done": read_all(job["files"], say)}
        if job["do"] == "script":
            return {"done": run_script(Path(job["path"]), say)}
        return {"done": mesh(job["parts"], job["tolerance"], say)}
    except InputRefused as refusal:
        return {"refused": str(refusal)}
    except saved.CacheFull as full:
        return {"full": str(full)}
    except MemoryError:
        return {"refused": f"{job['subject']} needs more memory than this machine has; simplify it in CAD, or export it again"}
    except Exception as error:
        if type(error).__module__.startswith("OCP"):
            kind = type(error).__name__.removeprefix("Standard_")
            return {"refused": f"{job['subject']} cannot be used: OCCT reports {kind}; check the geometry in CAD and export it again"}
        return {"bug": "".join(traceback.format_exception(error))}


def guard() -> None:
    """Die at once on Ctrl-C and with the parent; take at most a share of the memory; leave no core file."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG of Linux
    with contextlib.suppress(OSError, ValueError):
        memory = int(MEMORY * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (memory if hard < 0 else min(memory, hard), hard))


def main(number: str) -> None:
    """Do the job on stdin; answer on the pipe with that number."""
    guard()
    with os.fdopen(int(number), "w", encoding="utf-8") as pipe:

        def say(**message: Any) -> None:
            pipe.write(json.dumps(message) + "\n")
            pipe.flush()

        say(**do(json.load(sys.stdin), say))


if __name__ == "__main__":
    main(sys.argv[1])
