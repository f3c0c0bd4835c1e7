"""What is held out may move faster than what was fitted: its replays take a smaller step where that leaves clearly less."""

from types import SimpleNamespace

import numpy as np
import pytest

from rille.diagnosis.answer import prove as module
from rille.diagnosis.answer.prove import FINER

OWN = 1e-3


class Stepped:
    """A simulator with a step."""

    own_step = OWN

    def __init__(self, step=4e-3):
        self.step = step

    def changed(self, *, step):
        return Stepped(step)


def tried(monkeypatch, excess):
    """Steps that were tried, and the chi-squared that was taken, if a step leaves ``excess(step)`` per degree beyond noise."""
    steps = []

    def gather(simulators, recordings, **like):
        step = simulators("").step
        steps.append((step, like["rough"]))
        evidence = SimpleNamespace(step=step)
        evidence.relinearised = lambda setting, on_progress: evidence
        return evidence

    monkeypatch.setattr(module, "gather", gather)
    monkeypatch.setattr(module, "_chi2", lambda e, s: np.array([[1000.0 * (1 + excess(e.step))], [1000.0]]))
    parts = SimpleNamespace(held_out=[SimpleNamespace(scenario=None)])
    _, _, sizes = module._held_out(lambda scenario: Stepped(), parts, (), None, rough=8e-3)
    return steps, sizes[1][0, 0] / 1000 - 1


def test_noise_needs_no_finer_step(monkeypatch):
    assert tried(monkeypatch, lambda step: 0.0) == ([(4e-3, 8e-3)], 0.0)


def test_the_step_s_part_is_taken_off(monkeypatch):
    """An error of first order, 10 per degree at the step that was chosen: a quarter of the model's own leaves a sixteenth, and so on."""
    steps, left = tried(monkeypatch, lambda step: 10 * step / 4e-3)
    assert [step for step, _ in steps] == [4e-3, *(OWN / finer for finer in FINER)]
    assert [rough for _, rough in steps] == [8e-3, *(None for _ in FINER)]
    assert left == pytest.approx(10 * OWN / FINER[-1] / 4e-3)


def test_what_no_step_makes_less_stays(monkeypatch):
    steps, left = tried(monkeypatch, lambda step: 1.0)
    assert len(steps) == 2
    assert left == 1.0
