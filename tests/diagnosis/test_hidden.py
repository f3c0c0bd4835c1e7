"""A difference that the starts of windows could hide is not called nothing."""

from dataclasses import replace

import numpy as np
import pytest

from recorded import commanded, record
from rille import simulate, store
from rille.diagnosis import diagnose as module
from rille.diagnosis.diagnose import Options, diagnose
from rille.diagnosis.evidence.held_out import cut_in_time
from rille.diagnosis.inference.search import search
from rille.model import Effect
from swung import model, recorded, sensors


@pytest.mark.parametrize(("offset", "verdict"), [(0.0, "nothing_missing"), (4.0, "cannot_know")])
def test_a_clear_difference_that_no_excess_bears_out_is_not_called_nothing(make_model, monkeypatch, offset, verdict):
    """The comparison sees a kink of 4 sigma in every window; the search is made to see nothing, as where windows meet."""
    path, scenario = model(make_model, 2)
    run = cut_in_time(recorded(path, scenario, 2), 0, 5)
    angle = next(c for c in run.channels if c.name == "angle2")
    kink = offset * angle.noise * np.sign(np.sin(2 * np.pi * 3 * angle.time))
    run = replace(run, channels=tuple(replace(c, value=c.value + kink) if c.name == "angle2" else c for c in run.channels))
    monkeypatch.setattr(
        module, "search", lambda *a, **k: replace(search(*a, **k), verdict="nothing_missing", setting=(), terms=(), ranked=())
    )
    found = diagnose(
        lambda name: simulate.Replayer(path, name or None),
        [run],
        kinds=store.effect_kinds(),
        options=Options(window=0.5, only=("coulomb_friction",)),
    )
    assert found.verdict == verdict
    assert any("where two windows meet" in note for note in found.notes) == (verdict == "cannot_know")


def test_a_push_where_two_windows_meet_is_found_with_other_edges(make_model):
    """A push of 60 ms across the edge at 2 s: the window from there begins in the middle of it, and its start takes it up. Half a window
    later it is as plain as any other. Noise lets start and length be known to some milliseconds, the impulse to a few percent.
    """
    push = {"torque": 0.04, "start": 1.98, "duration": 0.06}
    path, scenario = model(make_model, 2, (Effect(kind="joint_pulse", target="hinge2", parameters=push),), 6.0)
    run = commanded(record(path, sensors(), duration=6.0, rate=450, seed=2, jitter=3e-4), scenario)
    base, _ = model(make_model, 2, (), 6.0)
    found = diagnose(
        lambda name: simulate.Replayer(base, name or None),
        [run],
        kinds=store.effect_kinds(),
        options=Options(window=1.0, only=("joint_pulse",)),
    )
    assert "search" not in found.seconds, "the first look saw nothing"
    assert "other edges: search" in found.seconds
    assert found.verdict == "named"
    assert [h.title for h in found.hypotheses] == ["joint_pulse of hinge2"]
    numbers = found.setting[0].numbers
    assert numbers["start"] == pytest.approx(1.98, abs=0.01)
    assert numbers["torque"] * numbers["duration"] == pytest.approx(0.04 * 0.06, rel=0.1)
    assert any("begin 0.5 s later" in note for note in found.notes)
