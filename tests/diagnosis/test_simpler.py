"""Two causes that meet at one joint, where one law without a name does as well: the answer is that law, not the two names."""

from dataclasses import replace

import pytest

from diagnosis.test_unknown import evidence, hidden
from rille import store
from rille.diagnosis.hypotheses.candidates import candidates, of_kind
from rille.diagnosis.inference.search import search
from rille.diagnosis.inference.simpler import one_law_instead, shared_joint
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
    instead = one_law_instead(seen, found, machine, scales, (), floor=1.0)
    assert instead is not None
    answer, law = instead
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
    assert one_law_instead(seen, found, machine, scales, (), floor=1.0) is None


@pytest.mark.parametrize(
    ("target", "joint"), [("hinge2", "hinge2"), ("hinge1", ""), ("motor", "hinge2"), ("angle", "hinge2"), ("link2", "")]
)
def test_where_causes_meet(make_model, target, joint):
    """On the joint itself, on its drive or at a sensor of it; not at the joint beside it, nor at the body."""
    _, machine, _ = evidence(make_model)
    machine = replace(machine, drives=(replace(machine.drives[0], name="motor", joint="hinge2"),))
    assert isinstance(machine.drives[0], MachineDrive)
    angle = Channel(name="angle", quantity="joint.position", target="hinge2", unit="rad")
    first, second = (
        Hypothesis(cause=cause, kind="any", target=place, target_kind="joint", free=()).at()
        for cause, place in (("effect", "hinge2"), ("sensor" if target == "angle" else "effect", target))
    )
    assert shared_joint((first, second), machine, (angle,)) == joint
