"""A difference that the starts of windows could hide is not called nothing."""

from dataclasses import replace

import numpy as np
import pytest

from rille import simulate, store
from rille.diagnosis import diagnose as module
from rille.diagnosis.diagnose import Options, diagnose
from rille.diagnosis.evidence.held_out import cut_in_time
from rille.diagnosis.inference.search import search
from swung import model, recorded


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
