"""Carrying out: every item ends as one result, whatever happens to workers."""

import os
import platform
import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from rille.model import MachineFailed
from rille.model.process import SAME_ROUNDING
from rille.model.study import lost_case
from rille.study import design_cases
from rille.work import LocalPool, carry_out, opened_pool
from study.function_studies import Broken, Deadly, angles, plan


def results(work, count=60, workers=2):
    """Results by case, and how often each came."""
    cases = design_cases(plan("latin_hypercube", count, angles(1)), 2, 1000)
    kept, told = [], []
    pool = LocalPool(work, workers)
    try:
        assert carry_out(pool, cases, len(cases), kept.extend, lost=lost_case, tell=told.append)
    finally:
        pool.close()
    assert sorted(result.number for result in kept) == list(range(count))
    assert told[-1] == count
    return {result.number: result for result in kept}, cases


def test_a_worker_that_dies_loses_no_case(tmp_path):
    found, cases = results(Deadly(tmp_path, once=frozenset({7})))
    assert all(found[case.number].outcomes["y"] == case.values[0] for case in cases)


def test_a_case_that_kills_its_worker_is_a_row_and_only_that(tmp_path):
    found, _ = results(Deadly(tmp_path, always=frozenset({11})))
    assert {number for number, result in found.items() if result.status != "done"} == {11}
    assert found[11].status == "worker_died"
    assert "died twice" in found[11].reason


def test_a_worker_that_cannot_work_ends_the_study():
    with pytest.raises(ImportError, match="no such module"):
        results(Broken(), count=4)


def threads_of_algebra(items):
    """For each item the variable that keeps linear algebra to one processor."""
    return [os.environ.get("OPENBLAS_NUM_THREADS") for _ in items]


def test_workers_leave_each_other_their_processors(monkeypatch):
    """As many processes as processors, each with one thread for linear algebra; who sets another number gets it."""
    for given, wanted in ((None, "1"), ("3", "3")):
        monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
        if given:
            monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
        kept = []
        with opened_pool(threads_of_algebra, 1, None) as pool:
            assert carry_out(pool, range(2), 2, kept.extend, lost=lost_case)
        assert kept == [wanted, wanted]
        assert os.environ.get("OPENBLAS_NUM_THREADS") == given


def features_of_numpy(items):
    """For each item which instructions of AVX-512 NumPy takes, and the kernels that OpenBLAS is to take."""
    import numpy as np

    used = [name for name, there in np._core._multiarray_umath.__cpu_features__.items() if there and name in ("X86_V4", "AVX512_ICL")]
    return [(used, os.environ.get("OPENBLAS_CORETYPE")) for _ in items]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="these variables are about x86-64")
def test_workers_round_as_on_any_other_machine():
    """The variables reach NumPy in the processes, not this one."""
    kept = []
    with opened_pool(features_of_numpy, 1, None, SAME_ROUNDING) as pool:
        assert carry_out(pool, range(2), 2, kept.extend, lost=lost_case)
    assert kept == [([], "Haswell")] * 2
    assert "NPY_DISABLE_CPU_FEATURES" not in os.environ


@dataclass(frozen=True)
class Filled:
    """Says that the disk is full at one item, after a while in which the other worker gets on."""

    at: int

    def __call__(self, items):
        time.sleep(0.05)
        if self.at in items:
            raise MachineFailed("no room")
        return list(items)


def test_a_machine_that_fails_ends_the_work_and_what_was_done_is_kept():
    kept = []
    pool = LocalPool(Filled(20), 2)
    try:
        with pytest.raises(MachineFailed, match="no room"):
            carry_out(pool, range(60), 60, kept.extend, lost=lost_case)
    finally:
        pool.close()
    assert len(kept) == len(set(kept))
    assert 5 < len(kept) < 60
    assert 20 not in kept


@dataclass(frozen=True)
class Littering:
    """Opens temporary files and folders that it never closes; says where. Its process dies at one item, if ``dies``."""

    place: Path
    dies: int = -1

    def __call__(self, items):
        _litter.append(tempfile.TemporaryDirectory(prefix="litter-"))
        Path(_litter[-1].name, "file").write_text("left")
        mark = self.place / "died"
        if self.dies in items and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return [_litter[-1].name for _ in items]


_litter = []  # of a worker


@pytest.mark.parametrize("dies", [-1, 7])
def test_workers_leave_nothing_among_temporary_files(tmp_path, monkeypatch, dies):
    """Also those that took the place of others."""
    place, temporary = tmp_path / "place", tmp_path / "temporary"
    place.mkdir()
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    pool, kept = LocalPool(Littering(place, dies), 2), []
    try:
        assert carry_out(pool, range(20), 20, kept.extend, lost=lambda item, why: why)
        assert len(kept) == 20
        assert all(Path(folder).is_relative_to(temporary) and Path(folder, "file").exists() for folder in kept)
    finally:
        pool.close()
    assert list(temporary.iterdir()) == []
    assert (place / "died").exists() == (dies >= 0)


@dataclass(frozen=True)
class Slow:
    """Takes half a second for each item."""

    def __call__(self, items):
        time.sleep(0.5 * len(items))
        return list(items)


def test_nothing_is_begun_when_the_time_is_up():
    """Time for about two of twenty items: what was begun is kept, the rest is not taken from where items come from."""
    taken, kept = iter(range(20)), []
    pool = LocalPool(Slow(), 1)
    try:
        pool.submit([0]).result()  # the worker is there
        assert not carry_out(pool, taken, 20, kept.extend, lost=lost_case, ahead=1, until=time.monotonic() + 0.8)
    finally:
        pool.close()
    assert kept == list(range(len(kept)))
    assert 1 <= len(kept) <= 2
    assert next(taken) == len(kept)
