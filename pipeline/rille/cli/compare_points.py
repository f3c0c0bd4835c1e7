"""Recordings of a wheel bench against the bench of the model."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rille.model.comparison import Comparison
    from rille.model.recording import Recording


def compare_points(path: Path, recording: "Recording") -> "Comparison":
    """Every point of the recording through the bench that ``bench_rig`` makes of the database and the manifest.

    Raises
    ------
    InputRefused : if wheel or soil are not known, or the points are none.
    """
    from rille.cli.bench_rigs import bench_rig
    from rille.diagnosis.comparison.bench_difference import compare_bench

    rig, notes = bench_rig(path, recording)
    made = compare_bench(
        lambda points: rig.run(points, rig.soil, rig.shape, ()), recording, rig.conditions, model=path.stem, wheel=rig.wheel
    )
    return replace(made, notes=(*made.notes, *notes))
