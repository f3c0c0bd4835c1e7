"""Batches of a table (Arrow) -> pieces."""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused
from rille.model.recording import Array
from rille.recording.reading.piece import NO_TIME, ROW, Labels, Piece, Wanted, timed

if TYPE_CHECKING:
    import pyarrow as pa


def pieces_of(batch: "pa.RecordBatch", wanted: Wanted, row: int, done: float, file: str) -> Iterator[Piece]:
    """The samples of a batch whose first row has the number ``row``, clock by clock.

    A row whose time and values are all empty (null or NaN) is no sample of that clock.

    Raises
    ------
    InputRefused : for a column that holds no numbers.
    """
    columns = {name: batch.column(name) for name in batch.schema.names}
    labels = {name: labels_of(columns[name]) for name in wanted.labels}
    for clock, names in wanted.clocks.items():
        values = {name: numbers_of(columns[name], name, row, file) for name in names}
        tick = None
        if clock == ROW:
            time = np.arange(row, row + len(batch), dtype=float)
        else:
            time = times_of(columns[clock], clock, file)
            tick = 1e-9 if dated(columns[clock]) else None
        piece = Piece(clock=clock, row=row, time=time, values=values, labels=labels, tick=tick, done=done)
        given = timed(time)
        if given.all():
            yield piece
        else:
            yield piece.only(np.flatnonzero(np.logical_or.reduce([given, *(~np.isnan(value) for value in values.values())])))


def dated(column: "pa.Array") -> bool:
    """Whether a column holds time stamps with a date, or durations."""
    import pyarrow as pa

    return pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type)


def times_of(column: "pa.Array", name: str, file: str) -> NDArray[np.float64] | NDArray[np.int64]:
    """Times as written; time stamps with a date become int64 [ns]. ``NO_TIME`` or NaN where there is none."""
    import pyarrow as pa

    if dated(column):
        fine = pa.duration("ns") if pa.types.is_duration(column.type) else pa.timestamp("ns", column.type.tz)
        column = column.cast(fine, safe=False).cast(pa.int64())
    if pa.types.is_int64(column.type):
        return (column.fill_null(NO_TIME) if column.null_count else column).to_numpy(zero_copy_only=False)
    return numbers_of(column, name, 0, file)


def numbers_of(column: "pa.Array", name: str, row: int, file: str) -> Array:
    """A column as float64; null is NaN."""
    import pyarrow as pa

    if pa.types.is_float64(column.type) and not column.null_count:
        return column.to_numpy(zero_copy_only=False)
    numeric = ("is_floating", "is_integer", "is_boolean", "is_decimal", "is_null")
    if not any(getattr(pa.types, kind)(column.type) for kind in numeric):
        raise InputRefused(f"column '{name}' of '{file}' holds {column.type}, no numbers ({_example(column)}, row {row + 1})")
    return column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)


def _example(column: Any) -> str:
    return f"'{column[0].as_py()}'" if len(column) else "it is empty"


def labels_of(column: "pa.Array") -> Labels:
    """A column as labels; whole numbers are written without a point."""
    import pyarrow as pa

    encoded = column if pa.types.is_dictionary(column.type) else column.dictionary_encode()
    known = tuple(label_text(value) for value in encoded.dictionary.to_pylist())
    return Labels(code=encoded.indices.cast(pa.int64()).fill_null(-1).to_numpy(zero_copy_only=False), known=known)


def label_text(value: object) -> str:
    """A value as it appears in names and is compared with the manifest: ``3.0`` is "3", as number and as text."""
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    if isinstance(value, str) and re.fullmatch(r"-?\d+\.0+", value):
        return value.partition(".")[0]
    return str(value)
