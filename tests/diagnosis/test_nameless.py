"""Where one law without a name does as well with fewer numbers: of two causes that meet at one joint it is the answer, not the two names;
of one cause with many numbers it may be either.
"""

from dataclasses import replace

import pytest

from diagnosis.test_unknown import evidence, hidden
from rille import store
from rille.diagnosis.hypotheses.candidates import candidates, of_kind
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.search import search
from rille.diagnosis.inference.simpler import beside_one_law, shared_joint
from rille.model import Effect
from rille.model.hypothesis import Hypothesis
from rille.model.machine import MachineDrive
from rille.model.recording import Channel

KINDS = store.effect_kinds()
ONLY = ("coulomb_friction", "torque_ripple")


def answered(make_model, *effects):
    """Evidence, the machine, its scales, and what a search among dry friction and ripple finds."""
    seen, machine, scales = evidence(make_model, *effects)
    found = search(seen, of_kind(candidates(machine, (), KINDS), only=ONLY), kinds={kind.name: kind for kind in KINDS})
    return seen, machine, scales, found


def test_friction_one_way_is_no_friction_with_a_ripple(make_model):
    """0.02 N m against motion in one sense alone: half of it either way and half of it always, as a ripple of one cycle is nearly."""
    seen, machine, scales, found = answered(make_model, hidden("-c*max(tanh(velocity/w),0)", c=(0.02, "N m"), w=(0.02, "rad/s")))
    assert len(found.setting) == 2
    answer, law = beside_one_law(seen, found, machine, scales, (), floor=1.0)
    assert law is not None
    assert "(sign(v) where v > 0)" in law.formula
    assert answer.verdict == "unknown"
    assert answer.nothing >= 0.5
    assert answer.setting == ()
    assert "may be one that has no name" in answer.notes[-1]


def test_two_causes_that_are_two_stay_two(make_model):
    """Dry friction and a ripple of seven cycles at one joint: no one law does both."""
    ripple = Effect(kind="torque_ripple", target="hinge2", parameters={"torque": 0.02, "cycles": 7.0, "phase": 0.4})
    friction = Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.01})
    seen, machine, scales, found = answered(make_model, friction, ripple)
    assert {term.hypothesis.kind for term in found.setting} == set(ONLY)
    assert beside_one_law(seen, found, machine, scales, (), floor=1.0) == (found, None)


def tethered(make_model, **numbers):
    """Evidence with a cable at the first link, the machine, its scales, and an answer that names the cable with its true numbers."""
    cable = {"stiffness": 2.0, "length": 0.25, "anchor_x": 0.1, "anchor_y": 0.0, "anchor_z": -0.2} | numbers
    seen, machine, scales, found = answered(make_model, Effect(kind="tether_pull", target="link1", parameters=cable))
    (hypothesis,) = [h for h in of_kind(candidates(machine, (), KINDS), only=("tether_pull",)) if h.target == "link1"]
    setting = (hypothesis.at(cable),)
    after = Judge(seen.relinearised(setting), setting)
    return seen, machine, scales, replace(found, verdict="named", setting=setting, chi2_after=after.chi2, kappa=1.0, nothing=0.05)


def test_a_cable_that_does_what_a_stop_does_may_be_either(make_model):
    """Taut at one end of the swing, it has five numbers for what a spring within the range does with two."""
    seen, machine, scales, found = tethered(make_model)
    answer, law = beside_one_law(seen, found, machine, scales, (), floor=1.0)
    assert law is None
    assert answer.verdict == "group"
    assert answer.nothing >= 0.5
    assert answer.setting == found.setting
    assert "it may be either" in answer.notes[-1]
    assert "where q" in answer.notes[-1]


def test_a_cable_that_comes_taut_at_both_ends_is_a_cable(make_model):
    seen, machine, scales, found = tethered(make_model, anchor_x=0.0, anchor_z=-0.2, length=0.2)
    assert beside_one_law(seen, found, machine, scales, (), floor=1.0) == (found, None)


@pytest.mark.parametrize(
    ("target", "joint"), [("hinge2", "hinge2"), ("hinge1", ""), ("motor", "hinge2"), ("angle", "hinge2"), ("link2", ""), ("link1", "")]
)
def test_where_causes_meet(make_model, target, joint):
    """On the joint itself, on its drive or at a sensor of it; not at the joint beside it, nor at a body that other joints move, too."""
    _, machine, _ = evidence(make_model)
    machine = replace(machine, drives=(replace(machine.drives[0], name="motor", joint="hinge2"),))
    assert isinstance(machine.drives[0], MachineDrive)
    angle = Channel(name="angle", quantity="joint.position", target="hinge2", unit="rad")
    first, second = (
        Hypothesis(cause=cause, kind="any", target=place, target_kind="joint", free=()).at()
        for cause, place in (("effect", "hinge2"), ("sensor" if target == "angle" else "effect", target))
    )
    assert shared_joint((first, second), machine, (angle,)) == joint


def test_what_acts_on_a_body_acts_at_the_joint_that_alone_lets_it_move(make_model):
    _, machine, _ = evidence(make_model)
    drag, friction = (
        Hypothesis(cause="effect", kind="any", target=target, target_kind=kind, free=()).at()
        for target, kind in (("link1", "body"), ("hinge1", "joint"))
    )
    assert shared_joint((drag, friction), machine, ()) == "hinge1"
