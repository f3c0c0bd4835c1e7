"""A gear makes twins: the same friction before and behind it, with numbers that its ratio relates. Nothing tells them apart."""

from dataclasses import replace

import numpy as np
import pytest

from machines import box, chain
from recorded import record
from rille import simulate, store
from rille.diagnosis.evidence.replay_evidence import gather
from rille.diagnosis.hypotheses.candidates import candidates, of_kind
from rille.diagnosis.inference.search import search
from rille.model import Command, Drive, Effect, Gear, Joint, Scenario
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


def test_friction_before_and_behind_a_gear_is_a_group(make_model):
    """Torques behind it are the ratio times those before it, within 1 %; speeds the ratio less, within 5 %, less than their intervals."""
    base = simulate.Replayer(make_model(ARM, SCENARIO, None, []))
    true = make_model(ARM, SCENARIO, None, [Effect(kind="stribeck_friction", target="hinge1", parameters=FRICTION)])
    sensors = [
        Channel(name=f"{joint} {word}", quantity=f"joint.{word}", target=joint, unit=unit, noise=noise)
        for joint, word, unit, noise in (("hinge1", "position", "rad", 1e-3), ("motor", "velocity", "rad/s", 0.05))
    ]
    recording = record(true, sensors, duration=8, rate=50, seed=1)
    command = Channel(name="tau", quantity="joint.effort", target="motor", unit="N m", role="command", time=TIMES, value=TORQUES)
    recording = replace(recording, scenario="s", channels=(*recording.channels, command))
    kinds = store.effect_kinds()
    tried = of_kind(candidates(base.machine(), recording.channels, kinds), only=("stribeck_friction", "coulomb_friction"))
    found = search(gather({"s": base}, [recording]), tried, kinds={kind.name: kind for kind in kinds})
    assert found.verdict == "group"
    members = {row.terms[0].term.hypothesis.target: row for row in found.ranked if row.group == 0}
    assert {"hinge1", "motor"} <= set(members)
    behind, before = (members[name].terms[0].term.numbers for name in ("hinge1", "motor"))
    assert members["hinge1"].title == "stribeck_friction of hinge1"
    assert behind["coulomb_torque"] / before["coulomb_torque"] == pytest.approx(RATIO, rel=0.01)
    assert before["stribeck_speed"] / behind["stribeck_speed"] == pytest.approx(RATIO, rel=0.05)
    assert abs(members["hinge1"].behind - members["motor"].behind) < 0.5
