"""Indices of Ishigami's function through design, workers, database and analysis, against the closed form.

V1 = (1 + b pi^4 / 5)^2 / 2, V2 = a^2 / 8, V13 = b^2 pi^8 (1/18 - 1/50), all else 0 (Ishigami & Homma 1990).
"""

import math

import numpy as np
import pytest

from rille import store
from rille.model.study import CaseResult, StudyTable, lost_case
from rille.study import design_cases, indices, why_none
from rille.work import LocalPool, carry_out
from study.function_studies import A, B, Ishigami, angles, plan

V1, V2, V13 = (1 + B * math.pi**4 / 5) ** 2 / 2, A**2 / 8, B**2 * math.pi**8 * (1 / 18 - 1 / 50)
V = V1 + V2 + V13
FIRST, TOTAL = np.array([V1, V2, 0]) / V, np.array([V1 + V13, V2, V13]) / V


def carried_out(path, asked, workers) -> StudyTable:
    """The study through its file and processes."""
    store.create_study(path, asked, design_cases(asked, 9, 100_000))
    pool = LocalPool(Ishigami(), workers)
    try:
        waiting = store.waiting_cases(path)
        carry_out(pool, waiting, len(waiting), lambda results: store.add_results(path, asked, results), lost=lost_case)
    finally:
        pool.close()
    return store.read_study(path)


def here(asked) -> StudyTable:
    """The same without processes and file."""
    cases = design_cases(asked, 9, 100_000)
    found: list[CaseResult] = Ishigami()(cases)
    return StudyTable(
        plan=asked,
        values=np.array([case.values for case in cases]),
        outcomes=np.array([[result.outcomes["y"]] for result in found]),
        status=("done",) * len(cases),
        reason=("",) * len(cases),
    )


def test_sobol_indices_through_everything(tmp_path):
    """1024 base samples. The estimators scatter by about sqrt(var / N) = 0.03; twice that is asked of each."""
    asked = plan("sobol", 1024, angles(), second_order=True)
    table = carried_out(tmp_path / "s.db", asked, 2)
    assert len(table.status) == 1024 * 8
    assert set(table.status) == {"done"}
    found = indices(table, "y")
    assert found.total is not None
    assert found.second is not None
    np.testing.assert_allclose(found.first, FIRST, atol=0.06)
    np.testing.assert_allclose(found.total, TOTAL, atol=0.06)
    assert found.second[0, 2] == pytest.approx(V13 / V, abs=0.1)
    assert found.first_confidence is not None
    assert (np.abs(found.first - FIRST) < 2 * found.first_confidence).all()
    np.testing.assert_array_equal(table.outcomes, here(asked).outcomes)  # the same numbers as in this process, bit by bit


def test_rbd_fast_of_a_latin_hypercube():
    """First-order indices only; 2000 cases, the scatter of RBD-FAST is about 0.03."""
    found = indices(here(plan("latin_hypercube", 2000, angles())), "y")
    assert "RBD-FAST" in found.method
    assert found.total is None
    np.testing.assert_allclose(found.first, FIRST, atol=0.08)


def test_shares_of_a_full_grid_are_exact():
    """Of y = 2 x1 + x2 on a grid, variances add: S = 4 : 1 whatever the number of levels."""
    asked = plan("grid", 0, angles(2))
    cases = design_cases(asked, 5, 100)
    values = np.array([case.values for case in cases])
    table = StudyTable(plan=asked, values=values, outcomes=values @ [[2.0], [1.0]], status=("done",) * 25, reason=("",) * 25)
    found = indices(table, "y")
    np.testing.assert_allclose(found.first, [0.8, 0.2], rtol=1e-12)
    np.testing.assert_allclose(found.total, [0.8, 0.2], rtol=1e-12)


def test_failed_cases_cost_their_group_only():
    """Every 50th case fails: groups of k + 2 are left out as wholes, and the rest still tells."""
    table = here(plan("sobol", 2048, angles()))
    status = tuple("diverged" if n % 50 == 0 else "done" for n in range(len(table.status)))
    found = indices(StudyTable(plan=table.plan, values=table.values, outcomes=table.outcomes, status=status, reason=table.reason), "y")
    assert "without 10 % of the cases" in found.method  # one group of five in ten cases
    assert found.dropped == 5 * sum(1 for n in range(len(status)) if n % 50 == 0)
    np.testing.assert_allclose(found.total, TOTAL, atol=0.08)


def test_what_nothing_moves_has_no_indices():
    table = here(plan("sobol", 16, angles()))
    flat = StudyTable(plan=table.plan, values=table.values, outcomes=0 * table.outcomes + 3, status=table.status, reason=table.reason)
    assert indices(flat, "y") is None
    assert why_none(flat, "y") == "constant"


def test_what_is_constant_in_whole_groups_has_no_indices():
    """Only cases whose groups are left out differ."""
    table = here(plan("sobol", 16, angles()))
    outcomes = 0 * table.outcomes + 3
    outcomes[1] = 4
    status = ("diverged", *table.status[1:])
    flat = StudyTable(plan=table.plan, values=table.values, outcomes=outcomes, status=status, reason=table.reason)
    assert indices(flat, "y") is None
    assert why_none(flat, "y") == "constant"


def test_what_is_constant_in_few_cases_is_constant():
    """More of them would change nothing."""
    table = here(plan("latin_hypercube", 8, angles()))
    flat = StudyTable(plan=table.plan, values=table.values, outcomes=0 * table.outcomes + 3, status=table.status, reason=table.reason)
    assert why_none(flat, "y") == "constant"


@pytest.mark.parametrize(("design", "samples", "words"), [("latin_hypercube", 64, "65 cases needed"), ("sobol", 4, "8 whole groups")])
def test_too_few_cases_say_how_many_are_needed(design, samples, words):
    table = here(plan(design, samples, angles()))
    assert indices(table, "y") is None
    assert words in why_none(table, "y")
