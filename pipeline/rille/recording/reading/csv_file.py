"""CSV files: delimiter, encoding and header are found out; what is no table of numbers is refused with its line."""

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rille.model.errors import InputRefused
from rille.recording.reading.piece import Piece, Wanted, refuse_missing
from rille.recording.reading.table import pieces_of

HEAD = 1 << 16  # bytes that are looked at
BLOCK = 1 << 22  # bytes of a piece
NO_NUMBER = ("", "nan", "NaN", "NAN", "-nan", "null", "NULL", "None", "NA", "N/A", "n/a", "#N/A", "-")
DELIMITERS = (",", ";", "\t", "|")
ZONE = re.compile(r"(?:Z|[+-]\d\d:?\d\d)$")
DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvForm:
    """How a CSV is written. skip : lines before the first row, header included. rows : the first rows, as text."""

    delimiter: str
    decimal: str
    encoding: str
    skip: int
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def csv_form(path: Path) -> CsvForm:
    """Find out how a CSV is written, from its beginning.

    Lines before the header that begin with ``#`` or ``%`` are comments.

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
    lines = text.splitlines()
    lines = lines if whole else lines[:-1] or lines
    first = next((k for k, line in enumerate(lines) if line.strip() and line.lstrip()[:1] not in "#%"), None)
    if first is None:
        raise InputRefused(f"'{path}' holds comments only")
    counts = {delimiter: lines[first].count(delimiter) for delimiter in DELIMITERS}
    delimiter = max(counts, key=lambda d: (counts[d], -DELIMITERS.index(d)))
    if not counts[delimiter] and len(lines) > first + 1 and lines[first].count(" ") == lines[first + 1].count(" "):
        delimiter = " "
    rows = tuple(
        tuple(cell.strip() for cell in row) for row in csv.reader(io.StringIO("\n".join(lines[first:])), delimiter=delimiter) if row
    )
    columns = tuple(name or f"column {k + 1}" for k, name in enumerate(rows[0]))
    if all(is_number(name) for name in rows[0]):
        raise InputRefused(
            f"'{path}' has no header: line {first + 1} holds numbers ({', '.join(rows[0][:3])}); write the columns' names above it"
        )
    decimal = "," if delimiter != "," and any(re.fullmatch(r"-?\d+,\d+", cell) for row in rows[1:20] for cell in row) else "."
    return CsvForm(delimiter=delimiter, decimal=decimal, encoding=encoding, skip=first + 1, columns=columns, rows=rows[1:])


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


class CsvSource:
    """A CSV file, read block by block."""

    def __init__(self, path: Path) -> None:
        """Look at the beginning of the file.

        Raises
        ------
        InputRefused : if it is no CSV with a header and rows.
        """
        self.path = path
        self.form = csv_form(path)
        self.columns = self.form.columns
        if not self.form.rows:
            raise InputRefused(f"'{path}' has a header ({', '.join(self.columns[:4])}) but no rows")

    table = True

    def check(self, columns: Sequence[str]) -> None:
        """Refuse columns that are not there, or there twice."""
        refuse_missing(columns, self.columns, str(self.path))
        for name in columns:
            if self.columns.count(name) > 1:
                raise InputRefused(f"'{self.path}' has {self.columns.count(name)} columns named '{name}'; rename all but one")

    def topic(self, column: str) -> str:
        """Tables have none."""
        return ""

    def pieces(self, wanted: Wanted) -> Iterator[Piece]:
        """All rows in the order of the file."""
        import pyarrow as pa

        size = max(1, self.path.stat().st_size)
        row = 0
        try:
            with pa.OSFile(str(self.path)) as file, self._reader(file, wanted) as reader:
                for batch in reader:
                    if len(batch):
                        yield from pieces_of(batch, wanted, row, min(1.0, file.tell() / size), str(self.path))
                        row += len(batch)
        except pa.ArrowInvalid as error:
            raise InputRefused(self._why(wanted, str(error))) from None

    def _reader(self, file: Any, wanted: Wanted) -> Any:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        form = self.form
        unique = [name if form.columns[:k].count(name) == 0 else f"{name}\0{k}" for k, name in enumerate(form.columns)]
        types: dict[str, Any] = {name: pa.float64() for name in wanted.columns}
        for clock in wanted.clocks:
            if clock in form.columns:
                place = form.columns.index(clock)
                cells = [row[place] for row in form.rows if len(row) == len(form.columns)]
                if cells and DATE.match(cells[0]):
                    types[clock] = pa.timestamp("ns", tz="UTC" if ZONE.search(cells[0]) else None)
                elif cells and all(re.fullmatch(r"\d{16,19}", cell) for cell in cells):  # a float has no room for these digits
                    types[clock] = pa.int64()
        numbers = {*wanted.clocks, *(name for columns in wanted.clocks.values() for name in columns)}
        types |= {name: pa.dictionary(pa.int32(), pa.string()) for name in wanted.labels if name not in numbers}
        read = arrow_csv.ReadOptions(block_size=BLOCK, skip_rows=form.skip, column_names=unique, encoding=form.encoding)
        convert = arrow_csv.ConvertOptions(
            column_types=types, include_columns=list(types), null_values=NO_NUMBER, strings_can_be_null=False, decimal_point=form.decimal
        )
        return arrow_csv.open_csv(file, read, arrow_csv.ParseOptions(delimiter=form.delimiter), convert)

    def _why(self, wanted: Wanted, error: str) -> str:
        """The line and column at which reading failed, in one sentence."""
        names = [name for name in wanted.columns if name not in wanted.labels]
        places = {name: self.columns.index(name) for name in names}
        with self.path.open(newline="", encoding="utf-8-sig" if self.form.encoding == "utf8" else "latin-1", errors="replace") as file:
            for _ in range(self.form.skip):
                file.readline()
            rows = csv.reader(file, delimiter=self.form.delimiter)
            for row in rows:
                line = self.form.skip + rows.line_num
                if row and len(row) != len(self.columns):
                    return f"line {line} of '{self.path}' has {len(row)} fields, the header has {len(self.columns)}; is the file complete?"
                for name, place in places.items() if row else ():
                    cell = row[place].strip().replace(self.form.decimal, ".")
                    if cell not in NO_NUMBER and not is_number(cell) and not DATE.match(cell):
                        return f"line {line}, column '{name}' of '{self.path}' is '{row[place].strip()}', which is no number"
        return f"'{self.path}' cannot be read as CSV: {error}"
