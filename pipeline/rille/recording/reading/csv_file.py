"""CSV files: delimiter, encoding and header are found out; what is no table of numbers is refused with its line."""

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rille.model.csv_form import csv_form, is_number
from rille.model.errors import InputRefused
from rille.recording.reading.piece import Piece, Wanted, refuse_missing
from rille.recording.reading.table import pieces_of

BLOCK = 1 << 22  # bytes of a piece
NO_NUMBER = ("", "nan", "NaN", "NAN", "-nan", "null", "NULL", "None", "NA", "N/A", "n/a", "#N/A", "-")
ZONE = re.compile(r"(?:Z|[+-]\d\d:?\d\d)$")
DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")


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
                        date = "; dates are read as 2024-03-31T00:59:55.005Z" if re.search(r"\d[:./-]\d+[:./-]\d", cell) else ""
                        return f"line {line}, column '{name}' of '{self.path}' is '{row[place].strip()}', which is no number{date}"
        return f"'{self.path}' cannot be read as CSV: {error}"
