"""Time stamps as written -> seconds, and where they begin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused
from rille.model.quantity import to_si
from rille.model.recording import Array, Correction
from rille.recording.manifest import Manifest
from rille.recording.reading import Piece

Rows = slice | NDArray[np.intp]  # which samples of a piece
LARGEST_START = 1e5  # [s] about a day: a recording that begins later counts from some epoch, and must say so


@dataclass(slots=True)
class Stamps:
    """The clock's unit and origin of one recording. origin : first stamp as written, once known."""

    name: str
    column: str
    factor: float
    first: bool
    messages: bool
    points: bool
    origin: float | int | None = None
    seen: int = 0

    @classmethod
    def of(cls, manifest: Manifest, name: str) -> "Stamps":
        """As the manifest says; stamps of messages that count from an epoch begin at 0 unless it says otherwise."""
        sheet = manifest.sheet
        messages = not sheet.time.column and sheet.time.origin is None and sheet.kind == "time"
        factor = to_si(f"1 {sheet.time.unit}", "time", f"unit of the time of '{manifest.path}'")
        return cls(
            name=name,
            column=sheet.time.column,
            factor=factor,
            first=sheet.time.origin == "first",
            messages=messages,
            points=sheet.kind == "points",
        )

    def seconds(self, piece: Piece, rows: Rows) -> Array:
        """(n,) [s] times of these rows of a piece.

        Raises
        ------
        InputRefused : for a row without a time, or a start beyond ``LARGEST_START`` that the manifest takes as it is.
        """
        written = piece.time[rows]
        if self.points:
            self.seen += len(written)
            return np.arange(self.seen - len(written), self.seen, dtype=float)
        if np.issubdtype(written.dtype, np.floating) and not np.isfinite(written).all():
            row = piece.row + int(np.arange(len(piece.time))[rows][np.argmin(np.isfinite(written))]) + 1
            raise InputRefused(
                f"row {row} of recording '{self.name}' has no time ({written[np.argmin(np.isfinite(written))]}); remove that row"
            )
        if self.origin is None and len(written):
            self.factor = piece.tick or self.factor
            first = written[0].item() if piece.begin is None else piece.begin
            begin = first * self.factor
            self.first = self.first or (self.messages and abs(begin) > LARGEST_START)
            self.origin = first if self.first else 0
            if not self.first and abs(begin) > LARGEST_START:
                raise InputRefused(
                    f"recording '{self.name}' begins at {begin:.6g} s, which counts from some epoch or is in another unit; say "
                    'origin = "first" in [time] to begin at 0, or correct its unit'
                )
        since = (written - written.dtype.type(self.origin or 0)).astype(np.float64)
        parts = round(1 / self.factor)  # ms: 1000; dividing rounds as the decimal fraction does
        return since / parts if self.factor < 1 and abs(parts * self.factor - 1) < 1e-12 else since * self.factor

    def steps(self) -> list[Correction]:
        """The shift of the origin as a recorded step."""
        if not self.first or not self.origin:
            return []
        return [Correction(kind="origin", detail={"by": -self.origin * self.factor, "written": self.origin}, reason="time begins at 0")]
