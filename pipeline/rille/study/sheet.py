"""Study sheets (TOML): what varies, by which design, what is asked."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from rille.model import InputRefused
from rille.model.sheet import Sheet, read_sheet, validate_sheet
from rille.model.study import Design, Reducer

Number = float | int | str
Component = Literal["x", "y", "z", "w"] | int


class VarySheet(Sheet):
    """[[vary]]: low and high (``log`` for decades), or mean and sigma, or values. relative : factors of what the model has."""

    name: str = Field(min_length=1)
    low: Number | None = None
    high: Number | None = None
    log: bool = False
    mean: Number | None = None
    sigma: Number | None = None
    values: list[Number] | None = Field(None, min_length=1)
    relative: bool = False


class OutcomeSheet(Sheet):
    """[[outcome]]: a channel reduced to a number. target : name or pattern. after : samples before that time do not count."""

    name: str | None = None
    quantity: str
    target: str
    component: Component = 0
    reduce: Reducer
    after: Number = 0.0


class TraceSheet(Sheet):
    """[[trace]]: a channel that is kept over time, for envelopes. target : name or pattern."""

    name: str | None = None
    quantity: str
    target: str
    component: Component = 0


class StudySheet(Sheet):
    """The whole study.

    model : database, or sheet, script or URDF that one is built from. scenario : file, or name in the database; None: the only one.
    terrain : scene that is built into the model; landforms of it can vary. samples : base samples; a grid needs none. levels : of a
    grid, for factors that have ends instead of values. set : constants by name. main : outcomes that are shown first.
    """

    name: str = ""
    model: str = Field(min_length=1)
    scenario: str | None = None
    terrain: str | None = None
    design: Design = "latin_hypercube"
    samples: int | None = Field(None, ge=1, le=1_000_000)
    levels: int = Field(5, ge=2, le=1000)
    seed: int = Field(1, ge=1, lt=2**32)
    second_order: bool = False
    set: dict[str, Number] = {}
    vary: list[VarySheet] = Field(min_length=1)
    outcome: list[OutcomeSheet] = []
    main: list[str] = []
    trace: list[TraceSheet] = []
    trace_interval: Number = "0.1 s"


def read_study_sheet(path: Path) -> StudySheet:
    """Read a study sheet; without a name it has the file's.

    Raises
    ------
    InputRefused : with the key and its place.
    """
    sheet = read_sheet(path, StudySheet)
    return sheet if sheet.name else sheet.model_copy(update={"name": Path(path).stem})


def study_of_options(model: Path, vary: Sequence[str], options: Mapping[str, Any]) -> StudySheet:
    """A study from texts like ``soil.lunar.cohesion=100 Pa:1 kPa`` (ends) or ``...=1,2,5`` (values).

    options : other keys of the sheet; None: left out. Without a design and a number of samples, factors that are all values make a grid.

    Raises
    ------
    InputRefused : for a text that is neither, a value that the sheet refuses, samples of a grid, or a model that is itself a study sheet.
    """
    tables = []
    for text in vary:
        name, equals, rest = text.partition("=")
        ends = rest.split(":")
        if not equals or not name.strip() or not rest.strip() or len(ends) > 2:
            raise InputRefused(f"'{text}' does not say what varies; write NAME=LOW:HIGH or NAME=VALUE,VALUE,...")
        table: dict[str, Any] = {"name": name.strip()}
        if len(ends) == 2:
            table |= {"low": _number(ends[0]), "high": _number(ends[1])}
        else:
            table["values"] = [_number(value) for value in rest.split(",")]
        tables.append(table)
    given = {key: value for key, value in options.items() if value is not None}
    if given.get("design") == "grid" and "samples" in given:
        raise InputRefused(
            f"a grid has all combinations, so --samples {given['samples']} says nothing; leave it out, or use another design"
        )
    if not given.keys() & {"design", "samples"} and all("values" in table for table in tables):
        given["design"] = "grid"
    if model.suffix == ".toml" and model.is_file() and re.search(r"^\s*\[\[vary\]\]", model.read_text(encoding="utf-8"), re.MULTILINE):
        raise InputRefused(f"'{model}' is a study sheet; write what varies into it, or name the model instead")
    return validate_sheet({"name": model.stem, "model": str(model), "vary": tables, **given}, StudySheet, "options")


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text.strip()
