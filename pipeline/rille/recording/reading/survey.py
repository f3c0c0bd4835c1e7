"""A first look into a file: its columns with what they hold at the beginning."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rille.model.csv_form import NO_NUMBER, is_number
from rille.model.errors import InputRefused
from rille.model.recording import Array
from rille.recording.reading import ROW, Wanted, format_of, open_source
from rille.recording.reading.address import number_fields
from rille.recording.reading.csv_file import CsvSource
from rille.recording.reading.dates import DATE
from rille.recording.reading.messages import MessageSource
from rille.recording.reading.parquet_file import ParquetSource

MOST = 200_000  # rows that are looked at
FEW = 50  # distinct numbers that may be labels


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """One column. kind : number, date, text, or other. values : (n,) first numbers (NaN: none). labels : first texts."""

    name: str
    kind: str
    values: Array
    labels: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """One topic: type of its messages, and the first of them (None: there is none)."""

    name: str
    kind: str
    example: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Survey:
    """What a file holds: columns of a table, or topics."""

    format: str
    columns: tuple[Facts, ...] = ()
    topics: tuple[Topic, ...] = ()


def survey(path: Path) -> Survey:
    """Look into a file.

    Raises
    ------
    InputRefused : if it cannot be read.
    """
    if not path.exists():
        raise InputRefused(f"there is no file '{path}'")
    kind = format_of(path)
    source = open_source(path)
    if isinstance(source, MessageSource):
        topics = tuple(Topic(name=name, kind=of, example=source.example(name)) for name, of in sorted(source.topics.items()))
        return Survey(format=kind, topics=topics)
    kinds = _csv_kinds(source) if isinstance(source, CsvSource) else _parquet_kinds(source)  # type: ignore[arg-type]
    numbers = [name for name, of in kinds.items() if of == "number"]
    values = _beginning(source, numbers)
    labels = _texts(source, [name for name, of in kinds.items() if of == "text"])
    return Survey(
        format=kind,
        columns=tuple(
            Facts(name=name, kind=of, values=values.get(name, np.empty(0)), labels=labels.get(name, ())) for name, of in kinds.items()
        ),
    )


def _beginning(source: Any, names: list[str]) -> dict[str, Array]:
    found: dict[str, list[Array]] = {name: [] for name in names}
    rows = 0
    for piece in source.pieces(Wanted(clocks={ROW: tuple(names)})) if names else ():
        for name in names:
            found[name].append(piece.values[name])
        rows += len(piece.time)
        if rows >= MOST:
            break
    return {name: np.concatenate(pieces)[:MOST] if pieces else np.empty(0) for name, pieces in found.items()}


def _texts(source: Any, names: list[str]) -> dict[str, tuple[str, ...]]:
    if not names:
        return {}
    piece = next(iter(source.pieces(Wanted(clocks={ROW: ()}, labels=tuple(names)))))
    used = {name: np.unique(piece.labels[name].code) for name in names}
    return {name: tuple(piece.labels[name].known[code] for code in used[name] if code >= 0)[:FEW] for name in names}


def _csv_kinds(source: CsvSource) -> dict[str, str]:
    form = source.form
    kinds = {}
    for place, name in enumerate(form.columns):
        cells = [row[place] for row in form.rows if len(row) == len(form.columns) and row[place] not in NO_NUMBER]
        if form.columns.count(name) > 1:
            kinds[name] = "other"
        elif cells and DATE.match(cells[0]):
            kinds[name] = "date"
        else:
            kinds[name] = "number" if all(is_number(cell.replace(form.decimal, ".")) for cell in cells) else "text"
    return kinds


def _parquet_kinds(source: ParquetSource) -> dict[str, str]:
    import pyarrow as pa

    kinds = {}
    for column in source.schema:
        of = column.type
        if pa.types.is_floating(of) or pa.types.is_integer(of) or pa.types.is_boolean(of) or pa.types.is_decimal(of):
            kinds[column.name] = "number"
        elif pa.types.is_timestamp(of) or pa.types.is_duration(of):
            kinds[column.name] = "date"
        elif pa.types.is_string(of) or pa.types.is_large_string(of) or pa.types.is_dictionary(of):
            kinds[column.name] = "text"
        else:
            kinds[column.name] = "other"
    return kinds


def message_fields(topic: Topic) -> list[tuple[str, float]]:
    """Numbers of a topic's messages that may be measurements: header and covariances are none. Entries of a JointState are named."""
    names = _names(topic.example)
    found = []
    for field, value in number_fields(topic.example):
        first = field.replace("[", ".").split(".")[0]
        if first in ("header", "name") or "covariance" in field:
            continue
        for key in ("position", "velocity", "effort"):
            if names and field.startswith(f"{key}["):
                field = f"{key}[{names[int(field[len(key) + 1 : -1])]}]"
        found.append((field, value))
    return found


def _names(message: Any) -> list[str]:
    names = message.get("name") if isinstance(message, dict) else getattr(message, "name", None)
    return [str(name) for name in names] if isinstance(names, list | tuple) else []
