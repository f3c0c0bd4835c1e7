"""Bench points from and to CSV, whatever the columns are called."""

import csv
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rille.model import BenchPoints, InputRefused, nearest_names
from rille.model.bench import CONDITIONS, RESPONSES
from rille.model.csv_form import LINE_END, NO_NUMBER, CsvForm, csv_form, other_fields
from rille.model.quantity import to_si

QUANTITIES = CONDITIONS | RESPONSES
MISSING = {word.lower() for word in NO_NUMBER}
ALIASES = {
    "load": ("load", "vertical_load", "normal_load", "wheel_load", "vertical_force", "normal_force"),
    "slip_ratio": ("slip_ratio", "slip"),
    "slip_angle": ("slip_angle",),
    "sinkage": ("sinkage",),
    "drawbar_pull": ("drawbar_pull",),
    "side_force": ("side_force", "lateral_force"),
    "drive_torque": ("drive_torque", "torque", "wheel_torque", "driving_torque"),
}
SPELLINGS = {
    **{"nm": "N m", "mnm": "mN m", "ncm": "N cm", "knm": "kN m", "n": "N", "kn": "kN", "pct": "percent", "%": "percent"},
    **{"1": "dimensionless", "-": "dimensionless", "": "dimensionless"},
}
FILLERS = (
    "meas",
    "measured",
    "mean",
    "avg",
    "average",
    "median",
    "filtered",
    "smoothed",
)  # words of a name that say nothing about which quantity it is


def guess_columns(header: Sequence[str], stated: Collection[str] = ()) -> dict[str, str]:
    """Quantity -> column, for headers such as ``load_N``, ``slip``, ``meas_sinkage_mm``, ``Torque [Nm]``.

    A column is a quantity if its name is one of the quantity's names and, at most, a unit of that quantity: ``slip_angle`` is no slip
    ratio, ``load_case`` no load. The quantity's own name goes before its other names. stated : quantities that need no guess.

    Raises
    ------
    InputRefused : if two columns say the same.
    """
    found: dict[str, str] = {}
    for quantity, words in ALIASES.items():
        for word in words if quantity not in stated else ():
            meant = [column for column in header if _rest(column, word) is not None and _unit(column, quantity) is not None]
            if len(set(meant)) > 1:
                both = " and ".join(f"'{column}'" for column in meant)
                raise InputRefused(f"columns {both} both say {quantity}; choose one, for example --column {quantity}={meant[0]}")
            if meant:
                found[quantity] = meant[0]
                break
    return found


def _words(column: str) -> list[str]:
    """Words of a column's name in small letters, without a unit in brackets and without fillers."""
    name = re.sub(r"[\[(][^\[\]()]*[\])]\s*$", "", column)
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return [word for word in re.findall(r"[a-z0-9%]+", spaced.lower()) if word not in FILLERS]


def _rest(column: str, name: str) -> str | None:
    """What a column's name says after the name of a quantity; None if it does not begin with it."""
    words, own = _words(column), name.split("_")
    return " ".join(words[len(own) :]) if words[: len(own)] == own else None


def _unit(column: str, quantity: str) -> str | None:
    """Unit of a column of a quantity: in brackets, or what follows the quantity's name; SI if neither; None if it is no unit of it."""
    bracket = re.search(r"[\[(]([^\[\]()]*)[\])]\s*$", column)
    rests = [rest for name in ALIASES[quantity] if (rest := _rest(column, name)) is not None]
    if bracket:
        return _unit_of(bracket[1], quantity)
    if rests:
        return _unit_of(min(rests, key=len), quantity)
    words = _words(column)  # a name of its own, stated with --column: its last word, if that is a unit
    return (_unit_of(words[-1], quantity) if len(words) > 1 else None) or _si(quantity)


def _unit_of(text: str, quantity: str) -> str | None:
    """How a unit is spelt here; None if a quantity has no such unit. Nothing is SI."""
    if not text.strip():
        return _si(quantity)
    unit = SPELLINGS.get(re.sub(r"[\s*\u00b7._]", "", text).lower(), text.strip())
    if quantity == "slip_ratio":  # an angle is a ratio, too, but no slip ratio
        return unit if unit in ("percent", "dimensionless") else None
    try:
        to_si(f"1 {unit}", _si(quantity), quantity)
    except InputRefused:
        return None
    return unit


def _no_column(quantity: str, header: Sequence[str], path: Path) -> str:
    """The sentence for a quantity that no column says, with columns that nearly do."""
    near = [c for c in header if any(_rest(c, name) is not None for name in ALIASES[quantity])]
    if not near:
        return f"'{path}' has no column for {quantity}; name it, for example --column {quantity}=NAME; it has {', '.join(header)}"
    unit = {"load": "kgf", "slip_ratio": "percent"}.get(quantity, _si(quantity)).replace(" ", "*")
    return (
        f"'{path}' has no column for {quantity}: {', '.join(near)} begins like one, but does not end in a unit of {_si(quantity)}; "
        f"name column and unit, for example --column {quantity}={near[0]}:{unit}"
    )


def bench_columns(path: Path, columns: Mapping[str, str] | None = None) -> dict[str, str]:
    """Which column each quantity is read from, and in which unit, in words: {"load": "load_N [N]"}. Otherwise as ``read_bench_csv``."""
    header = list(_form(Path(path)).columns)
    return {quantity: source.in_words() for quantity, source in _sources(Path(path), header, columns or {}).items()}


def read_bench_csv(
    path: Path,
    columns: Mapping[str, str] | None = None,
    where: Mapping[str, str] | None = None,
    *,
    on_copies: Callable[[Mapping[int, int]], None] | None = None,
) -> BenchPoints:
    """Read measured points. Rows that are copies of another in every column of the file are no repeats, and are left out.

    Parameters
    ----------
    path : CSV with a header; units from the ends of the column names (``load_N``, ``sinkage_mm``, ``slip_angle_deg``, ``slip_pct``).
    columns : quantity -> column, ``-column`` to turn its sign, ``column:unit`` to state its unit; what is left out is guessed.
    where : column -> text that rows must have there.
    on_copies : called with the lines that are left out as copies, if there are any, and the line that each is a copy of.

    Raises
    ------
    InputRefused : for a missing or ambiguous column, an unknown quantity, a unit that does not fit, a value that is no number or cannot be,
        a row with more or fewer fields than the header.
    """
    path = Path(path)
    header, rows, decimal = _rows(path, where or {})
    copied = _copies(rows)
    if copied and on_copies is not None:
        on_copies(copied)
    rows = {line: row for line, row in rows.items() if line not in copied}
    values = {q: np.full(len(rows), 0.0 if q == "slip_angle" else np.nan) for q in QUANTITIES}
    for quantity, source in _sources(path, header, columns or {}).items():
        values[quantity] = _numbers(rows, header, quantity, source, path, decimal)
    _require_conditions(values, list(rows), path)
    return BenchPoints(**values | {"slip_ratio": np.clip(values["slip_ratio"], -1, 1)})


def _copies(rows: Mapping[int, list[str]]) -> dict[int, int]:
    first: dict[tuple[str, ...], int] = {}
    seen = {line: first.setdefault(tuple(cell.strip() for cell in row), line) for line, row in rows.items()}
    return {line: other for line, other in seen.items() if other != line}


def _require_conditions(values: Mapping[str, np.ndarray], lines: Sequence[int], path: Path) -> None:
    """Refuse the first line whose load, slip ratio or slip angle is missing or cannot be."""
    bad = ~np.all([np.isfinite(values[q]) for q in CONDITIONS], axis=0)
    if bad.any():
        raise InputRefused(f"line {lines[int(np.argmax(bad))]} of '{path}' has no load, slip ratio or slip angle; remove it")
    light, outside = values["load"] <= 0, np.abs(values["slip_ratio"]) > 1.02
    if light.any():
        k = int(np.argmax(light))
        hint = "counted upward? turn its sign: --column load=-NAME" if (values["load"] < 0).all() else "remove it"
        raise InputRefused(f"load in line {lines[k]} of '{path}' is {values['load'][k]:g} N; it must be above 0 ({hint})")
    if outside.any():
        k = int(np.argmax(outside))
        raise InputRefused(
            f"slip ratio in line {lines[k]} of '{path}' is {values['slip_ratio'][k]:g}; it must lie in -1 to 1 (percent? name it slip_pct)"
        )


def _form(path: Path) -> CsvForm:
    try:
        return csv_form(path)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputRefused(f"'{path}' cannot be read as CSV: {error}") from error


def _rows(path: Path, where: Mapping[str, str]) -> tuple[list[str], dict[int, list[str]], str]:
    """Header, rows by their line in the file, and decimal sign, however the file is written (as ``rille import`` reads it)."""
    header, rows, decimal = _table(path)
    for column, text in where.items():
        if column not in header:
            raise InputRefused(f"'{path}' has no column '{column}'; {nearest_names(column, header)}")
        place = header.index(column)
        rows = {line: row for line, row in rows.items() if row[place].strip() == text}
    if not rows:
        raise InputRefused(f"no row of '{path}' has {', '.join(f'{c} = {t}' for c, t in where.items())}")
    return header, rows, decimal


def _table(path: Path) -> tuple[list[str], dict[int, list[str]], str]:
    """Header, all rows by their line in the file, and decimal sign."""
    form = _form(path)
    try:
        with path.open(newline="", encoding="utf-8-sig" if form.encoding == "utf8" else form.encoding) as file:
            lines = LINE_END.split(file.read())[form.skip :]
        reader = csv.reader(lines, delimiter=form.delimiter)
        rows = dict((form.skip + reader.line_num, row) for row in reader if row)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputRefused(f"'{path}' cannot be read as CSV: {error}") from error
    if not rows:
        raise InputRefused(f"'{path}' has no rows below its header")
    for line, row in rows.items():
        if len(row) != len(form.columns):
            raise InputRefused(other_fields(path, line, row, form.columns))
    return list(form.columns), rows, form.decimal


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """Where a quantity is read from: a column, its sign and its unit; or a ``value`` in SI, the same in all rows."""

    name: str = ""
    sign: float = 1.0
    unit: str = ""
    value: float | None = None

    def in_words(self) -> str:
        return f"{'-' if self.sign < 0 else ''}{self.name} [{self.unit}]" if self.value is None else f"{self.value:g}"


def _sources(path: Path, header: list[str], columns: Mapping[str, str]) -> dict[str, _Source]:
    """Quantity -> its source: what is stated, and what can be guessed."""
    for quantity in columns:
        if quantity not in QUANTITIES:
            raise InputRefused(f"'{quantity}' is no quantity of a bench; {nearest_names(quantity, QUANTITIES)}")
    chosen = guess_columns(header, columns) | dict(columns)
    for quantity in ("load", "slip_ratio"):
        if quantity not in chosen:
            raise InputRefused(_no_column(quantity, header, path))
    if not any(q in chosen for q in RESPONSES):
        raise InputRefused(f"'{path}' has no column for {', '.join(RESPONSES)}; name one with --column")
    return {quantity: _source(spec, quantity, header, path) for quantity, spec in chosen.items()}


def _source(spec: str, quantity: str, header: list[str], path: Path) -> _Source:
    name, _, unit = (spec, "", "") if spec in header else spec.partition(":")
    sign = -1.0 if name.startswith("-") and name not in header else 1.0
    name = name if name in header else name.removeprefix("-")
    if name not in header:
        try:  # a quantity that was the same for all rows: "load=64.7 N"
            return _Source(value=to_si(spec.replace(":", " "), _si(quantity), quantity))
        except InputRefused:
            raise InputRefused(f"'{path}' has no column '{name}' for {quantity}; {nearest_names(name, header)}") from None
    if header.count(name) > 1:
        raise InputRefused(f"'{path}' has {header.count(name)} columns '{name}'; give each a name of its own")
    return _Source(name=name, sign=sign, unit=unit or _unit(name, quantity) or _si(quantity))


def _numbers(rows: Mapping[int, list[str]], header: list[str], quantity: str, source: _Source, path: Path, decimal: str) -> np.ndarray:
    if source.value is not None:
        return np.full(len(rows), source.value)
    factor = source.sign * to_si(f"1 {source.unit}", _si(quantity), f"column '{source.name}' of '{path}'")
    numbers, place = np.full(len(rows), np.nan), header.index(source.name)
    for k, (line, row) in enumerate(rows.items()):
        text = row[place].strip()
        if text.lower() in MISSING:
            continue
        try:
            numbers[k] = factor * float(text.replace(decimal, "."))
        except ValueError:
            raise InputRefused(f"line {line} of '{path}' has '{text}' in column '{source.name}', which is no number") from None
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
