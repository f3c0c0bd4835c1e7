"""Recordings as tables: CSV and Parquet."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Recording
from rille.recording.writing.address import Address

ROWS = 65536  # of a piece
Array = NDArray[np.float64]


def write_table(path: Path, recording: Recording, units: Mapping[str, tuple[str, float]]) -> dict[str, Address]:
    """One column per channel, and one with the stamps [s] of every clock: ``time``, or ``time_CLOCK`` where there are several.

    Columns of clocks with fewer samples end earlier: their last cells are empty. Missing samples are empty cells, too. Numbers are written
    so that they are read back bit by bit. units : channel -> (unit, factor to SI).
    """
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    times = {channel.clock: channel.time for channel in recording.channels}
    stamps = {clock: "time" if len(times) == 1 else f"time_{clock}" for clock in times}
    columns: dict[str, Array] = {}
    addresses = {}
    for clock, name in stamps.items():
        columns[name] = times[clock]
        for channel in recording.channels:
            if channel.clock == clock:
                unit, factor = units[channel.name]
                columns[channel.name] = channel.value if factor == 1 else channel.value / factor
                addresses[channel.name] = Address(column=channel.name, time=name, unit=unit, factor=factor)
    n = max((len(column) for column in columns.values()), default=0)
    schema = pa.schema([(name, pa.float64()) for name in columns])
    write = pyarrow.parquet.ParquetWriter if path.suffix.lower() == ".parquet" else pyarrow.csv.CSVWriter
    with write(str(path), schema) as writer:
        for begin in range(0, max(n, 1), ROWS):
            rows = min(ROWS, n - begin)
            writer.write_table(pa.table([_cells(column, begin, rows) for column in columns.values()], schema=schema))
    return addresses


def _cells(column: Array, begin: int, rows: int):
    """Cells of ``rows`` rows; empty where a value is NaN or the column has ended."""
    import pyarrow as pa

    piece = np.full(rows, np.nan)
    part = column[begin : begin + rows]
    piece[: len(part)] = part
    return pa.array(piece, from_pandas=True)
