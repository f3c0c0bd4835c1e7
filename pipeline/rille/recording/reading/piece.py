"""What every reader yields: samples of one clock, piece by piece, in bounded memory."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused, nearest_names
from rille.model.recording import Array

ROW = "number of the row"  # clock of rows without a time: steady points
NO_TIME = int(np.iinfo(np.int64).min)  # stands for the time of a sample that has none, where times are whole numbers; else NaN does


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """A column of labels: the value of sample k is ``known[code[k]]``. code : (n,) int; -1: none."""

    code: NDArray[np.int64]
    known: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Consecutive samples of one clock.

    row : number of the first sample of the clock, or of the first row of a table, from 0. time : (n,) as written. values : (n,) of each
    column as written, NaN where there is none. tick : [s] unit of the time, where the source knows it. begin : first stamp of the whole
    source, where pieces of several clocks alternate. places : (n,) which rows behind the first the samples are, where not all rows are
    samples of this clock. done : part of the source that was read, 0 to 1.
    """

    clock: str
    row: int
    time: NDArray[np.float64] | NDArray[np.int64]
    values: Mapping[str, Array]
    labels: Mapping[str, Labels] = field(default_factory=dict)
    tick: float | None = None
    begin: int | None = None
    places: NDArray[np.intp] | None = None
    done: float = 0.0

    def number(self, k: int) -> int:
        """Number of the row that holds sample k, from 0."""
        return self.row + (k if self.places is None else int(self.places[k]))

    def only(self, chosen: NDArray[np.intp]) -> "Piece":
        """Those samples only: their places, (n,)."""
        return replace(
            self,
            time=self.time[chosen],
            values={name: value[chosen] for name, value in self.values.items()},
            labels={name: Labels(code=label.code[chosen], known=label.known) for name, label in self.labels.items()},
            places=chosen if self.places is None else self.places[chosen],
        )


def timed(time: NDArray[np.float64] | NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) whether each sample has a time. time : (n,) as in a piece."""
    return time != NO_TIME if np.issubdtype(time.dtype, np.integer) else np.isfinite(time)


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
