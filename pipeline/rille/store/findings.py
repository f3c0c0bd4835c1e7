"""What diagnoses found <-> rows of table ``finding``."""

import json
import sqlite3
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from rille.model import InputRefused, nearest_names
from rille.model.finding import Finding
from rille.store.database import insert, reading, writing


def write_finding(path: Path, finding: Finding) -> Finding:
    """Keep a diagnosis; returned with the name ("diagnosis-3") and time that it was given, if it had none.

    Raises
    ------
    InputRefused : if a finding of that name exists, or a value breaks a rule of the schema.
    """
    with writing(path) as connection:
        finding = replace(finding, name=finding.name or _next_name(connection), created=finding.created or _now())
        first = finding.recordings[0] if finding.recordings else ""
        known = connection.execute("SELECT id FROM recording WHERE name = ?", (first,)).fetchone()
        row = {
            "recording_id": None if known is None else known["id"],
            "name": finding.name,
            "created": finding.created,
            "verdict": finding.verdict,
            "target": finding.target,
            "probability": finding.probability,
            "sentence": finding.sentence,
            "recordings": json.dumps(finding.recordings),
            "held_out": json.dumps(finding.held_out),
            "setting": json.dumps(list(finding.setting), allow_nan=False),
            "detail": json.dumps(finding.detail, allow_nan=False),
        }
        insert(connection, "finding", f"finding '{finding.name}'", row)
        return finding


def _now() -> str:
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _next_name(connection: sqlite3.Connection) -> str:
    numbers = [row["name"].removeprefix("diagnosis-") for row in connection.execute("SELECT name FROM finding")]
    return f"diagnosis-{1 + max((int(number) for number in numbers if number.isdecimal()), default=0)}"


def read_findings(path: Path) -> tuple[Finding, ...]:
    """All findings, oldest first."""
    with reading(path) as connection:
        return tuple(_finding(row) for row in connection.execute("SELECT * FROM finding ORDER BY id"))


def find_finding(path: Path, name: str | None = None) -> Finding:
    """The finding of that name; without a name, the newest.

    Raises
    ------
    InputRefused : if there is none.
    """
    found = {finding.name: finding for finding in read_findings(path)}
    if not found:
        raise InputRefused(f"'{path}' holds no finding; diagnose its recordings first: `rille diagnose {path}`")
    if name is not None and name not in found:
        raise InputRefused(f"'{path}' has no finding '{name}'; {nearest_names(name, found)}")
    return found[name] if name is not None else [*found.values()][-1]


def _finding(row: sqlite3.Row) -> Finding:
    columns = ("name", "created", "verdict", "target", "probability", "sentence")
    return Finding(
        **{column: row[column] for column in columns},
        recordings=tuple(json.loads(row["recordings"])),
        held_out=tuple(json.loads(row["held_out"])),
        setting=json.loads(row["setting"]),
        detail=json.loads(row["detail"]),
    )
