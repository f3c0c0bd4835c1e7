"""Bench points <-> rows of table ``bench_point``."""

from pathlib import Path

import numpy as np

from rille.model import BenchPoints, BenchWheel
from rille.store.database import insert, writing


def write_bench(
    path: Path,
    name: str,
    method: str,
    soil: str,
    response: str,
    wheel: BenchWheel,
    points: BenchPoints,
    status: tuple[str, ...] | None = None,
) -> None:
    """Append points to the series ``name``. Use ``drop_bench`` first to replace it."""
    with writing(path) as connection:
        for k in range(len(points)):
            row = {"bench": name, "method": method, "soil": soil, "response": response, "radius": wheel.radius, "width": wheel.width}
            row |= {c: float(getattr(points, c)[k]) for c in ("load", "slip_ratio", "slip_angle")}
            for c in ("sinkage", "drawbar_pull", "side_force", "drive_torque"):
                value = float(getattr(points, c)[k])
                row[c] = None if np.isnan(value) else value
            row["status"] = "done" if status is None else status[k]
            insert(connection, "bench_point", f"point {k} of bench '{name}'", row)


def drop_bench(path: Path, name: str) -> None:
    """Remove a series; one that is not there is no error."""
    with writing(path) as connection:
        connection.execute("DELETE FROM bench_point WHERE bench = ?", (name,))
