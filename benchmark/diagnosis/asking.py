"""Diagnosis of the recordings of a database, as ``rille diagnose`` does it, in process."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rille import simulate, store
from rille.diagnosis.diagnose import diagnose
from rille.model.diagnosis import Diagnosis


def diagnose_files(database: Path, training: Sequence[str], held_out: Sequence[str], threads: int = 1, **options: Any) -> Diagnosis:
    """The answer for recordings of a database by name. options : of ``diagnose``."""

    def simulator(scenario: str) -> simulate.Replayer:
        return simulate.Replayer(database, scenario or None, threads=threads)

    recordings = [store.read_recording(database, name) for name in training]
    others = [store.read_recording(database, name) for name in held_out]
    return diagnose(simulator, recordings, others, kinds=store.effect_kinds(), **options)
