"""Does the ledger keep what was given, in its order, and does `verify` say which part of it was changed?"""

import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace

import pytest

from rille import store
from rille.model import InputRefused
from rille.model.ledger import Answer, Ledger, ProofPlan, Score, SealedTrial
from rille.proof.seal import answered, canonical_json, chain_hash, chain_start, conceal, merkle_root, seal, sha256
from rille.proof.verify import verify
from rille.store.ledger import add_answer, create_ledger, open_truths, read_ledger, write_scores

KINDS = ("backlash", "coulomb_friction", "motor_lag", "tether_pull", "bias")


def score(truth, answer: Answer):
    """1 if the answer names what is concealed."""
    named = json.loads(answer.text).get("kind") if answer.status == "done" else None
    return {"right": 1.0 * (named == truth["kind"]), "status": answer.status}


def sealed(trials=5):
    """A plan, its trials and their truths."""
    truths = tuple(conceal(k, {"kind": KINDS[k % len(KINDS)], "size": 0.1 * k}) for k in range(trials))
    sealed = tuple(SealedTrial(number=t.trial, machine="arm", seal=seal(t), recording=sha256(f"files {t.trial}")) for t in truths)
    plan = ProofPlan(
        beacon="a sentence",
        version="0.5.0",
        code=sha256("code"),
        isolation="landlock 7",
        counts={"one": trials - 1, "nothing": 1},
        root=merkle_root([t.seal for t in sealed]),
        sealed=1.8e9,
    )
    return plan, sealed, truths


def next_answer(previous, trial, status="done", **changes):
    """An answer; its text is as the status asks for."""
    text = canonical_json({"kind": KINDS[trial % len(KINDS)] if trial != 2 else "none"}) if status == "done" else "Traceback"
    fields = {"recording": sha256(f"files {trial}"), "seconds": 3.25, "begun": 1.8e9 + 10 * trial, "ended": 1.8e9 + 10 * trial + 3.25}
    return answered(previous, trial, status, text, **(fields | changes))


def answers_of(plan, trials):
    """Answers to all trials, in an order of their own; one crashed."""
    previous, given = chain_start(plan, trials), []
    for trial in (3, 0, 1, 4, 2):
        given.append(next_answer(previous, trial, "crashed" if trial == 1 else "done"))
        previous = given[-1].chain
    return tuple(given)


def scores_of(truths, given):
    by_trial = {answer.trial: answer for answer in given}
    return tuple(Score(trial=t.trial, text=canonical_json(score(json.loads(t.text), by_trial[t.trial]))) for t in truths)


@pytest.fixture
def whole() -> Ledger:
    """A ledger to which all was given."""
    plan, trials, truths = sealed()
    given = answers_of(plan, trials)
    return Ledger(plan=plan, trials=trials, answers=given, truths=truths, scores=scores_of(truths, given))


@pytest.fixture
def ledger(tmp_path, whole):
    """The same in a file."""
    path = tmp_path / "ledger.db"
    create_ledger(path, whole.plan, whole.trials)
    for answer in whole.answers:
        add_answer(path, answer)
    open_truths(path, whole.truths)
    write_scores(path, whole.scores)
    return path


def test_a_ledger_comes_back_as_it_went_in_and_holds(ledger, whole):
    assert read_ledger(ledger) == whole
    assert verify(read_ledger(ledger), score) == ()
    assert [file.name for file in ledger.parent.iterdir()] == [ledger.name]


def test_every_column_of_the_ledger_carries_its_unit_and_every_table_is_strict(ledger):
    with closing(sqlite3.connect(ledger)) as connection:
        tables = connection.execute("SELECT name, strict FROM pragma_table_list WHERE type = 'table' AND schema = 'main'").fetchall()
        for name, strict in tables:
            if name.startswith("sqlite_"):
                continue
            assert strict, name
            sql = connection.execute("SELECT sql FROM sqlite_master WHERE name = ?", (name,)).fetchone()[0]
            for _, column, *_ in connection.execute(f"PRAGMA table_info({name})"):
                assert re.search(rf"^\s*{column} (?:INTEGER|REAL|TEXT|BLOB).*-- \[[^\]]+\] \S", sql, re.MULTILINE), f"{name}.{column}"
        assert connection.execute("PRAGMA application_id").fetchone()[0] == int.from_bytes(b"RILP")


@pytest.mark.parametrize("table", ["plan", "trial", "answer", "truth", "score"])
def test_no_row_can_be_changed_or_removed_by_hand(ledger, table):
    with closing(sqlite3.connect(ledger)) as connection:
        column = connection.execute(f"PRAGMA table_info({table})").fetchall()[1][1]
        for change in (f"UPDATE {table} SET {column} = {column}", f"DELETE FROM {table}"):
            with pytest.raises(sqlite3.IntegrityError, match=r"sealed|once"):
                connection.execute(change)


# --- order of the writes


def test_before_the_last_answer_nothing_of_the_truth_is_in_the_file(tmp_path, whole):
    path = tmp_path / "ledger.db"
    create_ledger(path, whole.plan, whole.trials)
    for answer in whole.answers[:-1]:
        add_answer(path, answer)
    with pytest.raises(InputRefused, match="after the last answer"):
        open_truths(path, whole.truths)
    content = path.read_bytes()
    assert not any(truth.nonce in content or truth.text.encode() in content for truth in whole.truths)
    with pytest.raises(InputRefused, match="score"):
        write_scores(path, whole.scores)
    add_answer(path, whole.answers[-1])
    with pytest.raises(InputRefused, match="truths of 1 trials are missing, the first of trial 0"):
        open_truths(path, whole.truths[1:])
    assert read_ledger(path).truths == ()
    open_truths(path, whole.truths)
    with pytest.raises(InputRefused, match="exists twice"):
        open_truths(path, whole.truths)


def test_an_answer_is_given_once_to_a_sealed_trial_at_the_end_of_the_chain(tmp_path, whole):
    path = tmp_path / "ledger.db"
    create_ledger(path, whole.plan, whole.trials)
    first, second = whole.answers[:2]
    add_answer(path, first)
    with pytest.raises(InputRefused, match=f"follows {first.previous}, but the last one, of trial 3, is {first.chain}"):
        add_answer(path, next_answer(first.previous, 0))
    with pytest.raises(InputRefused, match="trial 3 exists twice"):
        add_answer(path, next_answer(first.chain, 3))
    with pytest.raises(InputRefused, match="trial 17"):
        add_answer(path, next_answer(first.chain, 17))
    with pytest.raises(InputRefused, match="status"):
        add_answer(path, replace(second, status="well"))
    with pytest.raises(InputRefused, match="json_valid"):
        add_answer(path, replace(second, text="no JSON"))
    add_answer(path, second)
    assert read_ledger(path).answers == (first, second)


def test_files_that_are_no_ledger_are_refused(tmp_path, ledger, whole):
    with pytest.raises(InputRefused, match="exists already"):
        create_ledger(ledger, whole.plan, whole.trials)
    with pytest.raises(InputRefused, match="no ledger"):
        read_ledger(tmp_path / "none.db")
    (tmp_path / "text.db").write_text("a text, and no database at all")
    with pytest.raises(InputRefused, match="cannot be used"):
        read_ledger(tmp_path / "text.db")
    store.create(tmp_path / "model.db")
    with pytest.raises(InputRefused, match=r"is no ledger \(application_id 1380535372"):
        read_ledger(tmp_path / "model.db")
    with pytest.raises(InputRefused, match="isolation"):
        create_ledger(tmp_path / "other.db", replace(whole.plan, isolation="good will"), whole.trials)
    assert not list(tmp_path.glob("other*"))


def test_a_ledger_that_may_only_be_read_is_verified(ledger):
    ledger.chmod(0o444)
    assert verify(read_ledger(ledger), score) == ()


# --- kill -9

ANSWERING = """
import sys
sys.path.insert(0, {tests!r})
from pathlib import Path
from test_ledger import next_answer
from rille.proof.seal import chain_start
from rille.store.ledger import add_answer, read_ledger
path = Path({path!r})
kept = read_ledger(path)
previous = kept.answers[-1].chain if kept.answers else chain_start(kept.plan, kept.trials)
for trial in range(len(kept.answers), len(kept.trials)):
    answer = next_answer(previous, trial)
    print(trial, flush=True)
    add_answer(path, answer)
    previous = answer.chain
"""


def test_a_ledger_whose_program_is_killed_at_any_moment_goes_on(tmp_path):
    path = tmp_path / "ledger.db"
    plan, trials, truths = sealed(60)
    create_ledger(path, plan, trials)
    code = ANSWERING.format(tests=os.path.dirname(__file__), path=str(path))  # noqa: PTH120
    kept = 0
    for kills in (5, 23, 24, 41):
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            for line in child.stdout:
                if int(line) >= kills:
                    child.send_signal(signal.SIGKILL)
                    break
        now = read_ledger(path)
        assert {flaw.check for flaw in verify(now)} == {"count"}  # what is missing, and nothing else
        assert len(now.answers) >= max(kept, kills - 1)
        kept = len(now.answers)
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, timeout=60)
    given = read_ledger(path).answers
    open_truths(path, truths)
    write_scores(path, scores_of(truths, given))
    assert verify(read_ledger(path), score) == ()


KILLED_WITHIN = """
import os, signal, sys
sys.path.insert(0, {tests!r})
from dataclasses import replace
from pathlib import Path
from test_ledger import next_answer
from rille.proof.seal import answered, chain_start
from rille.store import ledger
insert = ledger.insert
def insert_and_die(connection, *row):
    insert(connection, *row)
    connection.execute("PRAGMA cache_spill = 1")
    os.kill(os.getpid(), signal.SIGKILL)
ledger.insert = insert_and_die
kept = ledger.read_ledger(Path({path!r}))
big = answered(chain_start(kept.plan, kept.trials), 3, "crashed", "x" * 30_000_000, kept.trials[3].recording, 1, 1.8e9, 1.8e9)
ledger.add_answer(Path({path!r}), big)
"""


def test_a_transaction_that_was_killed_half_way_leaves_nothing(tmp_path, whole):
    """The answer is so large that SQLite had to write pages into the file before the end: the next reader undoes it."""
    path = tmp_path / "ledger.db"
    create_ledger(path, whole.plan, whole.trials)
    code = KILLED_WITHIN.format(tests=os.path.dirname(__file__), path=str(path))  # noqa: PTH120
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert (tmp_path / "ledger.db-journal").exists()
    assert read_ledger(path).answers == ()
    add_answer(path, whole.answers[0])
    assert read_ledger(path).answers == whole.answers[:1]


# --- verify


def changed(values, number, **changes):
    """The tuple with one value changed."""
    return tuple(replace(v, **changes) if k == number else v for k, v in enumerate(values))


def swapped(whole: Ledger) -> Ledger:
    """The texts of the first two answers change places, with their digests."""
    one, two = whole.answers[:2]
    first = replace(one, text=two.text, sha256=two.sha256)
    second = replace(two, text=one.text, sha256=one.sha256)
    return replace(whole, answers=(first, second, *whole.answers[2:]))


def rechained(whole: Ledger) -> Ledger:
    """An answer is edited, and its own hashes made to fit."""
    one = replace(whole.answers[1], text='{"kind":"bias"}', sha256=sha256('{"kind":"bias"}'))
    one = replace(one, chain=chain_hash(one))
    return replace(whole, answers=(whole.answers[0], one, *whole.answers[2:]))


MUTATIONS = {  # name -> change, check that must say so, words of a sentence
    "truth edited": (
        lambda w: replace(w, truths=changed(w.truths, 2, text='{"kind":"none","size":0.2}')),
        "seal",
        "the seal of trial 2 is broken",
    ),
    "seal edited": (lambda w: replace(w, trials=changed(w.trials, 2, seal="0" * 64)), "seal", "the seal of trial 2 is broken"),
    "seal is none": (lambda w: replace(w, trials=changed(w.trials, 2, seal="zz")), "root", "the seal of trial 2 is no SHA-256"),
    "nonce edited": (lambda w: replace(w, truths=changed(w.truths, 4, nonce=bytes(32))), "seal", "the seal of trial 4 is broken"),
    "nonce reused": (
        lambda w: replace(w, truths=changed(w.truths, 3, nonce=w.truths[1].nonce)),
        "nonce",
        "trials 1 and 3 share one nonce",
    ),
    "nonce short": (lambda w: replace(w, truths=changed(w.truths, 3, nonce=b"123")), "nonce", "the nonce of trial 3 has 3 bytes"),
    "answer edited": (
        lambda w: replace(w, answers=changed(w.answers, 0, text='{"kind":"bias"}')),
        "answer",
        "the answer of trial 3 was edited",
    ),
    "answer and digest edited": (
        lambda w: replace(w, answers=changed(w.answers, 0, text="{}", sha256=sha256("{}"))),
        "chain",
        "the entry of trial 3 was edited",
    ),
    "answer and its chain hash edited": (rechained, "chain", "the chain is broken at the answer of trial 1"),
    "answers swapped": (swapped, "chain", "the entry of trial 3 was edited"),
    "order changed": (
        lambda w: replace(w, answers=(w.answers[1], w.answers[0], *w.answers[2:])),
        "chain",
        "the chain is broken at the answer of trial 0",
    ),
    "status edited": (lambda w: replace(w, answers=changed(w.answers, 2, status="refused")), "chain", "the entry of trial 1 was edited"),
    "time edited": (lambda w: replace(w, answers=changed(w.answers, 2, seconds=1.0)), "chain", "the entry of trial 1 was edited"),
    "answer removed": (lambda w: replace(w, answers=w.answers[:-1]), "count", "trial 2 has neither an answer nor a recorded failure"),
    "trial removed": (lambda w: replace(w, trials=w.trials[:-1]), "count", "trial 4 of 5 is missing"),
    "trial with all its rows removed": (
        lambda w: replace(
            w,
            trials=w.trials[1:],
            truths=w.truths[1:],
            scores=w.scores[1:],
            answers=tuple(a for a in w.answers if a.trial != 0),
        ),
        "root",
        "the seals have the Merkle root",
    ),
    "trial and plan reduced": (
        lambda w: replace(
            w,
            plan=replace(w.plan, counts={"one": 4}, root=merkle_root([t.seal for t in w.trials[:-1]])),
            trials=w.trials[:-1],
            truths=w.truths[:-1],
            scores=w.scores[:-1],
            answers=tuple(a for a in w.answers if a.trial != 4),
        ),
        "chain",
        "the plan with its root and trials",
    ),
    "truth withheld": (lambda w: replace(w, truths=w.truths[1:], scores=w.scores[1:]), "count", "trial 0 has no opened truth"),
    "score edited": (
        lambda w: replace(w, scores=changed(w.scores, 2, text='{"right":1.0,"status":"done"}')),
        "score",
        "the score of trial 2 is not that of truth and answer: right is stored as 1.0, computed as 0.0",
    ),
    "score with more in it": (
        lambda w: replace(w, scores=changed(w.scores, 2, text='{"right":0,"status":"done","z":1}')),
        "score",
        "the score of trial 2 is not that of truth and answer",
    ),
    "score removed": (lambda w: replace(w, scores=w.scores[1:]), "score", "trial 0 has no score"),
    "root edited": (lambda w: replace(w, plan=replace(w.plan, root="0" * 64)), "root", f"the plan states {'0' * 64}"),
    "beacon edited": (lambda w: replace(w, plan=replace(w.plan, beacon="a better one")), "chain", "the plan with its root and trials"),
    "recording exchanged": (
        lambda w: replace(w, answers=changed(w.answers, 3, recording="1" * 64)),
        "recording",
        f"trial 4 was answered from files {'1' * 64}",
    ),
    "recording exchanged where it was sealed": (
        lambda w: replace(w, trials=changed(w.trials, 4, recording="1" * 64)),
        "recording",
        f"made for it were {'1' * 64}",
    ),
    "sealed after the answers": (lambda w: replace(w, plan=replace(w.plan, sealed=1.9e9)), "answer", "before the sealing"),
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_what_was_changed_is_named(whole, name):
    change, check, words = MUTATIONS[name]
    found = verify(change(whole), score)
    assert any(flaw.check == check and words in flaw.sentence for flaw in found), [flaw.sentence for flaw in found]


def test_scores_may_differ_in_the_last_digits_only(whole):
    def near(shift):
        return lambda truth, answer: score(truth, answer) | {"right": score(truth, answer)["right"] * (1 + shift)}

    assert verify(whole, near(1e-12)) == ()
    assert {flaw.check for flaw in verify(whole, near(1e-6))} == {"score"}


def test_a_score_that_cannot_be_computed_is_a_flaw(whole):
    found = verify(whole, lambda truth, answer: {"right": truth["missing"]})
    assert len(found) == len(whole.scores)
    assert "KeyError" in found[0].sentence


def test_a_forger_who_takes_the_triggers_away_is_found(ledger):
    with closing(sqlite3.connect(ledger)) as connection:
        connection.execute("DROP TRIGGER answer_stays")
        connection.execute('UPDATE answer SET answer = \'{"kind":"none"}\' WHERE trial = 4')
        connection.commit()
    assert [(flaw.check, flaw.trial) for flaw in verify(read_ledger(ledger))] == [("answer", 4), ("chain", 4)]
