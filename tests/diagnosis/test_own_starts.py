"""Who gets starts of its own when an answer is settled: whoever could be ahead with them."""

from types import SimpleNamespace

import numpy as np
import pytest

from rille.diagnosis.inference import settle

GAIN = 200.0  # [nats] of the best


@pytest.mark.parametrize(
    ("behind", "told", "tried"),
    [
        (5.0, False, True),  # a twin
        (70.0, True, True),  # told from it, but only by starts that were fitted with the best: a third of what that gains
        (100.0, True, False),  # half of it: what starts are worth is less
        (100.0, False, False),
    ],
)
def test_who_gets_starts_of_its_own(monkeypatch, behind, told, tried):
    """Fits: the best (1), and one rival (2); 0 is the base. Nothing comes out better, so the answer stays."""
    score = np.array([0.0, GAIN, GAIN - behind])
    fits = [SimpleNamespace(setting=name, chi2=1.0, kappa=1.0) for name in ("best", "rival")]
    standing = SimpleNamespace(
        scores=SimpleNamespace(ahead=score[:, None] - score[None, :]),
        confounded=SimpleNamespace(order=[1, 2], number={1: 0, 2: int(told)}),
        fitted=fits,
    )
    asked = []
    monkeypatch.setattr(settle, "own_fit", lambda evidence, setting, state: (asked.append(setting) or fits[1], evidence))
    answer = settle._among_the_close(None, "evidence", fits[0], "linear", standing)
    assert asked == (["rival", "rival"] if tried else [])  # the second turn gains nothing
    assert answer == (fits[0], "linear", standing)


@pytest.mark.parametrize(
    ("turns", "kappa", "left"),
    [
        ((60.0, 50.0, 49.0), 1.0, 49.0),  # the last turn gains less than three nats: enough
        ((60.0, 70.0), 1.0, 60.0),  # a turn that makes it worse is not taken
        ((99.0,), 1.0, 100.0),  # nothing to gain
        ((60.0, 50.0, 40.0), 5.0, 50.0),  # so far from the noise ten is nothing
    ],
)
def test_the_answer_is_fitted_until_nothing_is_gained(monkeypatch, turns, kappa, left):
    """Chi-squared of the answer is 100 when it is settled; each turn of starts and numbers leaves less."""
    fit = SimpleNamespace(setting="best", chi2=100.0, kappa=kappa)
    standing = SimpleNamespace(confounded=SimpleNamespace(order=[1]), fitted=[fit])
    given = iter(turns)
    monkeypatch.setattr(settle, "own_fit", lambda *_: (SimpleNamespace(setting="best", chi2=next(given, 1e9), kappa=kappa), "its own"))
    monkeypatch.setattr(settle, "stand", lambda first, evidence, fitted: SimpleNamespace(confounded=standing.confounded, fitted=fitted))
    answer, evidence, stands = settle._to_the_end(SimpleNamespace(first=None), "evidence", fit, "linear", standing)
    assert answer.chi2 == left
    assert evidence == ("linear" if left == 100.0 else "its own")
    assert stands.fitted == [answer]
