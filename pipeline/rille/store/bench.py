"""Bench points <-> rows of table ``bench_point``."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from rille.model import BenchPoints, BenchWheel
from rille.model.bench import CONDITIONS, RESPONSES
from rille.store.database import insert, writing


def write_bench(
    path: Path, name: str, method: str, wheel: BenchWheel, series: Iterable[tuple[str, str, BenchPoints, Sequence[str]]]
) -> None:
    """Keep points under a name, in place of those that it had: all or, if anything fails, none.

    series : (soil, wheel-soil law, points, status of each point).
    """
    with writing(path) as connection:
        connection.execute("DELETE FROM bench_point WHERE bench = ?", (name,))
        for soil, response, points, status in series:
            for k in range(len(points)):
                row = {"bench": name, "method": method, "soil": soil, "response": response, "radius": wheel.radius, "width": wheel.width}
                row |= {c: float(getattr(points, c)[k]) for c in CONDITIONS}
                for c in RESPONSES:
                    value = float(getattr(points, c)[k])
                    row[c] = None if np.isnan(value) else value
                row["status"] = status[k]
                insert(connection, "bench_point", f"point {k} of bench '{name}'", row)
