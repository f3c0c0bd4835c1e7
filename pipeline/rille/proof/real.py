"""Real concealment: recordings of real hardware whose disturbance was logged apart, or whose missing physics was identified by others."""

import csv
from pathlib import Path
from typing import Any

from pydantic import Field

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.model.sheet import Sheet, expand, read_sheet


class Pulses(Sheet):
    """A table of pushes that were logged apart, one a row.

    recording : name of the recording, with columns in braces: ``disturbed/{exp}``. target : column; names : its words -> joints of the
    model. time : column of the peaks [s]. amplitude : column; only its sign and ratio count. near : so far apart may the peaks be.
    """

    file: str
    recording: str
    target: str
    names: dict[str, str] = Field(default_factory=dict)
    time: str
    amplitude: str
    near: str = "0.15 s"


class Piece(Sheet):
    """Physics of the machine that the model of the trial lacks, and what it is known from."""

    kind: str
    target: str


class RealSheet(Sheet):
    """A trial of real recordings.

    title : what is concealed, for people. source : where the truth is from. model : assembly or database. recordings : manifests. ask :
    what ``rille diagnose`` is asked. pulses or piece : the truth, which no room can read.
    """

    title: str
    source: str
    model: str
    recordings: list[str] = Field(min_length=1)
    ask: list[str] = Field(default_factory=list)
    pulses: Pulses | None = None
    piece: list[Piece] = Field(default_factory=list)


def read_real(path: Path) -> RealSheet:
    """The sheet of a trial of real recordings.

    Raises
    ------
    InputRefused : if it is no such sheet, or its truth is neither pulses nor pieces.
    """
    sheet = read_sheet(path, RealSheet)
    if (sheet.pulses is None) == (not sheet.piece):
        raise InputRefused(f"'{path}' must say what is concealed: either [pulses], a table of pushes, or [[piece]], what the model lacks")
    return sheet


def real_truth(path: Path, number: int) -> dict[str, Any]:
    """The truth of a trial of real recordings, as plain JSON values.

    Raises
    ------
    InputRefused : if the table of pulses is missing, or has not what the sheet says.
    """
    sheet = read_real(path)
    truth: dict[str, Any] = {"number": number, "sort": "real", "title": sheet.title, "source": sheet.source, "sheet": path.name}
    if sheet.pulses is None:
        return truth | {"pieces": [{"cause": "effect", "kind": p.kind, "target": p.target} for p in sheet.piece]}
    return truth | {"pulses": _pulses(sheet.pulses, path), "near": to_si(sheet.pulses.near, "time", "near")}


def _pulses(sheet: Pulses, path: Path) -> list[dict[str, Any]]:
    file = expand(sheet.file, path.parent)
    if not file.is_file():
        raise InputRefused(f"the truth '{file}' of '{path}' is not there; set RILLE_DATA to the folder of the real data")
    with file.open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    try:
        return [
            {
                "recording": sheet.recording.format(**row),
                "target": sheet.names.get(row[sheet.target], row[sheet.target]),
                "time": float(row[sheet.time]),
                "amplitude": float(row[sheet.amplitude]),
            }
            for row in rows
        ]
    except (KeyError, ValueError) as error:
        raise InputRefused(f"'{file}' does not fit [pulses] of '{path}': {error}; name its columns") from error
