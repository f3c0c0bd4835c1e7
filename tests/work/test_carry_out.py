"""Carrying out: every item ends as one result, whatever happens to workers."""

import time
from dataclasses import dataclass

import pytest

from rille.model.study import lost_case
from rille.study import design_cases
from rille.work import LocalPool, carry_out
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
