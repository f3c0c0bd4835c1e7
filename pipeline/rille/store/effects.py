"""The catalogue of effects, and the effects of a model <-> rows."""

import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import cache
from pathlib import Path

from rille.model import Effect, EffectKind, EffectParameter, InputRefused, nearest_names
from rille.store.database import insert, reading, schema_folder, writing

EXPRESSION_KEYS = ("formula", "output", "constants", "target_kind")
EFFECTS = "SELECT name, effect.target, parameters FROM effect JOIN effect_kind ON effect_kind.id = effect_kind_id ORDER BY effect.id"


@cache
def effect_kinds() -> tuple[EffectKind, ...]:
    """Every law of the catalogue ``schema/effects.sql``, in its order."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.row_factory = sqlite3.Row
        for name in ("schema.sql", "effects.sql"):
            connection.executescript((schema_folder() / name).read_text())
        parameters: dict[int, list[EffectParameter]] = {}
        for r in connection.execute("SELECT * FROM effect_parameter ORDER BY effect_kind_id, rowid"):
            fields = ("name", "unit", "lower", "upper", "typical", "spread", "meaning", "search")
            made = EffectParameter(amplitude=bool(r["amplitude"]), **{f: r[f] for f in fields})
            parameters.setdefault(r["effect_kind_id"], []).append(made)
        fields = ("name", "family", "target", "needs", "channel", "equation", "meaning", "source")
        return tuple(
            EffectKind(
                passive=bool(r["passive"]), memory=bool(r["memory"]), parameters=tuple(parameters[r["id"]]), **{f: r[f] for f in fields}
            )
            for r in connection.execute("SELECT * FROM effect_kind ORDER BY id")
        )


def find_effect_kind(name: str) -> EffectKind:
    """The law of that name.

    Raises
    ------
    InputRefused : with the nearest names.
    """
    kinds = {kind.name: kind for kind in effect_kinds()}
    if name not in kinds:
        raise InputRefused(f"there is no effect '{name}'; {nearest_names(name, kinds)}")
    return kinds[name]


def check_effect(effect: Effect) -> None:
    """Refuse an effect whose law, parameters or values the catalogue does not know.

    Raises
    ------
    InputRefused : with the parameter, its value and its bounds.
    """
    kind = find_effect_kind(effect.kind)
    known = {parameter.name: parameter for parameter in kind.parameters}
    for name, value in effect.parameters.items():
        if kind.name == "expression" and name in EXPRESSION_KEYS:
            continue
        if name not in known:
            raise InputRefused(f"the effect '{kind.name}' has no parameter '{name}'; {nearest_names(name, known)}")
        parameter = known[name]
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise InputRefused(f"the parameter '{name}' of effect '{kind.name}' is {value!r}; give a number in {parameter.unit}")
        if not (parameter.lower <= value <= parameter.upper) and not (parameter.amplitude and value == 0):
            raise InputRefused(
                f"the parameter '{name}' of effect '{kind.name}' is {value:g} {parameter.unit}; "
                f"it must lie in {parameter.lower:g} to {parameter.upper:g}"
            )
    if kind.name == "expression":
        for key in ("formula", "output", "target_kind"):
            if not isinstance(effect.parameters.get(key), str):
                raise InputRefused(f"an expression needs '{key}'; see `rille effects show expression`")


def write_effects(path: Path, effects: Sequence[Effect]) -> None:
    """Put the effects into the model, in place of those that it had.

    Raises
    ------
    InputRefused : for a law or value that the catalogue does not know, or a target that the model does not have.
    """
    with writing(path) as connection:
        connection.execute("DELETE FROM effect")
        for effect in effects:
            insert_effect(connection, effect)


def add_effect(path: Path, effect: Effect) -> None:
    """Add one effect to the model; one of the same law on the same target is replaced (not expressions, which may be many)."""
    with writing(path) as connection:
        if effect.kind != "expression":
            connection.execute(
                "DELETE FROM effect WHERE target = ? AND effect_kind_id = (SELECT id FROM effect_kind WHERE name = ?)",
                (effect.target, effect.kind),
            )
        insert_effect(connection, effect)


def insert_effect(connection: sqlite3.Connection, effect: Effect) -> None:
    """Write one effect into a database that is open already."""
    check_effect(effect)
    _require_target(connection, effect)
    key = _key_of_law(connection, effect.kind)
    row = {"effect_kind_id": key, "target": effect.target, "parameters": json.dumps(dict(effect.parameters))}
    insert(connection, "effect", f"effect '{effect.kind}'", row)


def _require_target(connection: sqlite3.Connection, effect: Effect) -> None:
    """Refuse an effect on what the model does not have."""
    kind = find_effect_kind(effect.kind)
    target = effect.parameters.get("target_kind") if kind.target == "any" else kind.target
    if effect.target != "*" and target in ("wheel", "joint", "body", "sensor"):
        names = [r["name"] for r in connection.execute(f"SELECT name FROM {target} ORDER BY id")]
        if effect.target not in names:
            raise InputRefused(
                f"the effect '{kind.name}' acts on {target} '{effect.target}', which the model does not have; "
                f"{nearest_names(effect.target, names)}"
            )
    if effect.target != "*" and target in ("terrain", "world"):
        raise InputRefused(f"the effect '{kind.name}' acts on the {target} as a whole, not on '{effect.target}'; leave its target out")


def effect_problems(connection: sqlite3.Connection) -> Iterator[str]:
    """What is wrong with the effects of a database, which others may have written by SQL: each a sentence, as it would be refused."""
    for row in connection.execute(EFFECTS).fetchall():
        try:
            effect = _effect(row)
            check_effect(effect)
            _require_target(connection, effect)
        except InputRefused as refused:
            yield str(refused)


def _key_of_law(connection: sqlite3.Connection, kind: str) -> int:
    """Key of a law in the catalogue of a database; a file that was made before the law was known is given the present catalogue."""
    asked = "SELECT id FROM effect_kind WHERE name = ?"
    if connection.execute(asked, (kind,)).fetchone() is None:
        for statement in _statements((schema_folder() / "effects.sql").read_text()):  # not executescript, which would commit
            connection.execute(statement)
    return connection.execute(asked, (kind,)).fetchone()["id"]


def _statements(text: str) -> Iterator[str]:
    """The statements of an SQL file, one by one."""
    begun = ""
    for line in text.splitlines(keepends=True):
        begun += line
        if sqlite3.complete_statement(begun):
            yield begun
            begun = ""


def read_effects(path: Path) -> tuple[Effect, ...]:
    """The effects of a model, in their order."""
    with reading(path) as connection:
        return effect_rows(connection)


def effect_rows(connection: sqlite3.Connection) -> tuple[Effect, ...]:
    """The effects of a database that is open already, in their order."""
    return tuple(_effect(row) for row in connection.execute(EFFECTS))


def _effect(row: sqlite3.Row) -> Effect:
    parameters = json.loads(row["parameters"])
    if not isinstance(parameters, dict):
        raise InputRefused(
            f"the parameters of effect '{row['name']}' on '{row['target']}' are {row['parameters']}; give a JSON object, parameter -> value"
        )
    return Effect(kind=row["name"], target=row["target"], parameters=parameters)
