"""Opening, creating and migrating databases; every refusal in one sentence, and nothing refused is ever changed."""

import json
import re
import sqlite3
import struct
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path

from rille.model import InputRefused
from rille.store.soundness import problems

APPLICATION_ID = 1380535372  # "RILL"
SQLITE = b"SQLite format 3\x00"  # how every database begins


def beside(path: Path) -> list[Path]:
    """Files that SQLite keeps beside a database that is open, or that a killed program left; whether they are there or not."""
    return [path.with_name(path.name + ending) for ending in ("-wal", "-shm", "-journal")]


@cache
def schema_folder() -> Path:
    """Folder with ``schema.sql``: that of the checkout, else the one installed inside the package."""
    package = Path(__file__).resolve().parent.parent
    for folder in (package.parent.parent / "schema", package / "schema"):
        if (folder / "schema.sql").is_file():
            return folder
    raise FileNotFoundError(f"schema.sql is missing beside {package}; install rille again")


def schema_text() -> str:
    """The SQL that makes a fresh database."""
    return (schema_folder() / "schema.sql").read_text()


@cache
def schema_version() -> int:
    """The ``user_version`` that ``schema.sql`` gives a fresh database."""
    found = re.search(r"PRAGMA user_version = (\d+)", schema_text())
    assert found is not None
    return int(found.group(1))


def address(path: Path, mode: str = "ro") -> str:
    """What SQLite opens as a URI: the file of exactly that name, whatever signs are in it."""
    return f"{Path(path).absolute().as_uri()}?mode={mode}"


def create(path: Path) -> None:
    """Make an empty database of rille.

    Raises
    ------
    InputRefused : if the file exists, or its folder does not.
    """
    path = Path(path)
    if path.exists():
        raise InputRefused(f"'{path}' exists already; choose another name or remove it")
    if not path.parent.is_dir():
        raise InputRefused(f"the folder '{path.parent}' does not exist; create it first")
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    try:
        with closing(sqlite3.connect(part)) as connection:
            connection.execute("PRAGMA journal_mode = WAL")  # readers see what a running solver has committed
            connection.executescript(schema_text())
            for rows in ("views.sql", "effects.sql"):
                connection.executescript((schema_folder() / rows).read_text())
            connection.commit()
        part.rename(path)
    except (sqlite3.Error, OSError) as error:
        part.unlink(missing_ok=True)
        raise InputRefused(f"'{path}' could not be created: {error}; is the folder writable and the disk not full?") from error


def remove_database(path: Path) -> None:
    """Remove a database with what SQLite keeps beside it, if it is there; the database last, so that nothing outlives it."""
    for file in (*beside(Path(path)), Path(path)):
        file.unlink(missing_ok=True)


@contextmanager
def made_if_absent(path: Path) -> Iterator[None]:
    """A database to write into, made if it is absent; one that was made for what was refused or interrupted is removed again.

    Raises
    ------
    InputRefused : if it cannot be made.
    """
    made = not Path(path).exists()
    if made:
        create(path)
    try:
        yield
    except BaseException:
        if made:
            remove_database(path)
        raise


_sound: dict[Path, tuple[int, int, int]] = {}  # files that this process has found sound, as they were then: inode, size, time of change


def _probe(path: Path, *, may_be_older: bool, known_sound: bool = False) -> int:
    """Read header and version without writing a byte; return the version. The whole file is checked once for each of its states."""
    if not path.exists():
        raise InputRefused(
            f"there is no file '{path}'; check the path, or make it: `rille cad build SHEET.toml -o {path}` for a machine, "
            f"`rille terrain build SCENE.toml -o {path}` for ground; `rille run` fills it with results"
        )
    if not path.is_file():
        raise InputRefused(f"'{path}' is a folder, not a database")
    with path.open("rb") as file:
        header = file.read(100)
    if header[: len(SQLITE)] != SQLITE:
        raise InputRefused(f"'{path}' is not an SQLite database")
    if len(header) < 100:
        raise InputRefused(f"'{path}' is truncated ({len(header)} bytes); restore it from a copy")
    try:
        with closing(sqlite3.connect(address(path), uri=True)) as connection:
            application = connection.execute("PRAGMA application_id").fetchone()[0]
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            if application != APPLICATION_ID:
                raise InputRefused(f"'{path}' is a database of another program (application_id {application}, rille's is {APPLICATION_ID})")
            status = path.stat()
            state = (status.st_ino, status.st_size, status.st_mtime_ns)
            known_sound = known_sound or _sound.get(path.resolve()) == state
            health = "ok" if known_sound else connection.execute("PRAGMA quick_check(1)").fetchone()[0]
            if health == "ok":
                _sound[path.resolve()] = state
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        raise InputRefused(f"'{path}' cannot be read: {error}; it is damaged or truncated, restore it from a copy") from error
    if health != "ok":
        raise InputRefused(f"'{path}' is damaged ({health}); restore it from a copy")
    if version > schema_version():
        raise InputRefused(f"'{path}' has schema version {version}, newer than {schema_version()}; upgrade rille")
    if version < schema_version() and not may_be_older:
        raise InputRefused(f"'{path}' has schema version {version}, older than {schema_version()}; run `rille db migrate {path}`")
    return version


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection that only reads; rows come as ``sqlite3.Row``.

    Raises
    ------
    InputRefused : if the file is none of ours, or what was read made no sense and the file proves damaged.
    """
    path = Path(path)
    _probe(path, may_be_older=False)
    try:
        with closing(sqlite3.connect(address(path), uri=True)) as connection:
            connection.row_factory = sqlite3.Row
            yield connection
    except (sqlite3.Error, UnicodeDecodeError) as error:  # pages that look sound, and text that is none
        raise InputRefused(f"'{path}' cannot be read: {error}; it is damaged, restore it from a copy") from error
    except InputRefused:
        raise
    except (LookupError, ValueError, TypeError) as error:  # a row that cannot be: is it the file, or a fault of ours?
        if found := problems(path, schema_text()):
            raise InputRefused(f"'{path}' is damaged ({found[0]}); restore it from a copy") from error
        raise


@contextmanager
def writing(path: Path, *, known_sound: bool = False) -> Iterator[sqlite3.Connection]:
    """Connection inside one transaction: committed at the end, rolled back by any exception.

    known_sound : the caller has had the file open before; its pages are not all read again.
    """
    path = Path(path)
    _probe(path, may_be_older=False, known_sound=known_sound)
    try:
        with closing(sqlite3.connect(path, isolation_level=None, timeout=10)) as connection:
            connection.row_factory = sqlite3.Row
            with transaction(connection):
                yield connection
    except sqlite3.OperationalError as error:
        raise InputRefused(
            f"'{path}' could not be written: {error}; nothing was changed (is it locked, read-only, or the disk full?)"
        ) from error


def require_kind(connection: sqlite3.Connection, path: Path, *, kind: str, application: int, version: int, name: str) -> None:
    """Refuse a file that is not of a kind of ours besides models ("ledger"), or of another version. name : what to name in its place.

    Raises
    ------
    InputRefused : if it is not.
    """
    found = connection.execute("PRAGMA application_id").fetchone()[0]
    held = connection.execute("PRAGMA user_version").fetchone()[0]
    if found != application:
        raise InputRefused(f"'{path}' is no {kind} (application_id {found}, a {kind} has {application}); name {name}")
    if held != version:
        raise InputRefused(f"the {kind} '{path}' has version {held}, this rille reads {version}; use the rille that made it")


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """One transaction with foreign keys: committed at the end, rolled back by any exception."""
    connection.execute("PRAGMA foreign_keys = ON")
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
    except BaseException:
        if connection.in_transaction:  # a full disk makes SQLite roll back by itself
            connection.execute("ROLLBACK")
        raise
    connection.execute("COMMIT")


@contextmanager
def held_open(path: Path) -> Iterator[None]:
    """Keep one connection open meanwhile, so that each of many small transactions does not end in a checkpoint of the whole journal.

    It may write, so that its end folds the journal into the file: a copy of the file alone is whole again.
    """
    _probe(Path(path), may_be_older=False)
    with closing(sqlite3.connect(path, isolation_level=None, timeout=10)) as connection:
        connection.execute("SELECT count(*) FROM run").fetchone()  # the file is opened by the first question
        yield


def insert(connection: sqlite3.Connection, table: str, subject: str, row: Mapping[str, object]) -> int:
    """Insert one row and return its key.

    ``subject`` names the row in an error ("body 'rocker_left'").

    Raises
    ------
    InputRefused : if the row breaks a rule of the schema, with the rule and the values that it speaks of.
    """
    columns = ", ".join(row)
    marks = ", ".join("?" for _ in row)
    try:
        return connection.execute(f"INSERT INTO {table} ({columns}) VALUES ({marks})", tuple(row.values())).lastrowid or 0
    except sqlite3.IntegrityError as error:
        raise InputRefused(_broken_rule(table, subject, row, str(error))) from error


def update(connection: sqlite3.Connection, table: str, subject: str, key: int, row: Mapping[str, object]) -> None:
    """Change the row of a key. Raises as ``insert``."""
    try:
        connection.execute(f"UPDATE {table} SET {', '.join(f'{column} = ?' for column in row)} WHERE id = ?", (*row.values(), key))
    except sqlite3.IntegrityError as error:
        raise InputRefused(_broken_rule(table, subject, row, str(error))) from error


def _broken_rule(table: str, subject: str, row: Mapping[str, object], message: str) -> str:
    kind, _, rule = message.partition(": ")
    concerned = {c: v for c, v in row.items() if re.search(rf"\b{c}\b", rule) and not isinstance(v, bytes)}
    values = ", ".join(f"{c} = {v}" for c, v in concerned.items())
    if kind.startswith("CHECK"):
        if "ixx" in rule and "iyy + izz" in rule:
            return f"the inertia of {subject} breaks the triangle inequality ({values} kg m^2); no body has such moments"
        return f"{subject} breaks the rule `{rule}` of table {table} ({values}); correct the value"
    if kind.startswith("NOT NULL"):
        return f"{subject} has no finite value for {rule.removeprefix(table + '.')}; give one"
    if kind.startswith("UNIQUE"):
        mend = "choose another name" if "name" in concerned else "leave one of the two out"
        return f"{subject} exists twice in table {table} ({values}); {mend}"
    return f"{subject} cannot be stored in table {table}: {message}"


def migrate(path: Path) -> tuple[int, int]:
    """Bring an older database to the present schema, step by step, each step in one transaction.

    Returns
    -------
    The version before and after. A step that fails leaves the database at the version before that step.
    """
    path = Path(path)
    before = _probe(path, may_be_older=True)
    steps = {int(file.name[:4]): file for file in sorted((schema_folder() / "migrations").glob("[0-9]*.sql"))}
    with closing(sqlite3.connect(path, isolation_level=None, timeout=10)) as connection:
        connection.create_function("float64_block", 1, _float64_block, deterministic=True)  # of migration 5
        for version in range(before + 1, schema_version() + 1):
            if version not in steps:
                raise InputRefused(f"there is no migration to version {version}; '{path}' stays at version {version - 1}")
            apply_step(connection, version, steps[version].read_text())
        if before < schema_version():
            for rows in ("views.sql", "effects.sql"):
                connection.executescript((schema_folder() / rows).read_text())
    return before, schema_version()


def _float64_block(numbers: str) -> bytes:
    values = [float("nan") if value is None else float(value) for value in json.loads(numbers)]
    return struct.pack(f"<{len(values)}d", *values)


def apply_step(connection: sqlite3.Connection, version: int, sql: str) -> None:
    """Run one migration in one transaction and record its version; on failure nothing of it remains."""
    try:
        connection.executescript(f"BEGIN IMMEDIATE;\n{sql}\n;PRAGMA user_version = {version};\nCOMMIT;")
    except sqlite3.Error as error:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise InputRefused(f"the migration to version {version} failed ({error}); the database stays as it was") from error
