"""The manifest (TOML): which file, which clock, and what each column means."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Any, Literal

from pydantic import Field

from rille.model.errors import InputRefused
from rille.model.quantity import to_si
from rille.model.recording import Correction
from rille.model.sheet import Sheet, expand, validate_sheet
from rille.recording.corrections import OF_CHANNEL
from rille.recording.points import bench_setup

Number = float | int | str
Format = Literal["csv", "parquet", "mcap", "rosbag"]


class TimeSheet(Sheet):
    """Table ``[time]``. source : mcap and rosbag only, which stamp of a message counts."""

    column: str = ""
    unit: str = "s"
    origin: Literal["as_given", "first"] | None = None
    source: Literal["log", "header"] = "log"


class ChannelSheet(Sheet):
    """One ``[[channel]]``. time : column of its time, where a table has several clocks."""

    column: str = Field(min_length=1)
    name: str = ""
    time: str = ""
    quantity: str = ""
    component: str = ""
    target: str | list[str] = ""
    unit: str = ""
    role: Literal["observed", "command", "ignore"] = "observed"
    scale: Number = 1.0
    offset: Number = 0.0
    noise: Number | None = None
    slow_noise: Number | None = None
    delay: Number = 0.0
    resolution: Number | None = None
    frame: Literal["world", "body"] = "world"
    missing: Literal["refuse", "accept"] = "refuse"
    redundant: bool = False
    accepted: list[str] = []


class CorrectionSheet(Sheet):
    """One ``[[correction]]``: a step that changes what was recorded, and why."""

    kind: Literal["sort", "drop_duplicates", "shift_clock", "scale_clock", "resample", "cut", "drop_samples", "unwrap"]
    reason: str = Field(min_length=1)
    channel: str = ""
    clock: str = ""
    by: Number | None = None
    factor: float | None = None
    rate: Number | None = None
    start: Number | None = None
    end: Number | None = None


class ManifestSheet(Sheet):
    """The whole file."""

    name: str = Field(min_length=1)
    file: str = Field(min_length=1)
    format: Format | None = None
    scenario: str | None = None
    kind: Literal["time", "points"] = "time"
    split: list[str] = []
    where: dict[str, str | int | float | bool] = {}
    time: TimeSheet = TimeSheet()
    channel: list[ChannelSheet] = Field(min_length=1)
    accepted: list[str] = []
    correction: list[CorrectionSheet] = []
    bench: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """A manifest that was read: ``sheet`` as written, with paths resolved, corrections in SI and the text itself."""

    sheet: ManifestSheet
    path: Path
    file: Path
    scenario: Path | str | None
    corrections: tuple[Correction, ...]
    setup: Mapping[str, object]
    text: str


def read_manifest(path: Path) -> Manifest:
    """Read a manifest.

    Raises
    ------
    InputRefused : if the manifest or the file that it names is missing, is not TOML, or has unknown, missing or unfit values.
    """
    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no manifest '{path}'; draft one from a recording: `rille record new FILE -o {quote(str(path))}`")
    try:
        text = path.read_text(encoding="utf-8")
        content = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputRefused(
            f"'{path}' is no manifest (not valid TOML: {error}); draft one from a recording: `rille record new FILE -o manifest.toml`"
        ) from None
    sheet = validate_sheet(content, ManifestSheet, str(path))
    file = expand(sheet.file, path.parent)
    if not file.exists():
        raise InputRefused(f"'{path}' names the file '{file}', which does not exist; paths are relative to the manifest")
    scenario: Path | str | None = sheet.scenario
    if sheet.scenario is not None and sheet.scenario.endswith(".toml"):
        scenario = expand(sheet.scenario, path.parent)
        if not scenario.is_file():
            raise InputRefused(f"'{path}' names the scenario file '{scenario}', which does not exist")
    if (sheet.kind == "points") != (sheet.bench is not None):
        raise InputRefused(f"'{path}': a recording of kind \"points\" and a table [bench] belong together; it has only one of them")
    corrections = tuple(_correction(entry, f"{entry.kind} (correction {k + 1} of '{path}')") for k, entry in enumerate(sheet.correction))
    setup = {} if sheet.bench is None else bench_setup(sheet.bench, f"'{path}'")
    return Manifest(sheet=sheet, path=path, file=file, scenario=scenario, corrections=corrections, setup=setup, text=text)


# Numbers of each kind of correction: which it needs, which it may have, and their SI unit.
NEEDED = {"shift_clock": {"by": "time"}, "scale_clock": {"factor": "1"}, "resample": {"rate": "rate"}, "unwrap": {"by": "angle"}}
ALLOWED = {"cut": {"start": "time", "end": "time"}, "drop_samples": {"start": "time", "end": "time"}}
POSITIVE = {"scale_clock": "factor", "resample": "rate", "unwrap": "by"}  # which of them must be larger than 0


def _correction(entry: CorrectionSheet, what: str) -> Correction:
    needed, allowed = NEEDED.get(entry.kind, {}), ALLOWED.get(entry.kind, {})
    given = {key: getattr(entry, key) for key in ("by", "factor", "rate", "start", "end") if getattr(entry, key) is not None}
    for key in needed:
        if key not in given:
            raise InputRefused(f"{what} needs '{key}'")
    for key in given:
        if key not in needed and key not in allowed:
            raise InputRefused(f"{what} has '{key}', which has no meaning there; remove it")
    if allowed and not given:
        raise InputRefused(f"{what} needs start, end or both")
    if entry.kind in OF_CHANNEL and not entry.channel:
        raise InputRefused(f"{what} needs the channel whose values are to be changed")
    if entry.kind not in OF_CHANNEL and entry.channel:
        raise InputRefused(f"{what} acts on a whole clock: write clock = in place of channel =")
    detail = {key: to_si(value, {**needed, **allowed}[key], f"'{key}' of {what}") for key, value in given.items()}
    key = POSITIVE.get(entry.kind, "")
    if key in detail and detail[key] <= 0:
        raise InputRefused(f"'{key}' of {what} is {detail[key]:g}; it must be larger than 0")
    return Correction(kind=entry.kind, channel=entry.channel or entry.clock, detail=detail, reason=entry.reason)
