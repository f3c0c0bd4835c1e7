"""Bench points from and to CSV, whatever the columns are called."""

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rille.model import BenchPoints, InputRefused, nearest_names
from rille.model.bench import CONDITIONS, RESPONSES
from rille.model.csv_form import csv_form
from rille.model.quantity import to_si

QUANTITIES = CONDITIONS | RESPONSES
ALIASES = {
    "load": ("load", "vertical_load", "normal_load"),
    "slip_ratio": ("slip_ratio", "slip"),
    "slip_angle": ("slip_angle",),
    "sinkage": ("sinkage",),
    "drawbar_pull": ("drawbar_pull",),
    "side_force": ("side_force",),
    "drive_torque": ("drive_torque", "torque"),
}
UNIT_WORDS = {"nm": "N m", "n": "N", "kn": "kN", "pct": "percent", "1": "dimensionless", "-": "dimensionless", "": "dimensionless"}


def guess_columns(header: list[str]) -> dict[str, str]:
    """Quantity -> column, for headers such as ``load_N``, ``slip``, ``meas_sinkage_mm``, ``Torque [Nm]``."""
    found: dict[str, str] = {}
    for column in header:
        name = re.sub(r"[^a-z0-9]+", "_", column.lower()).strip("_").removeprefix("meas_").removeprefix("measured_")
        for quantity, words in ALIASES.items():
            for word in words:
                if (name == word or name.startswith(word + "_")) and quantity not in found and len(name) - len(word) <= 9:
                    found[quantity] = column
    return found


def _unit(column: str, quantity: str) -> str:
    """Unit of a column from the end of its name; a bare name is SI."""
    bracket = re.search(r"[\[(]([^\[\]()]+)[\])]\s*$", column)
    if bracket:  # all of it is the unit: "torque [N m]"
        text = bracket[1].strip()
        return UNIT_WORDS.get(re.sub(r"[\s*\u00b7.]", "", text).lower(), text)
    words = re.split(r"[^A-Za-z0-9%]+", column.strip("_ ])"))
    tail = words[-1] if len(words) > 1 else ""
    known = {"n", "nm", "mm", "cm", "m", "deg", "rad", "pct", "percent", "kn", "kg"}
    if tail.lower() not in known:
        return "rad" if quantity == "slip_angle" else QUANTITIES[quantity]
    return UNIT_WORDS.get(tail.lower(), tail.lower() if tail.lower() != "kn" else "kN")


def read_bench_csv(path: Path, columns: Mapping[str, str] | None = None, where: Mapping[str, str] | None = None) -> BenchPoints:
    """Read measured points.

    Parameters
    ----------
    path : CSV with a header; units from the ends of the column names (``load_N``, ``sinkage_mm``, ``slip_angle_deg``, ``slip_pct``).
    columns : quantity -> column, ``-column`` to turn its sign, ``column:unit`` to state its unit; what is left out is guessed.
    where : column -> text that rows must have there.

    Raises
    ------
    InputRefused : for a missing file or column, an unknown quantity, a unit that does not fit, a value that is no number.
    """
    path = Path(path)
    header, rows, decimal = _rows(path)
    for column, text in (where or {}).items():
        if column not in header:
            raise InputRefused(f"'{path}' has no column '{column}'; {nearest_names(column, header)}")
        rows = {line: row for line, row in rows.items() if (row.get(column) or "").strip() == text}
    if not rows:
        raise InputRefused(f"no row of '{path}' has {', '.join(f'{c} = {t}' for c, t in (where or {}).items())}")
    chosen = guess_columns(header) | dict(columns or {})
    for quantity in chosen:
        if quantity not in QUANTITIES:
            raise InputRefused(f"'{quantity}' is no quantity of a bench; {nearest_names(quantity, QUANTITIES)}")
    for quantity in ("load", "slip_ratio"):
        if quantity not in chosen:
            raise InputRefused(
                f"'{path}' has no column for {quantity}; name it, for example --column {quantity}=NAME; it has {', '.join(header)}"
            )
    values = {q: np.full(len(rows), 0.0 if q == "slip_angle" else np.nan) for q in QUANTITIES}
    for quantity, column in chosen.items():
        values[quantity] = _column(rows, header, quantity, column, path, decimal)
    if not any(q in chosen for q in RESPONSES):
        raise InputRefused(f"'{path}' has no column for {', '.join(RESPONSES)}; name one with --column")
    points = BenchPoints(**values)
    bad = ~np.isfinite(points.load) | ~np.isfinite(points.slip_ratio) | ~np.isfinite(points.slip_angle)
    if bad.any():
        raise InputRefused(f"line {list(rows)[int(np.argmax(bad))]} of '{path}' has no load, slip ratio or slip angle; remove it")
    outside = np.abs(points.slip_ratio) > 1.02
    if outside.any():
        k = int(np.argmax(outside))
        line = list(rows)[k]
        raise InputRefused(
            f"slip ratio in line {line} of '{path}' is {points.slip_ratio[k]:g}; it must lie in -1 to 1 (percent? name it slip_pct)"
        )
    return BenchPoints(**{q: (np.clip(values[q], -1, 1) if q == "slip_ratio" else values[q]) for q in QUANTITIES})


def _rows(path: Path) -> tuple[list[str], dict[int, dict], str]:
    """Header, rows by their line in the file, and decimal sign, however the file is written (as ``rille import`` reads it)."""
    try:
        form = csv_form(path)
        with path.open(newline="", encoding="utf-8-sig" if form.encoding == "utf8" else form.encoding) as file:
            lines = file.read().splitlines()[form.skip :]
        reader = csv.reader(lines, delimiter=form.delimiter)
        numbered = [(form.skip + reader.line_num, row) for row in reader if row]
        rows = {line: dict(zip(form.columns, row, strict=False)) for line, row in numbered}
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputRefused(f"'{path}' cannot be read as CSV: {error}") from error
    if not rows:
        raise InputRefused(f"'{path}' has no rows below its header")
    return list(form.columns), rows, form.decimal


def _column(rows: Mapping[int, dict], header: list[str], quantity: str, spec: str, path: Path, decimal: str) -> np.ndarray:
    name, _, unit = spec.partition(":")
    sign = -1.0 if name.startswith("-") and name not in header else 1.0
    name = name if name in header else name.removeprefix("-")
    if name not in header:
        try:  # a quantity that was the same for all rows: "load=64.7 N"
            return np.full(len(rows), to_si(spec.replace(":", " "), _si(quantity), quantity))
        except InputRefused:
            raise InputRefused(f"'{path}' has no column '{name}' for {quantity}; {nearest_names(name, header)}") from None
    unit = unit or _unit(name, quantity)
    factor = to_si(f"1 {unit}", _si(quantity), f"column '{name}' of '{path}'")
    numbers = np.full(len(rows), np.nan)
    for k, (line, row) in enumerate(rows.items()):
        text = (row.get(name) or "").strip()
        if not text or text.lower() in ("nan", "na", "-"):
            continue
        try:
            numbers[k] = sign * factor * float(text.replace(decimal, "."))
        except ValueError:
            raise InputRefused(f"line {line} of '{path}' has '{text}' in column '{name}', which is no number") from None
    return numbers


def _si(quantity: str) -> str:
    unit = QUANTITIES[quantity]
    return "dimensionless" if unit == "1" else unit


def bench_csv_lines(points: BenchPoints, lead: Mapping[str, str] | None = None) -> list[str]:
    """CSV lines with header; ``lead`` are constant first columns."""
    names = {"load": "load_N", "slip_ratio": "slip_ratio", "slip_angle": "slip_angle_rad", "sinkage": "sinkage_m"}
    names |= {"drawbar_pull": "drawbar_pull_N", "side_force": "side_force_N", "drive_torque": "drive_torque_Nm"}
    lead = dict(lead or {})
    lines = [",".join([*lead, *names.values()])]
    for k in range(len(points)):
        numbers = [getattr(points, q)[k] for q in names]
        lines.append(",".join([*lead.values(), *("" if np.isnan(v) else f"{v:.10g}" for v in numbers)]))
    return lines
