"""How late commands are where pushes are looked for; the search itself is tested in test_pushes."""

from dataclasses import replace

import pytest

from rille.diagnosis.pushes.diagnose_pushes import found_delays, late_commands
from rille.model.recording import Channel, GateFinding, Recording


def run(name, delay=0.0, found=None):
    """A recording with a torque command, and what the gate found of it."""
    command = Channel(name="tau", quantity="joint.effort", target="elbow", unit="N m", role="command", delay=delay)
    detail = {"kind": "response", "delay": found}
    findings = (GateFinding(code="delay", severity="note", channel="tau", detail=detail, message="late"),) if found is not None else ()
    return Recording(name=name, channels=(command,), findings=findings)


def test_the_gate_tells_how_late_commands_are_where_nobody_states_it():
    runs = [run("a", found=0.008), run("b", found=0.010), run("c", found=0.030), run("d")]
    assert found_delays(runs) == {"elbow": pytest.approx(0.010)}
    assert [r.channels[0].delay for r in late_commands(runs, {"elbow": 0.01})] == [0.01] * 4


def test_what_is_stated_counts_and_stays():
    runs = [run("a", found=0.015), run("b", delay=0.009)]
    assert found_delays(runs) == {"elbow": pytest.approx(0.009)}
    assert [r.channels[0].delay for r in late_commands(runs, found_delays(runs))] == [0.009, 0.009]
    assert found_delays([run("a")]) == {}
    rate = GateFinding(code="delay", severity="note", channel="tau", detail={"kind": "rate", "delay": 0.2}, message="late")
    assert found_delays([replace(run("a"), findings=(rate,))]) == {}
