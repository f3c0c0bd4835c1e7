"""Tables of many scores."""

import numpy as np
import pytest

from rille.proof.scoring import Score
from rille.proof.summary import aims, as_json, brier, calibration_error, markdown, reliability, risk_coverage, wilson


def line(trial=0, sort="one", strength=2.0, verdict="named", **more):
    """A score as the ledger holds it."""
    return Score(trial=trial, sort=sort, machine="arm", strength=strength, truth="t", status="done", verdict=verdict, **more).as_json()


def stated(p, right, n):
    return [line(trial=k, probability=p, grouped=k < right * n, wrong=k >= right * n) for k in range(n)]


def test_what_is_said_and_true_alike_is_calibrated():
    lines = [*stated(0.9, 0.9, 50), *stated(0.5, 0.5, 50)]
    assert calibration_error(lines) == pytest.approx(0.0, abs=1e-12)
    assert brier(lines) == pytest.approx((0.9 * 0.1 + 0.5 * 0.5) / 2)
    assert [n for _, _, n in reliability(lines)] == [50, 50]


def test_too_sure_is_off_by_so_much():
    assert calibration_error(stated(0.95, 0.7, 40)) == pytest.approx(0.25)


def test_risk_grows_as_less_sure_names_are_given():
    curve = risk_coverage([*stated(0.9, 1.0, 10), *stated(0.5, 0.0, 10)])
    assert curve[9] == pytest.approx((0.5, 0.0))
    assert curve[-1] == pytest.approx((1.0, 0.5))


def test_the_interval_of_a_share():
    """Wilson's interval of 8 out of 10: 0.490 to 0.943 (Newcombe 1998, Statistics in Medicine 17, method 3)."""
    assert wilson(8, 10) == pytest.approx((0.490, 0.943), abs=1e-3)
    assert all(np.isnan(wilson(0, 0)))


def test_aims_count_the_trials_that_they_speak_of():
    """Ten single effects at twice the floor of which nine are right, two weak ones that do not count, a null with a name."""
    lines = [line(trial=k, top=k < 9, grouped=True, target=1.0, error=0.02, gap=0.95, probability=0.9) for k in range(10)]
    lines += [line(trial=20 + k, strength=0.5) for k in range(2)]
    lines += [line(trial=30, sort="nothing", strength=0.0, wrong=True, probability=0.6)]
    found = {one.what: one for one in aims(lines, {"sindy": [line(trial=k, top=k < 2) for k in range(10)]})}
    first = found["one effect, twice the floor or more: right name first"]
    assert (first.value, first.n, first.ok) == (pytest.approx(90.0), 10, True)
    null = found["nothing concealed: a name all the same"]
    assert (null.value, null.ok) == (100.0, False)
    assert found["right name first: ahead of SINDy by"].value == pytest.approx(70.0)
    none = found["two effects, twice the floor or more: both named"]
    assert none.n == 0
    assert not none.ok


def test_table_and_json_say_the_same():
    lines = [*stated(0.9, 0.9, 10), line(trial=40, sort="nothing", strength=0.0, verdict="nothing_missing", top=True, grouped=True)]
    text = markdown(lines, {}, {"arm": 0.01})
    numbers = as_json(lines, {}, {"arm": 0.01})
    assert "| one effect | 2 | 10 |" in text
    assert numbers["rows"][0]["n"] == 10
    assert numbers["trials"] == 11
    assert "| arm | 0.01 |" in text
