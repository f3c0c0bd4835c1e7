"""What is in a database, and whether it hangs together."""

import re
from pathlib import Path

from rille.store.database import reading, schema_text
from rille.store.effects import effect_problems, effect_rows
from rille.store.soundness import problems, tables


def check(path: Path) -> list[str]:
    """Problems of a database, each a sentence; empty if there are none.

    Raises
    ------
    InputRefused : if the file is no database of rille that this version can read.
    """
    with reading(path) as connection:
        unended = [row["id"] for row in connection.execute("SELECT id FROM run WHERE status = 'running'")]
        damage = problems(path, schema_text())
        refused = [] if damage else list(effect_problems(connection))
    return [
        *damage,
        *refused,
        *(f"run {run} never ended: its program was killed or still runs; what it committed is readable" for run in unended),
    ]


def info(path: Path) -> dict:
    """Contents of a database: version, size, names (of effects, law and target), rows per table, runs."""
    with reading(path) as connection:
        counts = {t: connection.execute(f"SELECT count(*) FROM {t}").fetchone()[0] for t in tables(connection)}
        names = {
            t: [r[0] for r in connection.execute(f"SELECT name FROM {t} ORDER BY id")]
            for t in ("body", "joint", "wheel", "terrain", "soil", "scenario", "recording", "finding")
        }
        names["bench"] = [r[0] for r in connection.execute("SELECT DISTINCT bench FROM bench_point ORDER BY bench")]
        names["effect"] = [f"{effect.kind} on {effect.target}" for effect in effect_rows(connection)]
        mass = connection.execute("SELECT coalesce(sum(mass), 0) FROM body").fetchone()[0]
        runs = [dict(r) for r in connection.execute("SELECT id, status, time_reached, message FROM run ORDER BY id")]
        sources = [dict(r) for r in connection.execute("SELECT subject, file, sha256, tool FROM provenance ORDER BY id")]
        version = connection.execute("PRAGMA user_version").fetchone()[0]
    return {
        "file": str(path),
        "bytes": Path(path).stat().st_size,
        "schema_version": version,
        "total_mass_kg": mass,
        "names": names,
        "rows": {t: n for t, n in counts.items() if n},
        "runs": runs,
        "sources": sources,
    }


def units(path: Path) -> dict[str, dict[str, str]]:
    """Unit and meaning of every column, ``{table: {column: "[unit] meaning"}}``, as the file itself keeps them."""
    with reading(path) as connection:
        definitions = connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")
        return {
            row["name"]: dict(re.findall(r"^\s*([a-z_]\w*) (?:INTEGER|REAL|TEXT|BLOB).*-- (\[.*)$", row["sql"], re.MULTILINE))
            for row in definitions
        }
