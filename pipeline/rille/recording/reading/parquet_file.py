"""Parquet files."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from rille.model.errors import InputRefused
from rille.recording.reading.piece import Piece, Wanted, refuse_missing
from rille.recording.reading.table import pieces_of

ROWS = 65536  # rows of a piece


class ParquetSource:
    """A Parquet file, read row group by row group."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises
        ------
        InputRefused : if it is damaged or has no rows.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.path = path
        try:
            self._file = pq.ParquetFile(path, pre_buffer=False)
            self.schema = self._file.schema_arrow
            self.columns = tuple(self.schema.names)
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:  # of damaged names
            raise InputRefused(f"'{path}' cannot be read as Parquet: {error}") from None
        for name in self.columns:
            if self.columns.count(name) > 1:
                raise InputRefused(f"'{path}' has {self.columns.count(name)} columns named '{name}'; rename all but one")
        self.rows = self._file.metadata.num_rows
        if self.rows == 0:
            raise InputRefused(f"'{path}' has columns but no rows")

    table = True

    def check(self, columns: Sequence[str]) -> None:
        """Refuse columns that are not there."""
        refuse_missing(columns, self.columns, str(self.path))

    def topic(self, column: str) -> str:
        """Tables have none."""
        return ""

    def pieces(self, wanted: Wanted) -> Iterator[Piece]:
        """All rows in the order of the file."""
        import pyarrow as pa

        row = 0
        try:
            for batch in self._file.iter_batches(batch_size=ROWS, columns=list(wanted.columns)):
                yield from pieces_of(batch, wanted, row, min(1.0, (row + len(batch)) / self.rows), str(self.path))
                row += len(batch)
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            raise InputRefused(f"'{self.path}' is damaged after row {row}: {error}") from None
