"""What is in a database, and whether it hangs together."""

import re
from pathlib import Path

from rille.store.database import reading

# Rules that SQL's CHECKs cannot say, each as a query whose rows are the offenders (column `subject`) and a sentence.
RULES = (
    (
        "SELECT name AS subject FROM body WHERE id NOT IN (SELECT child_body_id FROM joint) LIMIT -1 OFFSET 1",
        "body '{subject}' hangs on nothing, and it is not the only one; join all but one by joints",
    ),
    (
        "SELECT wheel.name AS subject FROM wheel JOIN joint ON joint.id = joint_id WHERE kind <> 'hinge'",
        "wheel '{subject}' turns on a joint that is not a hinge",
    ),
    (
        "SELECT joint.name AS subject FROM joint_limit JOIN joint ON joint.id = joint_id WHERE kind NOT IN ('hinge', 'prismatic')",
        "joint '{subject}' has a limit but neither turns nor slides about one axis",
    ),
    (
        "SELECT differential.name AS subject FROM differential JOIN joint ON joint.id IN (joint_a_id, joint_b_id) "
        "WHERE kind <> 'hinge' OR parent_body_id IS NOT carrier_body_id",
        "differential '{subject}' needs two hinges on its carrier",
    ),
    (
        "SELECT name AS subject FROM terrain WHERE (SELECT coalesce(sum(n_rows * n_cols), 0) FROM terrain_tile "
        "WHERE terrain_id = terrain.id AND layer = 'height' AND level = 0) < n_rows * n_cols",
        "terrain '{subject}' has cells without a tile",
    ),
    (
        "SELECT soil.name AS subject FROM soil WHERE id IN (SELECT soil_id FROM terrain UNION SELECT soil_id FROM soil_patch) "
        "AND id NOT IN (SELECT soil_id FROM material_pair WHERE soil_id IS NOT NULL)",
        "soil '{subject}' is used but no material_pair says how wheels respond to it",
    ),
    (
        "SELECT run.id AS subject FROM run WHERE status = 'running'",
        "run {subject} never ended: its program was killed or still runs; what it committed is readable",
    ),
)


def check(path: Path) -> list[str]:
    """Problems of a database, each a sentence; empty if there are none.

    Raises
    ------
    InputRefused : if the file is no database of rille that this version can read.
    """
    problems = []
    with reading(path) as connection:
        problems += [f"the file is damaged: {row[0]}" for row in connection.execute("PRAGMA integrity_check") if row[0] != "ok"]
        problems += [
            f"row {row[1]} of table {row[0]} refers to a row of {row[2]} that does not exist"
            for row in connection.execute("PRAGMA foreign_key_check")
        ]
        for query, sentence in RULES:
            problems += [sentence.format(subject=row["subject"]) for row in connection.execute(query)]
    return problems


def info(path: Path) -> dict:
    """Contents of a database: version, size, names, rows per table, runs."""
    with reading(path) as connection:
        tables = [r[0] for r in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")]
        counts = {t: connection.execute(f"SELECT count(*) FROM {t}").fetchone()[0] for t in tables}
        names = {
            t: [r[0] for r in connection.execute(f"SELECT name FROM {t} ORDER BY id")]
            for t in ("body", "joint", "wheel", "terrain", "soil", "scenario")
        }
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
        tables = connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")
        return {
            row["name"]: dict(re.findall(r"^\s*([a-z_]\w*) (?:INTEGER|REAL|TEXT|BLOB).*-- (\[.*)$", row["sql"], re.MULTILINE))
            for row in tables
        }
