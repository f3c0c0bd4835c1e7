"""How a CSV file is written: delimiter, decimal sign, encoding and header, found out from its beginning."""

import csv
import io
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rille.model.errors import InputRefused
from rille.model.quantity import is_unit

HEAD = 1 << 16  # bytes that are looked at
DELIMITERS = (",", ";", "\t", "|")
PREAMBLE = 100  # lines before the header
COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")  # a number with a decimal comma
NO_UNIT = ("", "-", "1", "[-]", "[1]", "[]", "(-)")  # in a line of units
LINE_END = re.compile(r"\r\n|\r|\n")  # str.splitlines knows others, which no reader of tables does
OPENED = re.compile(r'(?:^|[,;\t|])\s*"')  # a cell that begins with a quote
CELL_LINES = 5  # of a name in quotes that holds line ends


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvForm:
    """How a CSV is written. skip : lines before the first row, header included. columns : names; where a line of units stands below them,
    with their unit in brackets. rows : the first rows, as text.
    """

    delimiter: str
    decimal: str
    encoding: str
    skip: int
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def csv_form(path: Path) -> CsvForm:
    """Find out how a CSV is written, from its beginning.

    Lines before the header that begin with ``#`` or ``%`` are comments; the last of them is the header if the table has no other. Other
    words of a logger there have fewer or more delimiters than the table. Names in quotes may hold line ends, which become spaces.

    Raises
    ------
    InputRefused : if it is empty, binary, in UTF-16, or has no header of names.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
    if not head.strip():
        raise InputRefused(f"'{path}' is empty")
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputRefused(f"'{path}' is in UTF-16; save it as UTF-8")
    if b"\0" in head:
        raise InputRefused(f"'{path}' is no text; state its format in the manifest (format = ...), or convert it")
    text, encoding = _decoded(head)
    whole = len(head) < HEAD
    lines = LINE_END.split(text)
    lines = lines if whole else lines[:-1] or lines
    first = next((k for k, line in enumerate(lines) if line.strip() and line.lstrip()[:1] not in "#%"), None)
    if first is None:
        raise InputRefused(f"'{path}' holds comments only")
    first = _header(lines, first)
    named = _commented_header(lines, first)
    if named is not None:
        first, lines[named[0]] = named
    counts = {delimiter: lines[first].count(delimiter) for delimiter in DELIMITERS}
    delimiter = max(counts, key=lambda d: (counts[d], -DELIMITERS.index(d)))
    if not counts[delimiter] and len(lines) > first + 1 and lines[first].count(" ") == lines[first + 1].count(" "):
        delimiter = " "
    reader = csv.reader(io.StringIO("\n".join(lines[first:])), delimiter=delimiter)
    numbered = [(first + reader.line_num, tuple(cell.strip() for cell in row)) for row in reader if any(cell.strip() for cell in row)]
    skip, rows = numbered[0][0], tuple(row for _, row in numbered)
    columns = tuple(re.sub(r"\s*\n\s*", " ", name) or f"column {k + 1}" for k, name in enumerate(rows[0]))
    if all(is_number(name) for name in rows[0]):
        raise InputRefused(
            f"'{path}' has no header: line {first + 1} holds numbers ({', '.join(rows[0][:3])}); write the columns' names above it"
        )
    units = _units(rows[1:])
    if units is not None:
        columns = tuple(f"{name} [{unit}]" if unit and "[" not in name else name for name, unit in zip(columns, units, strict=True))
        skip, rows = numbered[1][0], rows[1:]
    decimal = "," if delimiter != "," and any(COMMA.fullmatch(cell) for row in rows[1:] for cell in row) else "."
    return CsvForm(delimiter=delimiter, decimal=decimal, encoding=encoding, skip=skip, columns=columns, rows=rows[1:])


def _header(lines: Sequence[str], first: int) -> int:
    """Place of the header: below words of a logger about itself, which have other signs than the lines of the table.

    The first line that has as many delimiters as the next; the first of all if there is none, or if it is a row of numbers.
    """
    filled = [(k, line) for k, line in _whole(lines, first, min(len(lines), first + PREAMBLE)) if line.strip()]
    for (here, names), (_, below) in itertools.pairwise(filled):
        for delimiter in DELIMITERS:
            if 0 < names.count(delimiter) == below.count(delimiter):
                return first if _numbers(names, delimiter) else here
    return first


def _whole(lines: Sequence[str], first: int, end: int) -> Iterator[tuple[int, str]]:
    """Lines with their places; those between the quotes of one cell are one."""
    here = first
    while here < end:
        more = 0
        if lines[here].count('"') % 2 and OPENED.search(lines[here]):
            more = next((k for k in range(1, CELL_LINES) if here + k < end and lines[here + k].count('"') % 2), 0)
        yield here, " ".join(lines[here : here + more + 1])
        here += more + 1


def _commented_header(lines: Sequence[str], first: int) -> tuple[int, str] | None:
    """Place and names of the comment above a table that begins with numbers (as of ``numpy.savetxt``); None if there is none."""
    above = next((k for k in range(first - 1, -1, -1) if lines[k].strip()), None)
    if above is None or lines[above].lstrip()[0] not in "#%":
        return None
    names = lines[above].lstrip().lstrip("#%").strip()
    alike = (d for d in (*DELIMITERS, " ") if 0 < names.count(d) == lines[first].count(d))
    return (above, names) if any(_numbers(lines[first], d) and not _numbers(names, d) for d in alike) else None


def _numbers(line: str, delimiter: str) -> bool:
    cells = [cell.strip().replace(",", ".") for cell in line.split(delimiter)]
    return all(not cell or is_number(cell) for cell in cells)


def _units(rows: Sequence[Sequence[str]]) -> tuple[str, ...] | None:
    """Units in the first of the rows, "" of what has none; None if that row is no line of units above numbers."""
    if len(rows) < 2 or len(rows[0]) != len(rows[1]):
        return None
    units = tuple("" if cell in NO_UNIT else cell.strip("[]() ") for cell in rows[0])
    told = [k for k, unit in enumerate(units) if unit]
    below = [rows[1][k].replace(",", ".") for k in told]
    return units if told and all(is_number(cell) for cell in below) and all(is_unit(units[k]) for k in told) else None


def _decoded(head: bytes) -> tuple[str, str]:
    for cut in range(4):  # the last character may be cut
        try:
            return head[: len(head) - cut].decode("utf-8-sig"), "utf8"
        except UnicodeDecodeError:
            continue
    return head.decode("latin-1"), "latin-1"


def is_number(text: str) -> bool:
    """Whether a cell is a number, with a decimal point."""
    try:
        float(text)
    except ValueError:
        return False
    return True
