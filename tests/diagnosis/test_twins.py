"""Twins: what does the very same in a recording is judged alike, and told as a group."""

from dataclasses import replace

import numpy as np
import pytest

from machines import box, chain
from recorded import commanded, record
from rille import simulate, store
from rille.diagnosis.evidence.replay_evidence import gather
from rille.diagnosis.hypotheses.candidates import candidates, of_kind
from rille.diagnosis.inference.fit import fit_together
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.rivals import Rivals
from rille.diagnosis.inference.search import search
from rille.diagnosis.inference.settle import State, settle
from rille.model import Command, Drive, Effect, Gear, InitialJointState, Joint, Scenario
from rille.model.recording import Channel

RATIO = 20.0
ARM = chain([0.3], [0.5])
ARM = replace(
    ARM,
    bodies=(*ARM.bodies, box("rotor", 0.1, (0, 0.1, -0.1), (0.04, 0.03, 0.04))),
    joints=(
        *ARM.joints,
        Joint(name="motor", kind="hinge", parent=None, child="rotor", point=(0, 0.1, -0.1), axis=(0, 1, 0)),
    ),
    gears=(Gear(name="gear", joint_a="hinge1", joint_b="motor", ratio=RATIO),),
    drives=(Drive(name="motor", joint="motor", mode="torque", max_torque=0.1),),
)
TIMES = np.arange(0, 8, 0.05)
TORQUES = 0.03 * np.sin(1.7 * TIMES) + 0.01 * np.sin(5.1 * TIMES + 1)
SCENARIO = Scenario(
    name="s",
    duration=8,
    gravity=(0, 0, -9.80665),
    step=1e-3,
    integrator="semi_implicit_euler",
    commands=tuple(Command(drive="motor", time=float(t), value=float(v)) for t, v in zip(TIMES, TORQUES, strict=True)),
)
FRICTION = {"coulomb_torque": 0.05, "stiction_excess": 0.04, "stribeck_speed": 0.1}


def asked(make_model, rover, scenario, effect, sensors, only):
    """8 s at 50 Hz as evidence, and the few laws that are asked about."""
    base = simulate.Replayer(make_model(rover, scenario, None, []))
    recording = record(make_model(rover, scenario, None, [effect]), sensors, duration=8, rate=50, seed=1)
    recording = commanded(replace(recording, scenario="s"), scenario)
    tried = of_kind(candidates(base.machine(), recording.channels, store.effect_kinds()), only=only)
    return gather({"s": base}, [recording]), tried


def found_in(make_model, rover, scenario, effect, sensors, only):
    """What a search among a few laws finds."""
    evidence, tried = asked(make_model, rover, scenario, effect, sensors, only)
    return search(evidence, tried, kinds={kind.name: kind for kind in store.effect_kinds()})


def sensor(joint, word, unit, noise):
    return Channel(name=f"{joint} {word}", quantity=f"joint.{word}", target=joint, unit=unit, noise=noise)


def test_friction_before_and_behind_a_gear(make_model):
    """Torques behind it are the ratio times those before it, within 1 %; speeds the ratio less, within 5 %, less than their intervals."""
    friction = Effect(kind="stribeck_friction", target="hinge1", parameters=FRICTION)
    sensors = [sensor("hinge1", "position", "rad", 1e-3), sensor("motor", "velocity", "rad/s", 0.05)]
    found = found_in(make_model, ARM, SCENARIO, friction, sensors, ("stribeck_friction", "coulomb_friction"))
    assert found.verdict == "group"
    members = {row.title: row for row in found.ranked if row.group == 0}
    behind, before = (members[f"stribeck_friction of {joint}"] for joint in ("hinge1", "motor"))
    assert abs(behind.behind - before.behind) < 0.5
    behind, before = (row.terms[0].term.numbers for row in (behind, before))
    assert behind["coulomb_torque"] / before["coulomb_torque"] == pytest.approx(RATIO, rel=0.01)
    assert before["stribeck_speed"] / behind["stribeck_speed"] == pytest.approx(RATIO, rel=0.05)


def test_a_tilt_and_a_biased_sensor_of_a_pendulum(make_model):
    """Down is elsewhere, or the sensor says so: by the same angle, within a tenth of an error of 0.3 mrad. Under starts of its own the one
    explains as much as the other; a roll that nothing tells costs it a nat or two.
    """
    swing = replace(SCENARIO, commands=(), initial_states=(InitialJointState(joint="hinge1", position=0.8),))
    tilt = Effect(kind="gravity_tilt", target="*", parameters={"roll": 0.0, "pitch": 0.004})
    sensors = [sensor("hinge1", "position", "rad", 2e-3), sensor("hinge1", "velocity", "rad/s", 0.02)]
    found = found_in(make_model, chain([0.3], [0.5]), swing, tilt, sensors, ("gravity_tilt", "bias", "drift"))
    assert found.verdict == "group"
    members = {row.title: row for row in found.ranked if row.group == 0}
    turned, biased = members["gravity_tilt"], members["bias of hinge1 position"]
    assert turned.explained == pytest.approx(biased.explained, abs=0.005)
    assert abs(turned.behind - biased.behind) < 2.0
    assert abs(turned.terms[0].term.numbers["pitch"]) == pytest.approx(abs(biased.terms[0].term.numbers["offset"]), abs=3e-5)


def test_one_law_is_believed_before_two_that_say_as_much(make_model):
    """Two sensors with clocks of their own, late alike, are a command that is late: where the search took the two for an answer, settling
    it finds the one. Its delay to 0.6 ms, three of its errors.
    """
    swing = replace(SCENARIO, commands=tuple(replace(c, drive="hinge1", value=8 * c.value) for c in SCENARIO.commands))
    rover = replace(chain([0.3], [0.5]), drives=(Drive(name="hinge1", joint="hinge1", mode="torque", max_torque=2.0),))
    late = Effect(kind="command_delay", target="hinge1", parameters={"delay": 0.004})
    evidence, tried = asked(
        make_model,
        rover,
        swing,
        late,
        [
            replace(sensor("hinge1", "position", "rad", 1e-3), clock="one"),
            replace(sensor("hinge1", "velocity", "rad/s", 0.05), clock="other"),
        ],
        ("command_delay", "delay"),
    )
    (command,) = (h for h in tried if h.kind == "command_delay")
    delays = [h for h in tried if h.cause == "sensor" and h.kind == "delay"]
    assert len(delays) == 2
    judge = Judge(evidence)
    state = State(always=(), first=judge, judge=judge)
    (two,) = fit_together(judge, [[tuple(h.at({"delay": 0.004}) for h in delays)]])
    rivals = [Rivals(tuple(h.at({"delay": 0.005}) for h in (*delays, command))) for _ in delays]
    assert settle(state, evidence, two, rivals, len(tried), under=evidence)
    (piece,) = state.pieces
    assert piece.hypothesis.title == "command_delay of hinge1"
    assert piece.numbers["delay"] == pytest.approx(0.004, abs=6e-4)
    assert any("would explain as much" in note for note in state.notes)


def test_what_gave_way_to_its_twin_is_told_beside_it(make_model):
    """A command that is 20 ms late, and a search that took a lag of the motor for it: the delay takes its place, and the lag, which no
    other look would find again, is fitted beside it.
    """
    swing = replace(SCENARIO, commands=tuple(replace(c, drive="hinge1", value=8 * c.value) for c in SCENARIO.commands))
    rover = replace(chain([0.3], [0.5]), drives=(Drive(name="hinge1", joint="hinge1", mode="torque", max_torque=2.0),))
    late = Effect(kind="command_delay", target="hinge1", parameters={"delay": 0.02})
    sensors = [sensor("hinge1", "position", "rad", 2e-4), sensor("hinge1", "velocity", "rad/s", 0.01)]
    evidence, tried = asked(make_model, rover, swing, late, sensors, ("command_delay", "motor_lag"))
    (delay,), (lag,) = ([h for h in tried if h.kind == kind and h.target == "hinge1"] for kind in ("command_delay", "motor_lag"))
    judge = Judge(evidence)
    state = State(always=(), first=judge, judge=judge)
    (taken,) = fit_together(judge, [[(lag.at({"time_constant": 0.02}),)]])
    assert settle(state, evidence, taken, [Rivals((delay.at({"delay": 0.02}),))], len(tried), under=evidence)
    assert [piece.hypothesis for piece in state.pieces] == [delay]
    assert [one.setting[0].hypothesis for one in state.standing.fitted] == [delay, lag]
