"""Laws without a name compete with an answer where that acts: they stand instead where they do better, or as well with fewer numbers, and
leave alone what is what its name says.
"""

from dataclasses import replace

import pytest

from diagnosis.test_unknown import evidence, hidden
from rille import store
from rille.diagnosis.hypotheses.candidates import candidates, of_kind
from rille.diagnosis.inference.fit import estimates, fit_together
from rille.diagnosis.inference.found import named_terms
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.nameless import EVEN, WORTH_A_WORD, _probability, _Rival, beside_nameless, places_of
from rille.diagnosis.inference.search import search
from rille.model import Effect
from rille.model.hypothesis import Hypothesis
from rille.model.machine import MachineDrive
from rille.model.recording import Channel

KINDS = store.effect_kinds()
ONLY = ("coulomb_friction", "torque_ripple")


def answered(make_model, *effects, only=ONLY):
    """Evidence, the machine, its scales, and what a search among a few kinds finds."""
    seen, machine, scales = evidence(make_model, *effects)
    found = search(seen, of_kind(candidates(machine, (), KINDS), only=only), kinds={kind.name: kind for kind in KINDS})
    return seen, machine, scales, found


def as_if(seen, found, machine, kind, target, **numbers):
    """The answer as if it named one effect, fitted from these numbers on."""
    (hypothesis,) = [h for h in of_kind(candidates(machine, (), KINDS), only=(kind,)) if h.target == target]
    judge = Judge(seen.relinearised((hypothesis.at(numbers),)))
    (fitted,) = fit_together(judge, [[(hypothesis.at(numbers),)]])
    terms = named_terms(estimates(fitted, judge.metric.edges), fitted.setting, {})
    after = {"chi2_after": fitted.chi2, "degrees_after": fitted.degrees, "kappa": fitted.kappa}
    return replace(found, verdict="named", setting=fitted.setting, terms=terms, nothing=0.05, evidence=judge.evidence, **after)


def stands(seen, machine, scales, found):
    """Whether the answer stays, and nothing is said against it."""
    answer, law = beside_nameless(seen, found, machine, scales, (), floor=1.0)
    same = (answer.verdict, answer.setting, answer.notes) == (found.verdict, found.setting, found.notes)
    return same and law is None and answer.nothing < max(WORTH_A_WORD, found.nothing + 1e-12)


def test_friction_one_way_is_no_friction_with_a_ripple(make_model):
    """0.02 N m against motion in one sense alone: half of it either way and half of it always, as a ripple of one cycle is nearly."""
    seen, machine, scales, found = answered(make_model, hidden("-c*max(tanh(velocity/w),0)", c=(0.02, "N m"), w=(0.02, "rad/s")))
    assert len(found.setting) == 2
    answer, law = beside_nameless(seen, found, machine, scales, (), floor=1.0)
    assert law is not None
    assert "(sign(v) where v > 0)" in law.formula
    assert answer.verdict == "unknown"
    assert answer.nothing >= 0.5
    assert answer.setting == ()
    assert "a law without a name at joint 'hinge2'" in answer.notes[-1]


def test_friction_with_the_cube_of_the_speed_is_none_in_proportion_to_it(make_model):
    """What one number follows roughly, another law with one number follows to the noise."""
    seen, machine, scales, found = answered(make_model, hidden("-c*velocity^3", c=(2e-4, "N m s^3/rad^3")), only=("coulomb_friction",))
    found = as_if(seen, found, machine, "coulomb_friction", "hinge2", torque=0.005)
    answer, law = beside_nameless(seen, found, machine, scales, (), floor=1.0)
    assert law is not None
    assert "(v^3)" in law.formula
    assert answer.verdict == "unknown"
    assert "does better" in answer.notes[-1]


def test_a_cable_along_a_joint_is_no_push_of_the_body_that_it_carries(make_model):
    """A spring of 0.05 N m/rad, which pulls at any time; the longest push that there is follows it for a while."""
    seen, machine, scales, found = answered(make_model, hidden("-c*(position-p)", "hinge1", c=(0.05, "N m/rad"), p=(0.4, "rad")))
    push = {"force_x": 0.1, "force_y": 0.0, "force_z": 0.0, "torque_x": 0.0, "torque_y": 0.0, "torque_z": 0.0, "start": 1.0}
    found = as_if(seen, found, machine, "external_pulse", "link1", **push, duration=1.5)
    answer, law = beside_nameless(seen, found, machine, scales, (), floor=1.0)
    assert law is not None
    assert law.target == "hinge1"
    assert answer.verdict == "unknown"


def test_two_causes_that_are_two_stay_two(make_model):
    """Dry friction and a ripple of seven cycles at one joint: no one law does both."""
    ripple = Effect(kind="torque_ripple", target="hinge2", parameters={"torque": 0.02, "cycles": 7.0, "phase": 0.4})
    friction = Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.01})
    seen, machine, scales, found = answered(make_model, friction, ripple)
    assert {term.hypothesis.kind for term in found.setting} == set(ONLY)
    assert stands(seen, machine, scales, found)


@pytest.mark.parametrize(
    ("kind", "target", "numbers"),
    [
        ("coulomb_friction", "hinge2", {"torque": 0.003}),
        ("linear_drag", "link2", {"coefficient": 0.03}),
        ("quadratic_drag", "link2", {"coefficient": 0.02}),
        ("com_offset", "link2", {"x": 0.004, "y": 0.0, "z": 0.002}),
        ("joint_pulse", "hinge2", {"torque": 0.05, "start": 2.3, "duration": 0.3}),
    ],
)
def test_what_has_a_name_keeps_it(make_model, kind, target, numbers):
    """Laws of the catalogue with sizes that are seen, and no more: a law without a name follows them worse."""
    seen, machine, scales, found = answered(make_model, Effect(kind=kind, target=target, parameters=numbers), only=("coulomb_friction",))
    assert stands(seen, machine, scales, as_if(seen, found, machine, kind, target, **numbers))


def test_numbers_of_the_model_have_no_rivals_without_a_name(make_model):
    seen, machine, scales, found = answered(make_model, Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.003}))
    setting = tuple(replace(term, hypothesis=replace(term.hypothesis, cause="parameter")) for term in found.setting)
    assert beside_nameless(seen, replace(found, setting=setting), machine, scales, (), floor=1.0)[0].setting == setting


def tethered(make_model, **numbers):
    """Evidence with a cable at the first link, the machine, its scales, and an answer that names the cable."""
    cable = {"stiffness": 2.0, "length": 0.25, "anchor_x": 0.1, "anchor_y": 0.0, "anchor_z": -0.2} | numbers
    seen, machine, scales, found = answered(make_model, Effect(kind="tether_pull", target="link1", parameters=cable))
    return seen, machine, scales, as_if(seen, found, machine, "tether_pull", "link1", **cable)


def test_a_cable_that_does_what_a_stop_does_may_be_either(make_model):
    """Taut at one end of the swing, it has five numbers for what a spring within the range does with two."""
    seen, machine, scales, found = tethered(make_model)
    answer, law = beside_nameless(seen, found, machine, scales, (), floor=1.0)
    assert law is None
    assert answer.verdict == "group"
    assert answer.nothing == pytest.approx(EVEN)
    assert answer.setting == found.setting
    assert "it may be either" in answer.notes[-1]
    assert "where q" in answer.notes[-1]


def test_a_cable_that_comes_taut_at_both_ends_is_a_cable(make_model):
    seen, machine, scales, found = tethered(make_model, anchor_x=0.0, anchor_z=-0.2, length=0.2)
    assert stands(seen, machine, scales, found)


@pytest.mark.parametrize(
    ("target", "places"),
    [
        ("hinge2", [("joint", "hinge2")]),
        ("motor", [("joint", "hinge2")]),
        ("angle", [("joint", "hinge2")]),
        ("link2", [("joint", "hinge2")]),
        ("*", [("joint", "hinge2")]),
        ("hinge1", []),
        ("link1", []),
    ],
)
def test_where_causes_meet(make_model, target, places):
    """On the joint itself, on its drive, at a sensor of it, at what it moves, at all joints; not at the joint or the body before it."""
    _, machine, _ = evidence(make_model)
    machine = replace(machine, drives=(replace(machine.drives[0], name="motor", joint="hinge2"),))
    assert isinstance(machine.drives[0], MachineDrive)
    angle = Channel(name="angle", quantity="joint.position", target="hinge2", unit="rad")
    kind = "body" if target.startswith("link") else "joint"
    first = Hypothesis(cause="effect", kind="any", target="hinge2", target_kind="joint", free=()).at()
    second = Hypothesis(cause="sensor" if target == "angle" else "effect", kind="any", target=target, target_kind=kind, free=()).at()
    assert places_of((first, second), machine, (angle,)) == places


def test_what_acts_on_a_body_acts_at_the_joints_that_carry_it(make_model):
    _, machine, _ = evidence(make_model)
    drag = Hypothesis(cause="effect", kind="any", target="link2", target_kind="body", free=()).at()
    assert places_of((drag,), machine, ()) == [("joint", "hinge2"), ("joint", "hinge1"), ("body", "link2")]


@pytest.mark.parametrize(("likeness", "better", "is_even"), [(0.9995, 2.2, True), (0.9995, 30.0, False), (0.9, 2.2, False)])
def test_two_words_for_one_thing_are_even(make_model, likeness, better, is_even):
    """A constant torque at a joint that never reverses does what dry friction does, and a little better where it stands at first: the name
    is no less likely than that. What is clearly better, or does something else, stands instead.
    """
    *_, found = answered(make_model, Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.003}))
    rival = _Rival(law=None, place=("joint", "hinge2"), judge=None, better=better, cost=-8.0, full_cost=-8.0)
    none = _probability([rival], found.setting, lambda law: likeness)
    assert (none == EVEN) == is_even
    assert is_even or none > 0.9
