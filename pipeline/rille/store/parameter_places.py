"""Where the numbers of a model that the solver knows by name are kept: "soil.lunar.cohesion", "drive.hub.max_torque", "gravity.z"."""

import json
import math
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rille.model import InputRefused, Soil, nearest_names
from rille.store.effects import find_effect_kind

TABLES = ("soil", "body", "wheel", "drive")  # first word of the parameter's name, and table that it comes from


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A number in the database. key : of its row. factor : the column over the solver's parameter. inside : its key in JSON."""

    table: str
    key: int
    row: str
    column: str
    before: float
    factor: float = 1.0
    inside: str = ""

    @property
    def value(self) -> float:
        """Of the solver's parameter."""
        return self.before / self.factor

    @property
    def name(self) -> str:
        """Of the number in its row."""
        return self.inside or self.column


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Finds the places of parameters in an open database.

    path : its name in refusals. scenario : whose gravity is meant; None: the only one. soils : that the database does not hold but would.
    others : parameters that change together with those that are looked for: a density is a unit weight over the gravity that will be.
    """

    connection: sqlite3.Connection
    path: Path
    scenario: str | None = None
    soils: Sequence[Soil] = ()
    others: Mapping[str, float] = field(default_factory=dict)

    def find(self, name: str) -> Place:
        """The place of a parameter. Names of rows may hold dots: the first and last word are what counts.

        Raises
        ------
        InputRefused : if no row of the database holds it.
        """
        first, _, rest = name.partition(".")
        if first == "gravity":
            row, column = self._scenario_row(), f"gravity_{rest}"
            return Place(table="scenario", key=row["id"], row=row["name"], column=column, before=float(row[column]))
        row_name, _, number = rest.rpartition(".")
        if first == "effect":
            return self._of_effect(row_name, number)
        if first not in TABLES:
            known = [*TABLES, "effect", "gravity"]
            raise InputRefused(f"'{self.path}' has no place for the parameter '{name}'; {nearest_names(first, known)}")
        factor = 1.0
        if first == "soil" and number == "unit_weight":
            number, factor = "density", 1 / self._gravity_size()
        rows = {soil.name: asdict(soil) | {"id": -1} for soil in self.soils} if first == "soil" else {}
        rows |= {r["name"]: dict(r) for r in self.connection.execute(f"SELECT * FROM {first}")}
        if row_name not in rows:
            raise InputRefused(f"'{self.path}' has no {first} '{row_name}'; {nearest_names(row_name, rows)}")
        row = rows[row_name]
        if not isinstance(row.get(number), float | int):
            raise InputRefused(f"{first} '{row_name}' of '{self.path}' has no number '{number}' that '{name}' could mean")
        return Place(table=first, key=row["id"], row=row_name, column=number, before=float(row[number]), factor=factor)

    def _scenario_row(self) -> sqlite3.Row:
        rows = {r["name"]: r for r in self.connection.execute("SELECT * FROM scenario ORDER BY id")}
        if self.scenario is None and len(rows) == 1:
            return next(iter(rows.values()))
        if self.scenario not in rows:
            wanted = self.scenario or ""
            raise InputRefused(f"'{self.path}' has no scenario '{wanted}'; {nearest_names(wanted, rows)}")
        return rows[self.scenario]

    def _gravity_size(self) -> float:
        row = self._scenario_row()
        return math.hypot(*(self.others.get(f"gravity.{axis}", row[f"gravity_{axis}"]) for axis in "xyz"))

    def _of_effect(self, kind_and_target: str, number: str) -> Place:
        query = (
            "SELECT effect.id AS id, name || '.' || effect.target AS place, parameters "
            "FROM effect JOIN effect_kind ON effect_kind.id = effect_kind_id ORDER BY effect.id DESC"
        )
        rows = {r["place"]: r for r in self.connection.execute(query)}
        if kind_and_target not in rows:
            raise InputRefused(f"the model in '{self.path}' has no effect '{kind_and_target}'; {nearest_names(kind_and_target, rows)}")
        row = rows[kind_and_target]
        parameters: dict[str, Any] = json.loads(row["parameters"])
        typical = {p.name: 0.0 if p.amplitude else p.typical for p in find_effect_kind(kind_and_target.partition(".")[0]).parameters}
        before = parameters.get(number, typical.get(number, 0.0))
        return Place(table="effect", key=row["id"], row=kind_and_target, column="parameters", before=float(before), inside=number)


def unit_of(place: Place, columns: Mapping[str, Mapping[str, str]]) -> str:
    """Unit of a place. columns : of every table, "[unit] meaning" by column."""
    if not place.inside:
        return columns[place.table].get(place.column, "").partition("]")[0].lstrip("[")
    return {parameter.name: parameter.unit for parameter in find_effect_kind(place.row.partition(".")[0]).parameters}.get(place.inside, "")
