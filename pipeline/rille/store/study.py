"""Studies <-> ``schema/study.sql``. The design is on the disk before the first case; finished cases follow in small transactions."""

import fcntl
import json
import math
import os
import sqlite3
import struct
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.study import Case, CaseResult, Factor, Measure, StudyPlan, StudyTable, TracedChannel
from rille.store.database import insert, schema_folder, transaction

STUDY_ID = 1380537172  # "RIST"
STUDY_VERSION = 1


def create_study(path: Path, plan: StudyPlan, cases: Sequence[Case]) -> None:
    """A new study with all its cases waiting: there whole or not at all.

    Raises
    ------
    InputRefused : if the file exists or cannot be written, or a value breaks a rule of the schema.
    """
    path = Path(path)
    if path.exists():
        raise InputRefused(f"the study '{path}' exists already; go on with it or choose another name")
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    try:
        with closing(sqlite3.connect(part, isolation_level=None)) as connection:
            connection.executescript((schema_folder() / "study.sql").read_text())
            connection.execute("BEGIN")
            _write_plan(connection, plan)
            numbers = [(case.number,) for case in cases]
            connection.executemany('INSERT INTO "case" (number) VALUES (?)', numbers)
            settings = [(c.number, f.name, value) for c in cases for f, value in zip(plan.factors, c.values, strict=True)]
            connection.executemany("INSERT INTO setting VALUES (?, ?, ?)", settings)
            connection.execute(_view(plan))
            connection.execute("COMMIT")
        os.link(part, path)  # fails where a study is
    except (sqlite3.Error, OSError) as error:
        raise InputRefused(f"the study '{path}' could not be made: {error}; is the folder writable and the disk not full?") from error
    finally:
        part.unlink(missing_ok=True)


def _write_plan(connection: sqlite3.Connection, plan: StudyPlan) -> None:
    fields = ("name", "design", "samples", "seed", "model_file", "version")
    row: dict[str, object] = {field: getattr(plan, field) for field in fields}
    row |= {"second_order": int(plan.second_order), "sheet_sha256": plan.sheet, "model_sha256": plan.model}
    row["trace_time"] = struct.pack(f"<{len(plan.trace_time)}d", *plan.trace_time)
    insert(connection, "study", "the study", row)
    for factor in plan.factors:
        row = {field: getattr(factor, field) for field in ("name", "unit", "spread", "low", "high", "mean", "sigma")}
        row |= {"relative": int(factor.relative), "choices": json.dumps(factor.values)}
        insert(connection, "factor", f"factor '{factor.name}'", row)
    for measure in plan.measures:
        row = {"name": measure.name, "unit": measure.unit, "meaning": measure.meaning, "main": int(measure.main)}
        insert(connection, "measure", f"outcome '{measure.name}'", row)
    for channel in plan.traced:
        row = {field: getattr(channel, field) for field in ("name", "unit", "quantity", "target", "component")}
        insert(connection, "traced_channel", f"trace '{channel.name}'", row)


def _view(plan: StudyPlan) -> str:
    """One row per case: number, status, reason, a column per factor and per outcome."""

    def column(table: str, name: str) -> str:
        text, title = name.replace("'", "''"), name.replace('"', '""')
        return f"""(SELECT value FROM {table} AS t WHERE t."case" = c.number AND t.name = '{text}') AS "{title}\""""

    columns = [column("setting", f.name) for f in plan.factors] + [column("outcome", m.name) for m in plan.measures]
    return f'CREATE VIEW result AS SELECT number AS "case", status, reason, {", ".join(columns)} FROM "case" AS c ORDER BY number'


def read_plan(path: Path) -> StudyPlan:
    """What a study was planned to be; what its factors change is not kept in the file.

    Raises
    ------
    InputRefused : if the file is no study that this version can read.
    """
    with _opened(Path(path)) as connection:
        return _plan(connection)


def _plan(connection: sqlite3.Connection) -> StudyPlan:
    row = connection.execute("SELECT * FROM study").fetchone()
    return StudyPlan(
        **{field: row[field] for field in ("name", "design", "samples", "seed", "model_file", "version")},
        second_order=bool(row["second_order"]),
        factors=tuple(
            Factor(
                **{field: r[field] for field in ("name", "unit", "spread", "low", "high", "mean", "sigma")},
                relative=bool(r["relative"]),
                values=tuple(json.loads(r["choices"])),
            )
            for r in connection.execute("SELECT * FROM factor ORDER BY id")
        ),
        measures=tuple(
            Measure(name=r["name"], unit=r["unit"], meaning=r["meaning"], main=bool(r["main"]))
            for r in connection.execute("SELECT * FROM measure ORDER BY id")
        ),
        traced=tuple(
            TracedChannel(**{field: r[field] for field in ("name", "unit", "quantity", "target", "component")})
            for r in connection.execute("SELECT * FROM traced_channel ORDER BY id")
        ),
        trace_time=struct.unpack(f"<{len(row['trace_time']) // 8}d", row["trace_time"]),
        sheet=row["sheet_sha256"],
        model=row["model_sha256"],
    )


def read_study(path: Path) -> StudyTable:
    """Plan, settings, outcomes and how each case ended, as of now.

    Raises
    ------
    InputRefused : if the file is no study that this version can read.
    """
    with _opened(Path(path)) as connection:
        connection.execute("BEGIN")  # all tables at one moment
        plan = _plan(connection)
        ended = connection.execute('SELECT number, status, reason FROM "case" ORDER BY number').fetchall()
        row_of = {row["number"]: k for k, row in enumerate(ended)}
        return StudyTable(
            plan=plan,
            values=_matrix(connection, "setting", row_of, [f.name for f in plan.factors]),
            outcomes=_matrix(connection, "outcome", row_of, [m.name for m in plan.measures]),
            status=tuple(row["status"] for row in ended),
            reason=tuple(row["reason"] for row in ended),
        )


def _matrix(connection: sqlite3.Connection, table: str, row_of: dict[int, int], names: list[str]) -> NDArray[np.float64]:
    found = np.full((len(row_of), len(names)), np.nan)
    column_of = {name: k for k, name in enumerate(names)}
    for number, name, value in connection.execute(f'SELECT "case", name, value FROM {table}'):
        found[row_of[number], column_of[name]] = value
    return found


def waiting_cases(path: Path) -> tuple[Case, ...]:
    """Cases that were not run yet, in their order."""
    with _opened(Path(path)) as connection:
        names = [row["name"] for row in connection.execute("SELECT name FROM factor ORDER BY id")]
        settings: dict[int, dict[str, float]] = {}
        query = (
            """SELECT "case" AS number, name, value FROM setting JOIN "case" ON number = "case" WHERE status = 'waiting' ORDER BY number"""
        )
        for row in connection.execute(query):
            settings.setdefault(row["number"], {})[row["name"]] = row["value"]
        return tuple(Case(number=number, values=tuple(found[name] for name in names)) for number, found in settings.items())


def add_results(path: Path, plan: StudyPlan, results: Sequence[CaseResult]) -> None:
    """Keep finished cases, on the disk when the function returns; a case that is kept already stays as it is.

    Raises
    ------
    InputRefused : if the file cannot be written; nothing of these cases is kept then.
    """
    with _opened(Path(path)) as connection, transaction(connection):
        for result in results:
            ended = (result.status, result.reason, result.number)
            if not connection.execute(
                """UPDATE "case" SET status = ?, reason = ? WHERE number = ? AND status = 'waiting'""", ended
            ).rowcount:
                continue
            numbers = [(result.number, name, value) for name, value in result.outcomes.items() if math.isfinite(value)]
            connection.executemany("INSERT INTO outcome VALUES (?, ?, ?)", numbers)
            if result.traces is not None:
                kept = zip(plan.traced, np.asarray(result.traces, "<f4"), strict=True)
                connection.executemany("INSERT INTO trace VALUES (?, ?, ?)", [(result.number, c.name, v.tobytes()) for c, v in kept])


def read_traces(path: Path, channel: str) -> NDArray[np.float64]:
    """A channel of all cases that went as planned, (cases, times)."""
    query = """SELECT samples FROM trace JOIN "case" ON number = "case" WHERE name = ? AND status IN ('done', 'stopped') ORDER BY number"""
    with _opened(Path(path)) as connection:
        size = len(connection.execute("SELECT trace_time FROM study").fetchone()[0]) // 8
        rows = [np.frombuffer(row["samples"], "<f4") for row in connection.execute(query, (channel,))]
    return np.array(rows, dtype=np.float64).reshape(-1, size)


@contextmanager
def study_held(path: Path) -> Iterator[None]:
    """Nobody else runs cases of this study meanwhile.

    Raises
    ------
    InputRefused : if somebody does.
    """
    with _opened(Path(path)):  # refuses what is no study
        pass
    with Path(path).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputRefused(f"another `rille sweep` is at work on '{path}'; wait for it or choose another file") from None
        yield


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection to a study; it writes only to undo a transaction that a killed program left."""
    if not path.is_file():
        raise InputRefused(f"there is no study '{path}'; make one: `rille sweep STUDY.toml`")
    mode = "rw" if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK) else "ro"
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, isolation_level=None, timeout=10)) as connection:
            connection.row_factory = sqlite3.Row
            application = connection.execute("PRAGMA application_id").fetchone()[0]
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            if application != STUDY_ID:
                raise InputRefused(f"'{path}' is no study (application_id {application}, a study has {STUDY_ID}); name another file")
            if version != STUDY_VERSION:
                raise InputRefused(
                    f"the study '{path}' has version {version}, this rille reads {STUDY_VERSION}; use the rille that made it"
                )
            yield connection
    except sqlite3.DatabaseError as error:
        raise InputRefused(f"the study '{path}' cannot be used: {error}; nothing was changed") from error
