"""What every reader yields: samples of one clock, piece by piece, in bounded memory."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused, nearest_names
from rille.model.recording import Array

ROW = "number of the row"  # clock of rows without a time: steady points


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """A column of labels: the value of sample k is ``known[code[k]]``. code : (n,) int; -1: none."""

    code: NDArray[np.int64]
    known: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Consecutive samples of one clock.

    row : number of the first sample among those of the clock, from 0. time : (n,) as written. values : (n,) of each column as written, NaN
    where there is none. tick : [s] unit of the time, where the source knows it. begin : first stamp of the whole source, where pieces of
    several clocks alternate. done : part of the source that was read, 0 to 1.
    """

    clock: str
    row: int
    time: NDArray[np.float64] | NDArray[np.int64]
    values: Mapping[str, Array]
    labels: Mapping[str, Labels] = field(default_factory=dict)
    tick: float | None = None
    begin: int | None = None
    done: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What to read. clocks : name of a clock -> columns that it stamps. labels : columns of labels (tables).

    The name of a clock is the column of its time (tables; ``ROW``: the number of the row) or the topic (messages).
    header : messages are stamped by their header, not by the log.
    """

    clocks: Mapping[str, tuple[str, ...]]
    labels: tuple[str, ...] = ()
    header: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns of a table that must be read, each once."""
        values = [name for columns in self.clocks.values() for name in columns]
        return tuple(dict.fromkeys([*(clock for clock in self.clocks if clock != ROW), *values, *self.labels]))


class Source(Protocol):
    """A file of samples. table : rows with columns; else messages of topics."""

    table: bool

    def check(self, columns: Sequence[str]) -> None:
        """Refuse columns that are not there, with the nearest names."""
        ...

    def topic(self, column: str) -> str:
        """Messages: the topic of a column."""
        ...

    def pieces(self, wanted: Wanted) -> Iterator[Piece]:
        """All samples in the order of the file."""
        ...


def refuse_missing(columns: Sequence[str], known: Sequence[str], file: str) -> None:
    """Refuse columns that the file does not have."""
    for column in columns:
        if column not in known:
            raise InputRefused(f"'{file}' has no column '{column}'; {nearest_names(column, known)}")
