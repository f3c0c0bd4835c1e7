"""The file of a study: nothing that is kept is lost, readers stop nobody, and what is damaged is said to be."""

import os
import shutil
import signal
import sqlite3
import subprocess
import time
from contextlib import closing
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

from rille import store
from rille.model import InputRefused
from rille.model.study import CaseResult, TracedChannel
from rille.store import study as study_file
from rille.study import design_cases
from study.function_studies import angles, plan

COUNT = 12
CHANNEL = TracedChannel(name="joint.position.a", unit="rad", quantity="joint.position", target="a", component=0)
ASKED = plan("latin_hypercube", COUNT, angles(2), traced=(CHANNEL,), trace_time=(0.0, 0.5, 1.0))


def done(*numbers, status="done"):
    """Results of cases: y is ten times the number."""
    reason = "" if status == "done" else f"it {status}"
    return [
        CaseResult(number=k, status=status, reason=reason, outcomes={"y": 10.0 * k}, traces=np.array([[k, k + 1, k + 2]])) for k in numbers
    ]


def made(path, finished=0):
    """A study of which so many cases are done."""
    store.create_study(path, ASKED, design_cases(ASKED, 2, 100))
    with store.study_held(path):
        store.add_results(path, ASKED, done(*range(finished)))
    return path


@pytest.fixture
def path(tmp_path):
    return tmp_path / "study.db"


def test_what_was_written_is_read(path):
    made(path, COUNT)
    table = store.read_study(path)
    assert table.plan == ASKED
    assert table.status == ("done",) * COUNT
    np.testing.assert_array_equal(table.outcomes[:, 0], 10.0 * np.arange(COUNT))
    np.testing.assert_array_equal(table.values, [case.values for case in design_cases(ASKED, 2, 100)])
    np.testing.assert_array_equal(store.read_traces(path, CHANNEL.name), np.add.outer(np.arange(COUNT), [0, 1, 2]))
    assert list(path.parent.iterdir()) == [path]


def create(path, name, start, told):
    start.wait()
    try:
        store.create_study(path, replace(ASKED, name=name), design_cases(ASKED, 2, 100))
        told.put(name)
    except InputRefused as refusal:
        told.put(str(refusal))


def test_of_two_that_begin_the_same_study_one_does(tmp_path):
    """Ten times at the same moment; with one temporary name for both, a study without a plan was left now and then."""
    context = get_context("fork")
    for attempt in range(10):
        path, start, told = tmp_path / f"{attempt}.db", context.Barrier(2), context.Queue()
        both = [context.Process(target=create, args=(path, name, start, told)) for name in ("one", "other")]
        for process in both:
            process.start()
        answers = {told.get(timeout=30) for _ in both}
        for process in both:
            process.join()
        name = store.read_plan(path).name
        assert name in answers
        (sentence,) = answers - {name}
        assert "exists already" in sentence
        assert len(store.waiting_cases(path)) == COUNT
    assert sorted(file.name for file in tmp_path.iterdir()) == [f"{attempt}.db" for attempt in range(10)]


def test_a_reader_that_stays_stops_nobody(path, monkeypatch):
    """It reads for longer than a writer waits, sees what was there when it began, and the study is one file once it has gone."""
    monkeypatch.setattr(study_file, "BUSY", 0.2)
    made(path, 1)
    with closing(sqlite3.connect(path)) as reader:
        reading = reader.execute('SELECT "case" FROM outcome')
        assert reading.fetchone() == (0,)
        begin = time.monotonic()
        with store.study_held(path):
            store.add_results(path, ASKED, done(*range(1, COUNT)))
            assert store.read_study(path).status == ("done",) * COUNT  # results can be read at any time
        assert time.monotonic() - begin < 5
        assert reading.fetchall() == []
    with store.study_held(path):
        pass
    assert path.read_bytes()[18:20] == b"\x01\x01"  # of the header: no write-ahead log
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("finished", [3, COUNT])
def test_a_study_can_be_read_where_nothing_can_be_written(path, tmp_path, finished):
    """On a file system that only reads; SQLite wants to make a log beside a file that had one."""
    made(path, finished)
    disc = tmp_path / "disc"
    disc.mkdir()
    if os.geteuid() != 0:
        shutil.copy(path, disc / "study.db")
        disc.chmod(0o555)
        (disc / "study.db").chmod(0o444)
    elif subprocess.run(["mount", "-t", "tmpfs", "tmpfs", str(disc)], capture_output=True).returncode:
        pytest.skip("mounting is not allowed here, and nothing stops root from writing")
    else:
        shutil.copy(path, disc / "study.db")
        subprocess.run(["mount", "-o", "remount,ro", str(disc)], check=True)
    try:
        assert store.read_study(disc / "study.db").status.count("done") == finished
        with pytest.raises(InputRefused, match="cannot be used"):
            store.wait_again(disc / "study.db")
    finally:
        if os.geteuid() == 0:
            subprocess.run(["umount", "-l", str(disc)], check=True)
        else:
            disc.chmod(0o755)


def killed(path):
    with store.study_held(path):
        for k in range(5):
            store.add_results(path, ASKED, done(k))
        os.kill(os.getpid(), signal.SIGKILL)


def test_kill_loses_nothing_that_was_kept(path):
    made(path)
    process = get_context("fork").Process(target=killed, args=(path,))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    assert path.with_name("study.db-wal").exists()  # it was killed at work
    assert store.read_study(path).status.count("done") == 5
    assert [case.number for case in store.waiting_cases(path)] == list(range(5, COUNT))


def test_a_log_without_its_study_is_not_taken_for_a_part_of_the_next(path):
    path.with_name("study.db-wal").write_bytes(b"of another")
    with pytest.raises(InputRefused, match=r"study\.db-wal.*remove it"):
        made(path)
    assert not path.exists()


def test_cases_that_failed_wait_again(path):
    made(path, 2)
    for number, status in enumerate(("refused", "error", "worker_died", "left_terrain", "stopped"), start=2):
        store.add_results(path, ASKED, done(number, status=status))
    before = store.read_study(path)
    assert store.wait_again(path) == 3
    table = store.read_study(path)
    assert table.status == ("done", "done", "waiting", "waiting", "waiting", "left_terrain", "stopped", *["waiting"] * 5)
    assert table.reason[2:5] == ("", "", "")
    assert np.isnan(table.outcomes[2:5]).all()
    np.testing.assert_array_equal(table.outcomes[[0, 1, 5, 6]], before.outcomes[[0, 1, 5, 6]])
    store.add_results(path, ASKED, done(2, 3, 4))  # outcomes and traces of before are gone, else these would clash
    np.testing.assert_array_equal(store.read_traces(path, CHANNEL.name)[2:5], np.add.outer([2, 3, 4], [0, 1, 2]))


@pytest.mark.parametrize(
    "damage",
    [
        "DELETE FROM study",
        "DELETE FROM factor WHERE id = 1",
        "DELETE FROM measure",
        "UPDATE factor SET choices = '7'",
        "UPDATE factor SET choices = '[\"a\"]'",
        "DELETE FROM \"case\" WHERE number = 3",
        "DELETE FROM setting WHERE \"case\" = 5",
        "UPDATE trace SET samples = x'00000000'",
        "UPDATE \"case\" SET reason = CAST(x'ff' AS TEXT) WHERE number = 1",
        "UPDATE factor SET name = CAST(x'ff' AS TEXT) WHERE id = 1",
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_damaged(path, damage):
    made(path, 3)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA foreign_keys = OFF")
        connection.execute(damage)
        connection.commit()
    readers = (store.read_plan, store.read_study, store.waiting_cases, lambda p: store.read_traces(p, CHANNEL.name))
    sentences = []
    for read in readers:
        try:
            read(path)
        except InputRefused as refusal:
            sentences.append(str(refusal))
    assert sentences
    assert all("damaged" in sentence and str(path) in sentence for sentence in sentences)


def test_only_studies_are_deleted_and_damaged_ones_are(path):
    made(path)
    other = path.with_name("other.db")
    with closing(sqlite3.connect(other)) as connection:
        connection.execute("CREATE TABLE mine (x)")
    with pytest.raises(InputRefused, match="no study"):
        store.remove_study(other)
    assert other.exists()
    with store.study_held(path), pytest.raises(InputRefused, match="at work"):
        store.remove_study(path)
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputRefused, match="damaged"):
        store.read_plan(path)
    path.with_name("study.db-wal").write_bytes(b"of it")
    store.remove_study(path)
    assert list(path.parent.iterdir()) == [other]
