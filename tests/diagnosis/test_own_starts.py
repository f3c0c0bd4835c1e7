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
    fits = [SimpleNamespace(setting=name, chi2=1.0) for name in ("best", "rival")]
    standing = SimpleNamespace(
        scores=SimpleNamespace(ahead=score[:, None] - score[None, :]),
        confounded=SimpleNamespace(order=[1, 2], number={1: 0, 2: int(told)}),
        fitted=fits,
    )
    asked = []
    monkeypatch.setattr(settle, "own_fit", lambda evidence, setting, state: (asked.append(setting) or fits[1], evidence))
    answer = settle._among_the_close(None, "evidence", fits[0], "linear", standing)
    assert asked == (["rival"] if tried else [])
    assert answer == (fits[0], "linear", standing)
