"""Answers are scored by truth and answer alone."""

import json

import pytest

from rille.diagnosis.answer.diagnosis_json import diagnosis_json
from rille.model.diagnosis import Diagnosis, Estimate, Group, Location, NamedTerm, Proof, RankedHypothesis, TargetScore
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.proof.scoring import score, title


def term(kind, target, numbers, cause="effect", target_kind="joint", low=0.9, high=1.1):
    """A named term with amplitudes and intervals of +-10 %."""
    free = tuple(FreeNumber(name=n, unit="1", amplitude=True, lower=-9, upper=9, start=0.1, spread=0.1, absent=0.0) for n in numbers)
    hypothesis = Hypothesis(cause=cause, kind=kind, target=target, target_kind=target_kind, free=free)
    estimates = tuple(
        Estimate(name=n, unit="1", value=v, low=min(low * v, high * v), high=max(low * v, high * v)) for n, v in numbers.items()
    )
    return NamedTerm(term=hypothesis.at(numbers), estimates=estimates)


def entry(*terms, group=0, probability=0.9):
    words = " + ".join(t.term.hypothesis.title for t in terms)
    return RankedHypothesis(
        terms=terms, title=words, cause="effect", probability=probability, gain=9, gain_error=1, explained=1, group=group
    )


def answer(verdict, *ranked, groups=(), gap=0.95):
    """The JSON of a diagnosis, as `rille diagnose --json` prints it."""
    made = Diagnosis(
        model="m",
        scenario="s",
        recordings=("a",),
        held_out=("h",),
        verdict=verdict,
        sentence="",
        location=Location(shape="everywhere", targets=(TargetScore(kind="joint", name="elbow", share=0.9, size=2, differs=True),)),
        ranked=ranked,
        groups=groups,
        proof=Proof(gap_closed=gap, low=0.9, high=1, before=3, after=1, floor=1, held_out="h"),
    )
    return json.loads(json.dumps(diagnosis_json(made)))


def truth(sort, *pieces, strength=2.0):
    return {"number": 3, "sort": sort, "machine": "arm", "strength": strength, "pieces": list(pieces)}


def piece(kind, target, cause="effect", reference=None, near=("elbow", "fore"), **numbers):
    amplitudes = sorted(n for n in numbers if n not in ("start", "duration"))
    return {
        "cause": cause,
        "kind": kind,
        "target": target,
        "numbers": numbers,
        "amplitudes": amplitudes,
        "near": list(near),
        "reference": reference,
    }


FRICTION = piece("coulomb_friction", "elbow", torque=1.0)


def test_the_truth_alone_is_right():
    got = score(truth("one", FRICTION), answer("named", entry(term("coulomb_friction", "elbow", {"torque": 1.05}))), seconds=7.0)
    assert (got.top, got.grouped, got.wrong, got.abstained, got.sort_right) == (True, True, False, False, True)
    assert got.error == pytest.approx(0.05)
    assert (got.covered, got.target, got.located, got.gap, got.probability) == (1.0, 1.0, 1.0, 0.95, 0.9)
    assert got.truth == title(truth("one", FRICTION)) == "coulomb_friction of elbow"


def test_another_joint_is_a_wrong_name():
    got = score(truth("one", FRICTION), answer("named", entry(term("coulomb_friction", "waist", {"torque": 1.0}))))
    assert (got.top, got.grouped, got.wrong, got.confident_wrong, got.target) == (False, False, True, True, 0.0)


def test_the_truth_in_the_group_of_the_best_is_in_the_group():
    first = entry(term("stribeck_friction", "elbow", {"torque": 1.0}), group=1, probability=0.5)
    second = entry(term("coulomb_friction", "elbow", {"torque": 1.0}), group=1, probability=0.4)
    groups = (Group(number=1, members=(first.title, second.title), probability=0.9, correlation=0.99),)
    got = score(truth("one", FRICTION), answer("group", first, second, groups=groups))
    assert (got.top, got.grouped, got.wrong, got.probability, got.pieces) == (False, True, False, 0.9, 1.0)


def test_a_lower_rank_outside_of_the_group_does_not_count():
    first = entry(term("backlash", "elbow", {"gap": 1.0}))
    got = score(truth("one", FRICTION), answer("named", first, entry(term("coulomb_friction", "elbow", {"torque": 1.0}), group=2)))
    assert (got.top, got.grouped, got.wrong) == (False, False, True)


def test_the_truth_with_something_more_is_not_right():
    both = entry(term("coulomb_friction", "elbow", {"torque": 1.0}), term("backlash", "waist", {"gap": 1.0}))
    got = score(truth("one", FRICTION), answer("named", both))
    assert (got.top, got.grouped, got.pieces) == (False, False, 1.0)


def test_two_pieces_must_both_be_named():
    other = piece("mass_change", "fore", mass=0.1)
    both = entry(term("mass_change", "fore", {"mass": 0.1}, target_kind="body"), term("coulomb_friction", "elbow", {"torque": 1.0}))
    assert score(truth("two", FRICTION, other), answer("named", both)).top
    half = score(truth("two", FRICTION, other), answer("named", entry(term("coulomb_friction", "elbow", {"torque": 1.0}))))
    assert (half.top, half.pieces, half.wrong) == (False, 0.5, True)


def test_silence_where_nothing_is_concealed_is_right_and_a_name_is_wrong():
    assert score(truth("nothing", strength=0.0), answer("nothing_missing")).top
    got = score(truth("nothing", strength=0.0), answer("named", entry(term("coulomb_friction", "elbow", {"torque": 1.0}))))
    assert (got.top, got.wrong) == (False, True)
    careful = score(truth("nothing", strength=0.0), answer("cannot_know"))
    assert (careful.top, careful.wrong, careful.abstained) == (False, False, True)


def test_outside_of_the_catalogue_no_name_is_right():
    strange = piece("cable_spring", "elbow", cause="outside", stiffness=1.0)
    assert score(truth("outside", strange), answer("unknown")).top
    got = score(truth("outside", strange), answer("named", entry(term("coulomb_friction", "elbow", {"torque": 1.0}), probability=0.5)))
    assert (got.wrong, got.confident_wrong) == (True, False)


def test_a_wrong_mass_may_be_called_a_change_of_mass():
    """0.05 kg of 0.5 kg is a share of 0.1, the truth 0.12: (0.12 - 0.1) / 1.12."""
    heavy = piece("mass", "fore", cause="parameter", reference=0.5, mass=0.12)
    got = score(truth("parameter", heavy), answer("named", entry(term("mass_change", "fore", {"mass": 0.05}, target_kind="body"))))
    assert (got.top, got.sort_right) == (True, True)
    assert got.error == pytest.approx(0.02 / 1.12)
    assert got.covered == 0.0  # 0.045 to 0.055 kg are shares of 0.09 to 0.11


def test_no_answer_is_a_failure():
    got = score(truth("one", FRICTION), None, "too long", 1800.0)
    assert (got.top, got.status, got.as_json()["gap"]) == (False, "too long", None)
