"""Screening and fitting on the toy: units far off, thresholds, orders, silent and equal hypotheses, intervals that hold."""

from dataclasses import replace

import numpy as np
import pytest

from rille.diagnosis.hypotheses.shape_tries import shape_tries
from rille.diagnosis.inference.fit import estimates, fit
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.screen import screen
from rille.model.hypothesis import Setting
from toy_evidence import catalogue, effect, named, number, recorded


def first_of(screened):
    return screened.signatures[0]


@pytest.mark.parametrize("spread", [1e-4, 0.1, 30.0])
def test_a_spread_that_is_far_off_does_not_hide_a_hypothesis(spread):
    evidence = recorded((named("viscous", "left", coefficient=0.2),), seconds=10)
    right = effect("viscous", "left", number("coefficient", spread=spread))
    found = first_of(screen(evidence, [right, *(h for h in catalogue(("right",)) if h.kind in ("viscous", "coulomb", "mass"))]))
    assert found.hypothesis is right
    assert np.isclose(found.values["coefficient"], 0.2, rtol=0.1)


@pytest.mark.parametrize("spread", [0.01, 0.3, 20.0])
def test_what_acts_beyond_a_threshold_is_found_from_any_first_try(spread):
    evidence = recorded((named("limit", "right", inverse=0.3),), seconds=10)
    right = effect("limit", "right", number("inverse", upper=50.0, spread=spread))
    found = first_of(screen(evidence, [right]))
    assert not found.silent
    assert found.drop > 0.6 * Judge(evidence).excess
    fitted = fit(evidence, (right.at(found.values),))
    assert np.isclose(fitted.setting[0].values[0], 0.3, rtol=0.02)


def test_what_changes_nothing_is_silent_and_last():
    evidence = recorded((named("coulomb", "left", force=0.4),), seconds=5)
    screened = screen(evidence, [h for h in catalogue() if h.kind in ("nothing", "coulomb")])
    assert [s.silent for s in screened.signatures] == [False] * 3 + [True] * 3
    assert all(s.drop == 0 and not s.direction.any() for s in screened.signatures[3:])


def test_all_targets_and_the_only_target_are_one_hypothesis():
    """'*' moves both carts; with the other one's hypothesis renamed to do the same, only the one with a name is kept."""
    evidence = recorded((named("coulomb", "*", force=0.4),), seconds=5)
    every = effect("coulomb", "*", number("force", spread=0.3))
    only = replace(every, target="both")
    kept = screen(evidence, [every, only]).signatures
    assert [s.hypothesis.target for s in kept] == ["both"]


def test_orders_and_phase_come_out_of_few_trials():
    evidence = recorded((named("ripple", "left", force=0.5, cycles=17, phase=1.0),), seconds=25)
    ripple = next(h for h in catalogue() if h.kind == "ripple" and h.target == "left")
    found = first_of(screen(evidence, [ripple]))
    assert found.values["cycles"] == 17
    assert np.isclose(found.values["phase"], 1.0, atol=0.1)
    assert np.isclose(found.values["force"], 0.5, rtol=0.15)


def test_given_places_are_tried_instead_of_own_guesses():
    push = next(h for h in catalogue() if h.kind == "push" and h.target == "left")
    tries = shape_tries(push, (1.0, 2.0), ({"start": 7.0},))
    assert tries == [{"start": 7.0, "duration": 0.3}]
    assert [t["start"] for t in shape_tries(push, (1.0, 2.0))] == [1.0, 2.0]


def test_intervals_hold_the_truth_as_often_as_they_say():
    """20 seeds x 2 numbers at 95 %: fewer than 34 of 40 has a probability below 0.5 %."""
    truth = (named("coulomb", "left", force=0.4), named("mass", "right", mass=1.1))
    start: Setting = tuple(term.hypothesis.at({n.name: n.absent + 0.5 * n.spread for n in term.hypothesis.free}) for term in truth)
    inside = 0
    for seed in range(20):
        evidence = recorded(truth, seconds=5, seed=seed)
        fitted = fit(evidence, start)
        numbers = [e for term in estimates(fitted, Judge(evidence).metric.edges) for e in term]
        inside += sum(e.low <= t.values[0] <= e.high for e, t in zip(numbers, truth, strict=True))
    assert inside >= 34


def test_a_fit_from_absent_numbers_arrives():
    evidence = recorded((named("viscous", "left", coefficient=0.2),), seconds=5)
    viscous = named("viscous", "left").hypothesis
    assert np.isclose(fit(evidence, (viscous.at(),)).setting[0].values[0], 0.2, rtol=0.05)


def test_bounds_are_kept_and_told():
    """Friction that drives: its amplitude stays at zero, and says that it is at its bound."""
    evidence = recorded(seconds=5, extra=lambda t, x, v: 0.3 * v)
    fitted = fit(evidence, (named("viscous", "left", coefficient=0.1),))
    (only,) = estimates(fitted, Judge(evidence).metric.edges)[0]
    assert (only.value, only.at_bound) == (0.0, "lower")


def test_an_end_never_pays():
    """A setting that a run does not survive costs more than the base, however bad that is."""
    evidence = recorded(seconds=5, extra=lambda t, x, v: 30.0 + 0 * x)
    judge = Judge(evidence)
    wild = effect("viscous", "left", number("coefficient", lower=-1e6, upper=1e6)).at({"coefficient": -1e5})
    (lost,) = judge.whitened([(wild,)])
    assert judge.chi2 > 1e4
    assert lost @ lost > judge.chi2
