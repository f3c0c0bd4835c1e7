"""The search on the toy: what was planted is named, with its numbers; what is not in the catalogue, or cannot be told, is not."""

from dataclasses import fields, replace

import numpy as np
import pytest

from rille.diagnosis.inference.fit import fit_together
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.moments import busy_spans, shared_moment
from rille.diagnosis.inference.search import search
from toy_evidence import ToyEvidence, catalogue, effect, named, number, recorded

PLANTED = {
    "coulomb": named("coulomb", "left", force=0.4),
    "quadratic": named("quadratic", "*", coefficient=0.2),
    "limit": named("limit", "right", inverse=0.35),
    "lag": named("lag", "right", time=0.05),
    "mass": named("mass", "left", mass=1.15),
    "bias": named("bias", "left position", offset=0.01),
    "scale": named("scale", "right speed", relative_error=0.04),
}
VERDICT = {"mass": "parameter", "bias": "sensor_fault", "scale": "sensor_fault"}
CHEAP = [h for h in catalogue() if h.kind not in ("ripple", "push")]


def titles(found):
    return sorted(t.term.hypothesis.title for t in found.terms)


@pytest.mark.parametrize("name", PLANTED)
def test_one_piece_is_named_with_its_number(name):
    truth = PLANTED[name]
    found = search(recorded((truth,), seconds=10), CHEAP)
    assert titles(found) == [truth.hypothesis.title]
    assert found.verdict == VERDICT.get(name, "named")
    assert np.isclose(found.terms[0].term.values[0], truth.values[0], rtol=0.05)
    assert found.leftover < 0.02
    assert found.ranked[0].title == truth.hypothesis.title
    assert found.ranked[0].probability > 0.9
    assert found.ranked[0].loses_because == ""
    assert all(other.loses_because for other in found.ranked[1:])
    assert sum(r.probability for r in found.ranked) + found.nothing <= 1 + 1e-9


@pytest.mark.parametrize(
    "truth",
    [
        (named("coulomb", "left", force=0.4), named("quadratic", "right", coefficient=0.3)),
        (named("coulomb", "left", force=0.4), named("viscous", "left", coefficient=0.3)),
        (named("coulomb", "left", force=0.4), named("mass", "right", mass=1.1), named("scale", "right speed", relative_error=0.04)),
    ],
    ids=["two targets", "one target", "effect, parameter and sensor"],
)
def test_several_pieces_are_named_together(truth):
    found = search(recorded(truth, seconds=12), CHEAP)
    assert titles(found) == sorted(t.hypothesis.title for t in truth)
    values = {t.term.hypothesis.title: t.term.values[0] for t in found.terms}
    assert all(np.isclose(values[t.hypothesis.title], t.values[0], rtol=0.05) for t in truth)


def test_what_is_small_beside_the_first_piece_is_named_too():
    """Viscous friction that makes 0.3 % of all that is beyond the noise, and is half as large as the noise itself: plain to see, once the
    dry friction beside it is known. Its number has an error of 1 % by the noise.
    """
    truth = (named("coulomb", "left", force=2.0), named("viscous", "right", coefficient=0.15))
    found = search(recorded(truth, seconds=12), CHEAP)
    assert titles(found) == sorted(t.hypothesis.title for t in truth)
    values = {t.term.hypothesis.title: t.term.values[0] for t in found.terms}
    assert all(np.isclose(values[t.hypothesis.title], t.values[0], rtol=0.05) for t in truth)


def test_a_push_is_named_though_no_window_of_it_can_be_held_out():
    push = named("push", "left", force=4.0, start=12.3, duration=0.2)
    found = search(recorded((push,), seconds=20), [h for h in catalogue() if h.kind in ("push", "coulomb", "mass", "bias")])
    assert titles(found) == ["push of left"]
    assert np.isclose(found.terms[0].term.numbers["start"], 12.3, atol=0.05)


def test_a_short_push_late_in_a_long_window_is_found():
    """Windows of 4 s: from the start of a window no fit gets to a push of 0.1 s in its last quarter; the whole of it is looked through."""
    push = named("push", "left", force=8.0, start=15.3, duration=0.1)
    found = search(recorded((push,), seconds=40, window=4.0), [h for h in catalogue() if h.kind in ("push", "coulomb", "mass", "bias")])
    assert titles(found) == ["push of left"]
    numbers = found.terms[0].term.numbers
    assert np.isclose(numbers["start"] + 0.5 * numbers["duration"], 15.35, atol=0.02)
    assert np.isclose(numbers["force"] * numbers["duration"], 0.8, rtol=0.1)  # the impulse is known, not what it is made of


def test_what_lasts_is_not_looked_for_at_moments():
    evidence = recorded((named("coulomb", "left", force=0.4),), seconds=20)
    assert busy_spans(Judge(evidence)) == ()
    (first, last), *_ = busy_spans(Judge(recorded((named("push", "left", force=4.0, start=12.3, duration=0.2),), seconds=20)))
    assert first <= 12.3 < last


def test_who_found_the_moment_tells_the_others():
    """Pushes on both carts, one of them looked for from a wrong time alone: it gets the moment of the other, and is the better one."""
    push = named("push", "left", force=4.0, start=12.3, duration=0.2)
    left, right = (h for h in catalogue() if h.kind == "push" and h.target in ("left", "right"))
    evidence = recorded((push,), seconds=20)
    judge = Judge(evidence)
    fitted = fit_together(judge, [[(right.at({"force": 0.3, "start": 12.3, "duration": 0.2}),)]])
    moment = shared_moment(fitted, [left, right], base=judge.chi2, worth=-10.0)
    assert list(moment) == [left.title]
    assert np.isclose(moment[left.title][0]["start"], fitted[0].setting[0].numbers["start"])
    assert shared_moment(fitted, [left, right], base=fitted[0].chi2 - 1.0, worth=0.3) == {}


def test_what_is_far_fetched_is_believed_last():
    """Two words for one thing, one of them farther from absence than is believed: it is of the group, but never its head; where it is alone
    it is named all the same.
    """
    viscous = effect("viscous", "left", number("coefficient"))
    far = replace(viscous, cause="parameter", kind="viscous_number", free=(replace(viscous.free[0], believed=0.05),))
    truth = (named("viscous", "left", coefficient=0.2),)
    found = search(recorded(truth, seconds=10), [far, viscous])
    assert [r.title for r in found.ranked] == [viscous.title, far.title]
    assert found.terms[0].term.hypothesis.kind == "viscous"
    alone = search(recorded(truth, seconds=10), [far])
    assert (alone.verdict, alone.terms[0].term.hypothesis.kind) == ("parameter", "viscous_number")


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_named_where_nothing_is_missing(seed):
    found = search(recorded(seconds=20, seed=seed), CHEAP)
    assert (found.verdict, found.terms, found.setting) == ("nothing_missing", (), ())


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_named_where_only_the_noise_is_larger_than_stated(seed):
    found = search(recorded(seconds=20, seed=seed, noise=1.3), CHEAP)
    assert (found.verdict, found.terms) == ("unknown", ())


@pytest.mark.parametrize(
    "extra",
    [
        lambda t, x, v: np.stack([1.5 * x[0] ** 2 * np.sign(v[1]), 0 * x[1]]),
        lambda t, x, v: np.stack([0 * x[0], 0 * x[0] + 0.5 * np.sin(11.0 * t)]),
        lambda t, x, v: np.stack([0.8 * x[0] * v[1] ** 2, 0 * x[0]]),
    ],
    ids=["a product", "a rhythm", "a cross term"],
)
def test_what_the_catalogue_does_not_have_gets_no_name(extra):
    found = search(recorded(seconds=10, extra=extra), CHEAP)
    assert found.verdict in ("unknown", "cannot_know")
    assert found.nothing > 0.3


def test_too_short_a_recording_says_so():
    found = search(recorded((PLANTED["coulomb"],), seconds=1.5), CHEAP)
    assert found.verdict == "cannot_know"
    assert "too few" in found.notes[0]


def test_without_hypotheses_something_is_missing_all_the_same():
    assert search(recorded((PLANTED["coulomb"],), seconds=5), ()).verdict == "unknown"
    assert search(recorded(seconds=5), ()).verdict == "nothing_missing"


def test_what_does_the_same_is_one_group_and_a_parameter_stands_first():
    """A dashpot under another name, and viscous friction as a number of the model: three words for one thing. With the number among them no
    physics need be missing; without it, one of two laws is.
    """
    viscous = effect("viscous", "left", number("coefficient"))
    others = [replace(viscous, kind="dashpot"), replace(viscous, cause="parameter", kind="viscous_number")]
    found = search(recorded((named("viscous", "left", coefficient=0.2),), seconds=10), [viscous, *others])
    assert search(recorded((named("viscous", "left", coefficient=0.2),), seconds=10), [viscous, others[0]]).verdict == "group"
    assert found.verdict == "parameter"
    assert found.ranked[0].cause == "parameter"
    assert set(found.groups[0].members) == {"viscous of left", "dashpot of left", "viscous_number of left"}
    assert found.groups[0].correlation > 0.999
    assert "cannot tell" in found.groups[0].sentence
    assert found.groups[0].probability > 0.9


def test_a_law_with_numbers_that_explain_nothing_is_no_rival():
    """Stribeck's law holds Coulomb's; where there is no stiction it is named as needless, not as a group."""
    found = search(recorded((PLANTED["coulomb"],), seconds=20), [h for h in catalogue() if h.kind in ("coulomb", "stribeck")])
    assert found.verdict == "named"
    rival = next(r for r in found.ranked if r.title == "stribeck of left")
    assert "explains no more" in rival.loses_because


def test_numbers_that_are_always_open_are_fitted_along():
    """A spring that the model has wrong as well is no question: it is refitted, and the friction is named on top of it."""
    spring = named("spring", "right", spring=9.0)
    found = search(recorded((spring, PLANTED["coulomb"]), seconds=10), CHEAP, always=(spring.hypothesis.at(),))
    assert titles(found) == ["coulomb of left"]
    assert len(found.setting) == 2
    assert np.isclose(found.setting[0].values[0], 9.0, rtol=0.02)


def test_recordings_are_held_out_whole():
    found = search(recorded((PLANTED["coulomb"],), seconds=4, runs=5), CHEAP)
    assert titles(found) == ["coulomb of left"]


def test_what_overstated_noise_hides_is_looked_for_once_more():
    """Noise taken for 1.25 times what it is leaves room for a second piece in chi-squared as a whole. The doubt of the first one sees it,
    and it is named: 0.03, with an error of 5 % by the noise.
    """
    truth = (named("coulomb", "left", force=0.4), named("viscous", "right", coefficient=0.03))
    found = search(recorded(truth, seconds=20), CHEAP, floor=1.6)
    assert titles(found) == sorted(t.hypothesis.title for t in truth)
    values = {t.term.hypothesis.title: t.term.values[0] for t in found.terms}
    assert all(np.isclose(values[t.hypothesis.title], t.values[0], rtol=0.15) for t in truth)


class Unstable(ToyEvidence):
    """One window of it goes astray, each time elsewhere, unless the friction is nearly right."""

    def residuals(self, settings):
        found = super().residuals(settings)
        astray = np.isin(self.window, np.flatnonzero(np.isclose(self.begin, 3.5)))
        for row, setting in zip(found, settings, strict=True):
            if not any(t.hypothesis.title == "coulomb of left" and abs(t.values[0] - 0.15) < 0.03 for t in setting):
                row[astray] += 40 * (2 + np.sin(1e4 * sum(sum(t.values) for t in setting)))
        return found


def test_a_window_that_went_astray_does_not_drown_the_others():
    """It has thirty times the misfit of all others together, and nothing near the base brings it back: the friction that the others show
    does. (No name could be given.)
    """
    seen = recorded((named("coulomb", "left", force=0.15),), seconds=10)
    evidence = Unstable(**{f.name: getattr(seen, f.name) for f in fields(seen)})
    excess = Judge(evidence).window_excess
    assert excess[7] > 30 * (np.sum(excess) - excess[7])
    found = search(evidence, catalogue())
    assert found.verdict == "named"
    assert [t.hypothesis.title for t in found.setting] == ["coulomb of left"]
