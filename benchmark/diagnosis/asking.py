"""Diagnosis of the recordings of a database, as ``rille diagnose`` does it, in process."""

from collections.abc import Sequence
from pathlib import Path

from rille import simulate, store
from rille.cli.bench_rigs import bench_rig
from rille.diagnosis.bench.bench_diagnosis import diagnose_bench
from rille.diagnosis.diagnose import Options, diagnose
from rille.diagnosis.hypotheses.candidates import of_kind
from rille.model.diagnosis import Diagnosis


def diagnose_files(
    database: Path, training: Sequence[str], held_out: Sequence[str] = (), *, without: Sequence[str] = (), threads: int = 1
) -> Diagnosis:
    """The answer for recordings of a database by name. without : kinds, causes or targets of hypotheses that are left out."""
    kinds = store.effect_kinds()
    recordings, others = ([store.read_recording(database, name) for name in names] for names in (training, held_out))
    if recordings[0].kind == "points":
        rigs, aside = ([bench_rig(database, recording)[0] for recording in part] for part in (recordings, others))
        return diagnose_bench(rigs, aside, kinds=kinds, model=str(database), chosen=lambda each: of_kind(each, without=without))
    options = Options(without=tuple(without))

    def simulator(scenario: str) -> simulate.Replayer:
        return simulate.Replayer(database, scenario or None, threads=threads)

    return diagnose(simulator, recordings, others, kinds=kinds, options=options)
