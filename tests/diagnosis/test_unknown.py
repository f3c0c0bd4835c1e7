"""A law that the catalogue has no name for is written as a formula that the solver runs; noise is not."""

from dataclasses import replace

import numpy as np
import pytest

from machines import cart, chain, plane
from made_machines import machine_of
from recorded import commanded, record
from rille import simulate, store
from rille.diagnosis.evidence.applied import setting_effects
from rille.diagnosis.evidence.replay_evidence import gather
from rille.diagnosis.hypotheses.formulas import as_setting, in_words, laws_of
from rille.diagnosis.hypotheses.natural import natural
from rille.diagnosis.inference.unknown import find_unknown
from rille.model import Command, Drive, Effect, InitialJointState, Scenario
from rille.model.recording import Channel

TIMES = np.arange(0, 6, 0.05)
TORQUES = 0.8 * np.sin(2.5 * TIMES) + 0.5 * np.sin(4.1 * TIMES + 1)
ROVER = replace(chain([0.3, 0.25], [0.5, 0.4]), drives=(Drive(name="m", joint="hinge1", mode="torque", max_torque=5.0),))
SCENARIO = Scenario(
    name="s",
    duration=6,
    gravity=(0, 0, -9.80665),
    step=1e-3,
    integrator="semi_implicit_euler",
    commands=tuple(Command(drive="m", time=float(t), value=float(v)) for t, v in zip(TIMES, TORQUES, strict=True)),
    initial_states=(InitialJointState(joint="hinge2", position=0.5),),
)
DAMPED = [Effect(kind="viscous_friction", target=f"hinge{k}", parameters={"coefficient": c}) for k, c in ((1, 0.03), (2, 0.01))]


def hidden(formula, target="hinge2", **constants):
    pairs = {name: list(pair) for name, pair in constants.items()}
    words = {"formula": formula, "output": "joint.effort", "constants": pairs, "target_kind": "joint", "gain": 1.0}
    return Effect(kind="expression", target=target, parameters=words)


def evidence(make_model, *effects):
    """Of 6 s at 50 Hz; positions within 1 mrad, velocities within 10 mrad/s."""
    base = simulate.Replayer(make_model(ROVER, SCENARIO, None, DAMPED))
    true = make_model(ROVER, SCENARIO, None, [*DAMPED, *effects])
    sensors = [
        Channel(name=f"{word}{k}", quantity=f"joint.{word}", target=f"hinge{k}", unit=unit, noise=noise)
        for k in (1, 2)
        for word, unit, noise in (("position", "rad", 1e-3), ("velocity", "rad/s", 1e-2))
    ]
    recording = record(true, sensors, duration=6, rate=50, seed=1)
    recording = commanded(replace(recording, scenario="s"), SCENARIO)
    machine = base.machine()
    return gather({"s": base}, [recording]), machine, natural(machine, recording.channels)


def test_a_cubic_friction_is_found_at_its_joint(make_model):
    """-2e-4 v^3 N m, which no law of the catalogue is: form, joint, and number within 3 %."""
    found = find_unknown(*evidence(make_model, hidden("-c*velocity^3", c=(2e-4, "N m s^3/rad^3"))))
    assert found is not None
    assert (found.target_kind, found.target) == ("joint", "hinge2")
    assert found.explained > 0.99
    (term,) = found.setting
    constants = dict(term.hypothesis.words)["constants"]
    assert "(v^3)" in found.formula
    assert "|" not in found.formula
    assert constants["c1"][0] / constants["w"][0] ** 3 == pytest.approx(2e-4, rel=0.03)
    assert "behaves like" in found.sentence
    (effect,), moved = setting_effects(found.setting, {})
    store.check_effect(effect)
    assert not moved


def test_a_stop_within_the_range_is_found_where_it_begins(make_model):
    """A spring of 0.1 N m/rad from 0.6 rad on, between the places that are tried. It is met in three windows of twelve, too few to be
    proven on others. Tolerances are about two standard errors.
    """
    stop = hidden("-c*max(position-p,0)", "hinge1", c=(0.1, "N m/rad"), p=(0.6, "rad"))
    found = find_unknown(*evidence(make_model, stop), targets=[("joint", "hinge1")], most=1, nameless=True)
    assert found is not None
    assert found.numbers == 2
    assert "where q > 0." in found.formula
    (term,) = found.setting
    constants = dict(term.hypothesis.words)["constants"]
    assert constants["k1"][0] == pytest.approx(0.6, abs=0.02)
    assert constants["c1"][0] / constants["a"][0] == pytest.approx(0.1, rel=0.05)


def test_noise_is_no_formula(make_model):
    assert find_unknown(*evidence(make_model)) is None


@pytest.mark.parametrize("kind", ["joint", "body", "wheel"])
def test_every_formula_has_its_dimension_and_runs(make_model, kind):
    """The solver refuses what is not homogeneous."""
    if kind == "wheel":
        rover = cart(5.0, 0.15, 0.165)
        commands = tuple(Command(drive=d.name, time=0.0, value=2.0) for d in rover.drives)
        scenario = Scenario(name="s", duration=1, step=2e-3, terrain="plane", placement="on_terrain", settle_time=2.0, commands=commands)
        base = simulate.Replayer(make_model(rover, scenario, plane()))
        target = "*"
    else:
        base = simulate.Replayer(make_model(ROVER, SCENARIO, None, DAMPED))
        target = {"joint": "hinge2", "body": "link2"}[kind]
    machine = base.machine()
    laws = laws_of(machine, replace(natural(machine, ()), ranges={"hinge2": (-0.5, 1.5)}), kind, target)
    assert len(laws) > 4
    assert sum(law.place is not None for law in laws) == (8 if kind == "joint" else 0)
    for law in laws:
        effects, _ = setting_effects(as_setting([law, laws[0], laws[-1]], [0.01 * law.size, 0.0, 0.0]), {})
        changed = base.changed(effects)
        state, ended = changed.advance(changed.rest(), 0.1)
        assert not ended
        assert np.isfinite(state).all(), law.words
        assert law.words in in_words([law], [0.5 * law.size])


def test_signs_are_told_as_they_act():
    machine = machine_of(ROVER)
    (spring,) = [law for law in laws_of(machine, natural(machine, ()), "joint", "hinge2") if law.words == "q"]
    assert in_words([spring], [0.2]) == "- 0.2 N m (q), q in units of 1 rad"
    assert in_words([spring], [-0.2]) == "+ 0.2 N m (q), q in units of 1 rad"
