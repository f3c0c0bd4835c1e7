"""Time stamps as written -> seconds, and where they begin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused
from rille.model.quantity import to_si
from rille.model.recording import Array, Correction
from rille.recording.manifest import Manifest
from rille.recording.reading import Piece, timed

Rows = slice | NDArray[np.intp]  # which samples of a piece
LARGEST_START = 1e5  # [s] about a day: a recording that begins later counts from some epoch, and must say so


@dataclass(slots=True)
class Stamps:
    """The clock's unit and origin of one recording. origin : first stamp as written, once known, of the clock ``begun``.

    tick : [s] unit of its stamps, where the source knows it: dates.
    """

    name: str
    column: str
    factor: float
    first: bool
    messages: bool
    points: bool
    origin: float | int | None = None
    begun: str = ""
    tick: float | None = None
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
        InputRefused : for a row without a time, a start beyond ``LARGEST_START`` that the manifest takes as it is, or clocks of dates and
            of numbers in one recording.
        """
        written = piece.time[rows]
        if self.points:
            self.seen += len(written)
            return np.arange(self.seen - len(written), self.seen, dtype=float)
        given = timed(written)
        if not given.all():
            raise InputRefused(self._without(piece, int(np.arange(len(piece.time))[rows][np.argmin(given)])))
        if self.origin is None and len(written):
            self.begun, self.tick = piece.clock, piece.tick
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
        if len(written) and (piece.tick is None) != (self.tick is None):
            raise InputRefused(
                f"clocks '{self.begun}' and '{piece.clock}' of recording '{self.name}' are one of dates and one of numbers, which have no "
                "common zero; write both as dates, or both as numbers that count from one time"
            )
        since = (written - written.dtype.type(self.origin or 0)).astype(np.float64)
        parts = round(1 / self.factor)  # ms: 1000; dividing rounds as the decimal fraction does
        return since / parts if self.factor < 1 and abs(parts * self.factor - 1) < 1e-12 else since * self.factor

    def _without(self, piece: Piece, k: int) -> str:
        """The sentence for sample k of a piece, which has no time."""
        written = piece.time[k]
        told = "empty" if np.issubdtype(written.dtype, np.integer) else written
        values = ", ".join(f"'{name}'" for name, value in piece.values.items() if not np.isnan(value[k]))
        return (
            f"row {piece.number(k) + 1} of recording '{self.name}' has no time in column '{piece.clock}' ({told}), which stamps {values}; "
            "write its time, or leave what it stamps empty there too"
        )

    def steps(self) -> list[Correction]:
        """The shift of the origin as a recorded step."""
        if not self.first or not self.origin:
            return []
        return [Correction(kind="origin", detail={"by": -self.origin * self.factor, "written": self.origin}, reason="time begins at 0")]
