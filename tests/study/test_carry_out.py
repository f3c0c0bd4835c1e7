"""Carrying out: every case ends as one result, whatever happens to workers."""

import pytest

from rille.simulate.workers import LocalPool
from rille.study import carry_out, design_cases
from study.function_studies import Broken, Deadly, angles, plan


def results(work, count=60, workers=2):
    """Results by case, and how often each came."""
    cases = design_cases(plan("latin_hypercube", count, angles(1)), 2, 1000)
    kept, told = [], []
    pool = LocalPool(work, workers)
    try:
        carry_out(pool, cases, kept.extend, tell=told.append)
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
