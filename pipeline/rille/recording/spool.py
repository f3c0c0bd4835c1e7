"""Samples of one recording on their way to the data gate: in memory while they are few, else in unnamed files that die with the process."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from mmap import ACCESS_READ, mmap
from pathlib import Path
from tempfile import SpooledTemporaryFile

import numpy as np

from rille.model.recording import Array

IN_MEMORY = 1 << 21  # bytes of a column that are kept in memory


@dataclass(frozen=True, slots=True)
class Spool:
    """Columns that grow. folder : where the files go, that of the database."""

    folder: Path
    _files: dict[tuple[str, str], SpooledTemporaryFile] = field(default_factory=dict)
    _last: dict[str, float] = field(default_factory=dict)

    def append(self, clock: str, time: Array, values: Mapping[str, Array]) -> None:
        """Samples of one clock."""
        if len(time):
            runs = time[0] >= self._last.get(clock, -np.inf) and bool(np.all(time[1:] >= time[:-1]))
            self._last[clock] = float(time[-1]) if runs else np.inf
        for name, column in {"": time, **values}.items():
            key = (clock, name)
            if key not in self._files:
                self._files[key] = SpooledTemporaryFile(max_size=IN_MEMORY, dir=str(self.folder))  # noqa: SIM115 - closed by close()
            self._files[key].write(np.ascontiguousarray(column, dtype="<f8").data)

    def times(self, clock: str) -> Array:
        """(n,) [s] times of a clock."""
        return self.values(clock, "")

    def forward(self, clock: str) -> bool:
        """Whether the times of a clock never run backwards."""
        return self._last.get(clock, 0.0) < np.inf

    def values(self, clock: str, name: str) -> Array:
        """(n,) values of a channel; those of a long one lie in its file and are read as they are touched."""
        file = self._files.get((clock, name))
        if file is None:
            return np.empty(0)
        size = file.tell()
        if size > IN_MEMORY:
            file.flush()
            return np.frombuffer(mmap(file.fileno(), size, access=ACCESS_READ), dtype="<f8")
        file.seek(0)
        content = np.frombuffer(file.read(), dtype="<f8")
        file.seek(0, 2)
        return content

    def close(self) -> None:
        """Forget everything."""
        for file in self._files.values():
            file.close()
        self._files.clear()
