"""Studies <-> ``schema/study.sql``. The design is on the disk before the first case; finished cases follow in small transactions.

While cases wait, SQLite keeps a write-ahead log beside the file: whoever reads, however long, does not stop who writes. A study whose cases
are all done is one file again.
"""

import fcntl
import json
import math
import os
import sqlite3
import struct
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.study import Case, CaseResult, Factor, Measure, StudyPlan, StudyTable, TracedChannel
from rille.store.database import SQLITE, address, beside, insert, remove_database, require_kind, schema_folder, transaction

STUDY_ID = 1380537172  # "RIST"
STUDY_VERSION = 1
BUSY = 10.0  # [s] that a writer waits for another
AGAIN = ("refused", "error", "worker_died")  # ends that may be the machine's fault rather than the case's
PLANNED = ("study", "factor", "measure", "traced_channel", "case")  # tables that are checked whenever a study is read


def create_study(path: Path, plan: StudyPlan, cases: Sequence[Case]) -> None:
    """A new study with all its cases waiting: there whole or not at all.

    Raises
    ------
    InputRefused : if the file exists or cannot be written, or a value breaks a rule of the schema.
    """
    path = Path(path)
    for left in beside(path):
        if left.exists() and not path.exists():  # SQLite would take it for a part of the new study
            raise InputRefused(f"'{left}' is left of a study that is gone; remove it, or choose another name than '{path}'")
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            part = Path(folder) / path.name
            _write_new(part, plan, cases)
            os.link(part, path)  # fails where a study is
    except FileExistsError:
        raise InputRefused(f"the study '{path}' exists already; go on with it or choose another name") from None
    except (sqlite3.Error, OSError) as error:
        raise InputRefused(f"the study '{path}' could not be made: {error}; is the folder writable and the disk not full?") from error


def _write_new(path: Path, plan: StudyPlan, cases: Sequence[Case]) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.executescript((schema_folder() / "study.sql").read_text())
        connection.execute("BEGIN")
        _write_plan(connection, plan)
        numbers = [(case.number,) for case in cases]
        connection.executemany('INSERT INTO "case" (number) VALUES (?)', numbers)
        settings = [(c.number, f.name, value) for c in cases for f, value in zip(plan.factors, c.values, strict=True)]
        connection.executemany("INSERT INTO setting VALUES (?, ?, ?)", settings)
        connection.execute(_view(plan))
        connection.execute("COMMIT")


def remove_study(path: Path) -> None:
    """Delete a study, be it damaged or of another version, with all that SQLite keeps beside it.

    Raises
    ------
    InputRefused : if the file is no study, or somebody runs its cases.
    """
    with _locked(Path(path)) as file:
        header = file.read(72)
        if not header.startswith(SQLITE) or int.from_bytes(header[68:72], "big") != STUDY_ID:
            raise InputRefused(f"'{path}' is no study, so it is not deleted; name another file")
        remove_database(path)


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
    with _reading(Path(path)) as connection:
        return _plan(connection)


def _plan(connection: sqlite3.Connection) -> StudyPlan:
    row = connection.execute("SELECT * FROM study").fetchone()
    if row is None:
        raise ValueError("it has no plan")
    return StudyPlan(
        **{field: row[field] for field in ("name", "design", "samples", "seed", "model_file", "version")},
        second_order=bool(row["second_order"]),
        factors=tuple(
            Factor(
                **{field: r[field] for field in ("name", "unit", "spread", "low", "high", "mean", "sigma")},
                relative=bool(r["relative"]),
                values=tuple(float(value) for value in json.loads(r["choices"])),
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
    with _reading(Path(path)) as connection:
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
    """Cases that were not run yet, in their order.

    Raises
    ------
    InputRefused : if the file is no study that this version can read.
    """
    with _reading(Path(path)) as connection:
        names = [row["name"] for row in connection.execute("SELECT name FROM factor ORDER BY id")]
        waiting = connection.execute("""SELECT number FROM "case" WHERE status = 'waiting' ORDER BY number""")
        settings: dict[int, dict[str, float]] = {row["number"]: {} for row in waiting}
        for number, name, value in connection.execute('SELECT "case", name, value FROM setting'):
            if number in settings:
                settings[number][name] = float(value)
        return tuple(Case(number=number, values=tuple(found[name] for name in names)) for number, found in settings.items())


def wait_again(path: Path) -> int:
    """Let cases wait again that were refused, had an error or lost their worker: what was kept of them is deleted. Returns how many.

    Raises
    ------
    InputRefused : if the file cannot be written; nothing was changed then.
    """
    ended = f"""(SELECT number FROM "case" WHERE status IN {AGAIN})"""
    with _writing(Path(path)) as connection:
        for table in ("outcome", "trace"):
            connection.execute(f'DELETE FROM {table} WHERE "case" IN {ended}')
        return connection.execute(f"""UPDATE "case" SET status = 'waiting', reason = '' WHERE number IN {ended}""").rowcount


def add_results(path: Path, plan: StudyPlan, results: Sequence[CaseResult]) -> None:
    """Keep finished cases, on the disk when the function returns; a case that is kept already stays as it is.

    Raises
    ------
    InputRefused : if the file cannot be written; nothing of these cases is kept then.
    """
    with _writing(Path(path)) as connection:
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
    """A channel of all cases that went as planned, (cases, times).

    Raises
    ------
    InputRefused : if the file is no study that this version can read.
    """
    query = """SELECT samples FROM trace JOIN "case" ON number = "case" WHERE name = ? AND status IN ('done', 'stopped') ORDER BY number"""
    with _reading(Path(path)) as connection:
        size = len(_plan(connection).trace_time)
        rows = [np.frombuffer(row["samples"], "<f4") for row in connection.execute(query, (channel,))]
        return np.array(rows, dtype=np.float64).reshape(len(rows), size)


@contextmanager
def study_held(path: Path) -> Iterator[None]:
    """Nobody else runs cases of this study meanwhile. Where all are done at the end, and nobody reads, the study is one file again.

    Raises
    ------
    InputRefused : if somebody does, or the file is no study.
    """
    with _locked(Path(path)), _opened(Path(path)) as connection:  # stays open: not every transaction ends in folding the log
        try:
            yield
        finally:
            with suppress(sqlite3.Error):
                if connection.execute("""SELECT 1 FROM "case" WHERE status = 'waiting' LIMIT 1""").fetchone() is None:
                    connection.execute("PRAGMA journal_mode = DELETE")


@contextmanager
def _locked(path: Path) -> Iterator[BinaryIO]:
    """The file, which only one `rille sweep` at a time works on.

    It is opened before SQLite opens it and closed after: closing it drops the locks that SQLite holds in this process.
    """
    try:
        file = path.open("rb")
    except OSError as error:
        raise InputRefused(f"the study '{path}' cannot be opened: {error.strerror}; make one: `rille sweep STUDY.toml`") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not os.path.samestat(os.fstat(file.fileno()), path.stat()):
                raise FileNotFoundError  # deleted, or begun anew, since it was opened
        except OSError:
            raise InputRefused(f"another `rille sweep` is at work on '{path}'; wait for it or choose another file") from None
        yield file


@contextmanager
def _reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection that sees the study at one moment. What cannot be made sense of inside is damage, and refused."""
    try:
        with _opened(path) as connection:
            connection.execute("BEGIN")
            for table in PLANNED:
                health = connection.execute(f'PRAGMA quick_check("{table}")').fetchone()[0]
                if health != "ok":
                    raise ValueError(health)
            yield connection
    except InputRefused:
        raise
    except (ArithmeticError, LookupError, TypeError, ValueError, struct.error) as error:
        raise InputRefused(f"the study '{path}' is damaged ({error}); restore it from a copy, or begin anew with --force") from error


@contextmanager
def _writing(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection inside one transaction, which readers neither see before its end nor hold up."""
    with _opened(path) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        with transaction(connection):
            yield connection


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection to a study; it writes only to undo or complete what a killed program left."""
    if not path.is_file():
        raise InputRefused(f"there is no study '{path}'; make one: `rille sweep STUDY.toml`")
    try:
        with closing(sqlite3.connect(address(path, _mode(path)), uri=True, isolation_level=None, timeout=BUSY)) as connection:
            connection.row_factory = sqlite3.Row
            require_kind(connection, path, kind="study", application=STUDY_ID, version=STUDY_VERSION, name="another file")
            yield connection
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise InputRefused(
            f"the study '{path}' cannot be used: {error}; nothing was changed (is it damaged, held by another program, or the disk full?)"
        ) from error


def _mode(path: Path) -> str:
    """How SQLite may open a file. Where it must not write, it reads a log that is there, and needs to be told if there is none."""
    if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK):
        return "rw"
    return "ro" if any(each.exists() for each in beside(path)) else "ro&immutable=1"
