"""An answer that reaches the noise is doubted where another law would still take something away, and only there."""

from types import SimpleNamespace

import numpy as np
import pytest

from rille.diagnosis.inference.doubt import doubt
from rille.diagnosis.inference.fit import fit_together
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.search import search
from rille.diagnosis.inference.settle import _swapped_together
from toy_evidence import catalogue, effect, named, number, recorded

CHEAP = [h for h in catalogue() if h.kind not in ("ripple", "push")]


def under(truth, answer):
    """The judge of an answer that was fitted to recordings of a machine with ``truth``."""
    evidence = recorded((truth,), seconds=20)
    first = Judge(evidence)
    (fitted,) = fit_together(first, [[(answer,)]])
    return Judge(evidence.relinearised(fitted.setting), fitted.setting)


def test_the_right_answer_is_not_doubted():
    truth = named("quadratic", "left", coefficient=0.03)
    assert doubt(under(truth, truth), CHEAP, {truth.hypothesis.title}) == ""


def test_a_law_that_only_acts_alike_is_doubted():
    """Drag in proportion to speed for drag with its square: at the noise as a whole, but not in what the square would take away."""
    truth, answer = named("quadratic", "left", coefficient=0.03), named("viscous", "left", coefficient=0.03)
    assert doubt(under(truth, answer), CHEAP, {answer.hypothesis.title})
    assert doubt(under(truth, answer), [truth.hypothesis], {truth.hypothesis.title}) == ""  # what the answer leaves open is no objection


@pytest.mark.parametrize("size", [0.1, 0.2])
def test_what_only_acts_alike_is_not_named(size):
    """A force with the 1.5th power of speed, which quadratic drag follows up to little: seen by another law, or as what is left."""
    extra = recorded(seconds=20, extra=lambda t, x, v: np.stack([-size * np.sign(v[0]) * np.abs(v[0]) ** 1.5, 0 * v[1]]))
    found = search(extra, CHEAP)
    assert found.verdict == "unknown"
    assert found.nothing >= 0.5
    assert "only acts like" in found.notes[-1]


def test_two_pieces_that_could_each_be_another_could_both_be():
    a, b, c, d = (effect(kind, "left", number("size")).at({"size": 1.0}) for kind in ("lag", "coulomb", "delay", "stribeck"))
    settings = [(a, b), (c, b), (a, d), (d, b)]
    standing = SimpleNamespace(
        fitted=[SimpleNamespace(setting=s) for s in settings], confounded=SimpleNamespace(order=(1, 2, 3, 4), number=(-1, 0, 0, 0, 1))
    )
    assert _swapped_together(standing, (a, b), 0) == [(c, d)]


@pytest.mark.parametrize("target", ["left", "right"])
def test_a_stand_in_is_among_the_rivals_of_every_piece(target):
    """Of friction on one cart and drag on the other: each stands with its own kin, however little those explain alone."""
    truth = (named("coulomb", "left", force=0.4), named("quadratic", "right", coefficient=0.3))
    found = search(recorded(truth, seconds=12), CHEAP)
    tried = {t.term.hypothesis.title for row in found.ranked for t in row.terms}
    assert {"left": "viscous of left", "right": "viscous of right"}[target] in tried
