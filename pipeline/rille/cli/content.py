"""Digests of what the results of a diagnosis depend on."""

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rille.model.recording import Recording

CODE = ("model", "simulate", "recording", "diagnosis")  # packages that make the numbers


def recording_digest(recording: "Recording") -> str:
    """SHA-256 of a recording: its samples, and all that is said of its channels."""
    import numpy as np

    found = hashlib.sha256(repr((recording.name, recording.kind, recording.scenario, sorted(recording.setup.items()))).encode())
    for channel in recording.channels:
        described = [getattr(channel, name) for name in channel.__dataclass_fields__ if name not in ("time", "value")]
        found.update(repr(described).encode())
        for samples in (channel.time, channel.value):
            found.update(np.ascontiguousarray(samples, dtype="<f8").tobytes())
    return found.hexdigest()


@cache
def code_digest(packages: tuple[str, ...] = CODE) -> str:
    """SHA-256 of the code that replays and diagnoses, compiled solver included. packages : those that count; () : all."""
    import rille

    found = hashlib.sha256()
    root = Path(rille.__file__).parent
    for folder in [root / package for package in packages] or [root]:
        for file in sorted(folder.rglob("*.py")):
            found.update(file.read_bytes())
    solver = find_spec("rille._solver")
    if solver is not None and solver.origin:
        found.update(Path(solver.origin).read_bytes())
    return found.hexdigest()
