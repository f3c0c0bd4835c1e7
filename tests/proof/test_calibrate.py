"""The constants of the stated probabilities, and a table of sealed trials that they were not fitted to."""

import sys
from pathlib import Path

import numpy as np
import pytest

from rille.diagnosis.inference.weights import calibration
from rille.model import InputRefused

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmark/proof"))
import calibrate
import opened

LEDGER = Path(__file__).resolve().parents[2] / "benchmark/proof/ledger.db"


@pytest.fixture(scope="module")
def names():
    return calibrate.names_of(LEDGER)


def test_what_is_stated_is_what_is_right(names):
    """The committed constants on the committed table, drawn after they were fitted: off by less than the aim of 0.05."""
    said = calibrate.report(LEDGER, names, calibration())
    assert float(said.rpartition("off by ")[2]) < 0.05
    assert f"{len(names)} names" in said


def test_names_are_those_of_the_table(names):
    """Each as the score has it; what is wrong is none of the hypotheses, and the group begins with the best."""
    assert len(names) > 100
    for name in names:
        assert name.group[0] == 0
        assert name.trial.truth < len(name.trial.behind)
        assert (name.trial.truth < 0) <= name.line["wrong"]
        assert np.all(name.trial.behind >= 0)


def test_a_ledger_that_is_still_sealed_is_refused(monkeypatch):
    monkeypatch.setattr(opened.store, "read_ledger", lambda path: type("Sealed", (), {"truths": ()})())
    with pytest.raises(InputRefused, match="not opened"):
        calibrate.names_of(Path("some.db"))
