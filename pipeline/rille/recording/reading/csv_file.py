"""CSV files: delimiter, encoding and header are found out; what is no table of numbers is refused with its line."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rille.model.csv_form import NO_NUMBER, csv_form, is_number, other_fields
from rille.model.errors import InputRefused
from rille.recording.reading.dates import DATE, EXAMPLE, LIKE, no_date, stamps_of, zoned
from rille.recording.reading.piece import Piece, Wanted, refuse_missing
from rille.recording.reading.table import pieces_of

BLOCK = 1 << 22  # bytes of a piece


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
        dates = self._dates(wanted)
        try:
            with pa.OSFile(str(self.path)) as file, self._reader(file, wanted, dates) as reader:
                for batch in reader:
                    if len(batch):
                        yield from pieces_of(_stamped(batch, dates), wanted, row, min(1.0, file.tell() / size), str(self.path))
                        row += len(batch)
        except pa.ArrowInvalid as error:
            raise InputRefused(self._why(wanted, dates, str(error))) from None

    def _filled(self, column: str) -> list[str]:
        """First cells of a column that are not empty."""
        place = self.columns.index(column)
        cells = (row[place] for row in self.form.rows if len(row) == len(self.columns))
        return [cell for cell in cells if cell not in NO_NUMBER]

    def _dates(self, wanted: Wanted) -> dict[str, bool]:
        """The clocks that are dates, and whether the first of each says its zone."""
        first = {clock: next(iter(self._filled(clock)), "") for clock in wanted.clocks if clock in self.columns}
        return {clock: zoned(cell) for clock, cell in first.items() if DATE.fullmatch(cell)}

    def _reader(self, file: Any, wanted: Wanted, dates: Mapping[str, bool]) -> Any:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        form = self.form
        unique = [name if form.columns[:k].count(name) == 0 else f"{name}\0{k}" for k, name in enumerate(form.columns)]
        types: dict[str, Any] = {name: pa.float64() for name in wanted.columns}
        for clock in wanted.clocks:
            if clock in dates:
                types[clock] = pa.string()
            elif clock in form.columns:
                cells = self._filled(clock)
                if cells and all(re.fullmatch(r"\d{16,19}", cell) for cell in cells):  # a float has no room for these digits
                    types[clock] = pa.int64()
        numbers = {*wanted.clocks, *(name for columns in wanted.clocks.values() for name in columns)}
        types |= {name: pa.dictionary(pa.int32(), pa.string()) for name in wanted.labels if name not in numbers}
        read = arrow_csv.ReadOptions(block_size=BLOCK, skip_rows=form.skip, column_names=unique, encoding=form.encoding)
        convert = arrow_csv.ConvertOptions(
            column_types=types, include_columns=list(types), null_values=NO_NUMBER, strings_can_be_null=False, decimal_point=form.decimal
        )
        return arrow_csv.open_csv(file, read, arrow_csv.ParseOptions(delimiter=form.delimiter), convert)

    def _why(self, wanted: Wanted, dates: Mapping[str, bool], error: str) -> str:
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
                    return other_fields(self.path, line, row, self.columns)
                for name, place in places.items() if row else ():
                    cell = row[place].strip()
                    if cell in NO_NUMBER:
                        continue
                    fault = no_date(cell, zone=dates[name]) if name in dates else self._no_number(cell)
                    if fault:
                        return f"line {line}, column '{name}' of '{self.path}' is '{cell}', {fault}"
        return f"'{self.path}' cannot be read as CSV: {error}"

    def _no_number(self, cell: str) -> str:
        """Why a cell is no number, as the end of a sentence; "" if it is one."""
        if is_number(cell, self.form.decimal):
            return ""
        if LIKE.search(cell):
            return f"which is no number; dates are read as {EXAMPLE}"
        mark = {".": "point", ",": "comma"}
        other = "," if self.form.decimal == "." else "."
        if is_number(cell, other):
            return f"which has a decimal {mark[other]}, unlike the first numbers; write all with one decimal mark"
        return "which is no number"


def _stamped(batch: Any, dates: Mapping[str, bool]) -> Any:
    """A batch with its columns of dates as time stamps. dates : column -> whether its dates say their zone."""
    import pyarrow as pa
    import pyarrow.compute as pc

    for name, zone in dates.items():
        column = batch.column(name)
        empty = pc.is_in(column, value_set=pa.array(NO_NUMBER))  # pyright: ignore[reportAttributeAccessIssue]
        column = pc.if_else(empty, pa.scalar(None, pa.string()), column)  # pyright: ignore[reportAttributeAccessIssue]
        batch = batch.set_column(batch.schema.get_field_index(name), name, stamps_of(column, zone=zone))
    return batch
