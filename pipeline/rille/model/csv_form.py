"""How a CSV file is written: delimiter, decimal sign, encoding and header, found out from its beginning."""

import csv
import io
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rille.model.errors import InputRefused
from rille.model.unit_names import names_unit

HEAD = 1 << 16  # bytes that are looked at
BLOCK = 1 << 20  # bytes at once, where the beginning holds whole numbers only
DELIMITERS = (",", ";", "\t", "|")
PREAMBLE = 100  # lines before the header
COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")  # a number with a decimal comma
POINT = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")  # as spreadsheets write them, in quotes, between commas
NO_NUMBER = ("", "nan", "NaN", "NAN", "-nan", "null", "NULL", "None", "NA", "N/A", "n/a", "#N/A", "-")  # where one is missing
NO_UNIT = ("", "-", "1", "[-]", "[1]", "[]", "(-)")  # in a line of units
LINE_END = re.compile(r"\r\n|\r|\n")  # str.splitlines knows others, which no reader of tables does
QUOTED = re.compile(r'(^|[,;\t|])"(?:[^"]|"")*"(?=[,;\t|]|$)')  # a cell in quotes
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
    _, header = next(_whole(lines, first, len(lines)))
    counts = {delimiter: _count(header, delimiter) for delimiter in DELIMITERS}
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
    decimal = _decimal([cell for row in rows[1:] for cell in row], delimiter)
    if decimal is None:
        decimal = "." if whole else _decimal_beyond(path, delimiter, head.rfind(b"\n") + 1)
    return CsvForm(delimiter=delimiter, decimal=decimal, encoding=encoding, skip=skip, columns=columns, rows=rows[1:])


def _header(lines: Sequence[str], first: int) -> int:
    """Place of the header: below words of a logger about itself, which have other signs than the lines of the table.

    The first line that has as many delimiters as the next; the first of all if there is none, or if it is a row of numbers.
    """
    filled = [(k, line) for k, line in _whole(lines, first, min(len(lines), first + PREAMBLE)) if line.strip()]
    for (here, names), (_, below) in itertools.pairwise(filled):
        for delimiter in DELIMITERS:
            if 0 < _count(names, delimiter) == _count(below, delimiter):
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
    alike = (d for d in (*DELIMITERS, " ") if 0 < _count(names, d) == _count(lines[first], d))
    return (above, names) if any(_numbers(lines[first], d) and not _numbers(names, d) for d in alike) else None


def _count(line: str, delimiter: str) -> int:
    """Delimiters of a line, but for those within the quotes of a cell."""
    return QUOTED.sub(r"\1", line).count(delimiter)


def _numbers(line: str, delimiter: str) -> bool:
    cells = [cell.strip().replace(",", ".") for cell in next(csv.reader([line], delimiter=delimiter), [])]
    return all(not cell or is_number(cell) for cell in cells)


def _decimal(cells: Sequence[str], delimiter: str) -> str | None:
    """Decimal mark of the cells; None if all numbers are whole. Between commas as delimiters, a comma may stand for thousands."""
    commas = [cell for cell in cells if COMMA.fullmatch(cell)]
    points = any(POINT.fullmatch(cell) for cell in cells)
    if delimiter == "," and (points or all(THOUSANDS.fullmatch(cell) for cell in commas)):
        commas = []
    return "," if commas else "." if points else None


def _decimal_beyond(path: Path, delimiter: str, begin: int) -> str:
    """Decimal mark of the first number that has one, from a byte on; a point if all numbers are whole. begin : of a line."""
    if delimiter == ",":
        return "."
    edge = re.escape(delimiter)
    number = re.compile(rf'(?:^|["{edge}\r\n]) *[-+]?\d*([.,])\d+(?:[eE][-+]?\d+)? *(?:["{edge}\r\n]|$)'.encode())
    with path.open("rb") as file:
        file.seek(begin)
        while block := file.read(BLOCK) + file.readline():
            if found := number.search(block):
                return found[1].decode()
    return "."


def _units(rows: Sequence[Sequence[str]]) -> tuple[str, ...] | None:
    """Units in the first of the rows, "" of what has none; None if that row is no line of units above numbers.

    At least half of the words above numbers must be units; the others are taken for units that rille does not know.
    """
    if len(rows) < 2 or len(rows[0]) != len(rows[1]):
        return None
    units = tuple("" if cell in NO_UNIT else cell.strip("[]() ") for cell in rows[0])
    told = [k for k, unit in enumerate(units) if unit]
    above_numbers = all(is_number(rows[1][k].replace(",", ".")) for k in told)
    if not told or not above_numbers or any(units[k] in NO_NUMBER or is_number(units[k]) for k in told):
        return None
    return units if 2 * sum(names_unit(units[k]) for k in told) >= len(told) else None


def _decoded(head: bytes) -> tuple[str, str]:
    for cut in range(4):  # the last character may be cut
        try:
            return head[: len(head) - cut].decode("utf-8-sig"), "utf8"
        except UnicodeDecodeError:
            continue
    return head.decode("latin-1"), "latin-1"


def is_number(text: str, decimal: str = ".") -> bool:
    """Whether a cell is a number. decimal : its decimal mark."""
    try:
        float(text if decimal == "." else text.replace(".", "?").replace(decimal, "."))
    except ValueError:
        return False
    return True


def other_fields(path: Path, line: int, row: Sequence[str], columns: Sequence[str]) -> str:
    """The sentence for a row that has more or fewer fields than the header."""
    return f"line {line} of '{path}' has {len(row)} fields, the header has {len(columns)}; is the file complete?"
