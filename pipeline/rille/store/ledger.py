"""The ledger of sealed trials <-> ``schema/ledger.sql``. Every write is one transaction, on the disk when the function returns."""

import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from rille.model import InputRefused
from rille.model.ledger import Answer, Ledger, ProofPlan, Score, SealedTrial, Truth
from rille.store.database import address, insert, require_kind, schema_folder, transaction

LEDGER_ID = 1380535376  # "RILP"
LEDGER_VERSION = 1


def create_ledger(path: Path, plan: ProofPlan, trials: Sequence[SealedTrial]) -> None:
    """A new ledger with its plan and seals: there whole or not at all.

    Raises
    ------
    InputRefused : if the file exists, or a value breaks a rule of the schema.
    """
    path = Path(path)
    if path.exists():
        raise InputRefused(f"the ledger '{path}' exists already; go on with it or choose another name")
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    try:
        with closing(sqlite3.connect(part, isolation_level=None)) as connection:
            connection.executescript((schema_folder() / "ledger.sql").read_text())
            connection.execute("BEGIN")
            row = {"beacon": plan.beacon, "version": plan.version, "code_sha256": plan.code, "isolation": plan.isolation}
            row |= {"counts": json.dumps(dict(plan.counts)), "merkle_root": plan.root, "sealed": plan.sealed}
            insert(connection, "plan", "the plan", row)
            for t in trials:
                row = {"number": t.number, "machine": t.machine, "seal": t.seal, "recording_sha256": t.recording}
                insert(connection, "trial", f"trial {t.number}", row)
            connection.execute("COMMIT")
        os.link(part, path)  # fails where a ledger is
    except (sqlite3.Error, OSError) as error:
        raise InputRefused(f"the ledger '{path}' could not be made: {error}; is the folder writable and the disk not full?") from error
    finally:
        part.unlink(missing_ok=True)


def read_ledger(path: Path) -> Ledger:
    """All that a ledger holds.

    Raises
    ------
    InputRefused : if the file is no ledger that this version can read.
    """
    with _opened(Path(path)) as connection:
        connection.execute("BEGIN")  # all tables at one moment
        plan = connection.execute("SELECT * FROM plan").fetchone()
        if plan is None:
            raise InputRefused(f"the ledger '{path}' has no plan; it proves nothing, restore it from a copy")
        return Ledger(
            plan=ProofPlan(
                beacon=plan["beacon"],
                version=plan["version"],
                code=plan["code_sha256"],
                isolation=plan["isolation"],
                counts=json.loads(plan["counts"]),
                root=plan["merkle_root"],
                sealed=plan["sealed"],
            ),
            trials=tuple(
                SealedTrial(number=r["number"], machine=r["machine"], seal=r["seal"], recording=r["recording_sha256"])
                for r in connection.execute("SELECT * FROM trial ORDER BY number")
            ),
            answers=tuple(_answer(row) for row in connection.execute("SELECT * FROM answer ORDER BY id")),
            truths=tuple(
                Truth(trial=r["trial"], text=r["truth"], nonce=r["nonce"]) for r in connection.execute("SELECT * FROM truth ORDER BY trial")
            ),
            scores=tuple(Score(trial=r["trial"], text=r["score"]) for r in connection.execute("SELECT * FROM score ORDER BY trial")),
        )


def _answer(row: sqlite3.Row) -> Answer:
    return Answer(
        trial=row["trial"],
        status=row["status"],
        text=row["answer"],
        sha256=row["answer_sha256"],
        recording=row["recording_sha256"],
        seconds=row["seconds"],
        begun=row["begun"],
        ended=row["ended"],
        previous=row["previous"],
        chain=row["chain"],
    )


def add_answer(path: Path, answer: Answer) -> None:
    """Add an answer to the end of the chain.

    Raises
    ------
    InputRefused : if the trial has one or was never sealed, the answer does not follow the last one, or truths are opened.
    """
    row: Mapping[str, object] = {
        "trial": answer.trial,
        "status": answer.status,
        "answer": answer.text,
        "answer_sha256": answer.sha256,
        "recording_sha256": answer.recording,
        "seconds": answer.seconds,
        "begun": answer.begun,
        "ended": answer.ended,
        "previous": answer.previous,
        "chain": answer.chain,
    }
    with _writing(Path(path)) as connection:
        last = connection.execute("SELECT trial, chain FROM answer ORDER BY id DESC LIMIT 1").fetchone()
        if last is not None and last["chain"] != answer.previous:
            raise InputRefused(
                f"the answer of trial {answer.trial} follows {answer.previous}, but the last one, of trial {last['trial']}, "
                f"is {last['chain']}; chain it to that one"
            )
        insert(connection, "answer", f"the answer of trial {answer.trial}", row)


def open_truths(path: Path, truths: Sequence[Truth]) -> None:
    """Open the seals, all at once, after the last answer.

    Raises
    ------
    InputRefused : if a trial has no answer yet, not all truths are given, or they are opened already.
    """
    with _writing(Path(path)) as connection:
        missing = {row["number"] for row in connection.execute("SELECT number FROM trial")} - {truth.trial for truth in truths}
        if missing:
            raise InputRefused(f"the truths of {len(missing)} trials are missing, the first of trial {min(missing)}; open all at once")
        for truth in truths:
            row = {"trial": truth.trial, "truth": truth.text, "nonce": truth.nonce}
            insert(connection, "truth", f"the truth of trial {truth.trial}", row)


def write_scores(path: Path, scores: Sequence[Score]) -> None:
    """Keep the scores, all at once, after the truths were opened.

    Raises
    ------
    InputRefused : if a trial's truth is not opened, or it has a score already.
    """
    with _writing(Path(path)) as connection:
        for score in scores:
            insert(connection, "score", f"the score of trial {score.trial}", {"trial": score.trial, "score": score.text})


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection to a ledger; it writes only to undo a transaction that a killed program left."""
    if not path.is_file():
        raise InputRefused(f"there is no ledger '{path}'; make one: `rille prove --beacon \"some sentence\"`")
    mode = "rw" if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK) else "ro"
    try:
        with closing(sqlite3.connect(address(path, mode), uri=True, isolation_level=None, timeout=10)) as connection:
            connection.row_factory = sqlite3.Row
            require_kind(connection, path, kind="ledger", application=LEDGER_ID, version=LEDGER_VERSION, name="a ledger")
            yield connection
    except sqlite3.DatabaseError as error:
        raise InputRefused(f"the ledger '{path}' cannot be used: {error}; nothing was changed") from error


@contextmanager
def _writing(path: Path) -> Iterator[sqlite3.Connection]:
    """Connection inside one transaction: committed and on the disk at the end, rolled back by any exception."""
    with _opened(path) as connection:
        connection.execute("PRAGMA synchronous = FULL")
        with transaction(connection):
            yield connection
