"""A law at one target stands before the same law at all of them, as long as the recordings do not tell them apart."""

import pytest

from rille.diagnosis.inference.confound import groups, is_narrower
from rille.diagnosis.inference.fit import fit_together
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.rank import rank
from toy_evidence import named, recorded

CUT = 0.21  # the left cart is commanded up to 5, the right one up to 4.5: only the left one meets a limit of 1/0.21
ONE, ALL, OTHER = (named("limit", target, inverse=CUT) for target in ("left", "*", "right"))
DRAG, DRAG_OF_ALL = named("quadratic", "left", coefficient=0.2), named("quadratic", "*", coefficient=0.2)


@pytest.mark.parametrize("order", [(ONE, ALL), (ALL, ONE)])
def test_one_target_stands_before_all(order):
    """What both explain alike, whichever comes first."""
    evidence = recorded((ONE,), seconds=20)
    judge = Judge(evidence)
    fitted = fit_together(judge, [[(term,)] for term in order])
    found = groups(rank(evidence, fitted, judge=judge), fitted, judge.metric.edges)
    assert fitted[found.order[0] - 1].setting[0].hypothesis.title == "limit of left"
    assert [found.number[i] for i in (1, 2)] == [0, 0]


@pytest.mark.parametrize(
    ("one", "other", "narrower"),
    [
        ((ONE,), (ALL,), True),
        ((ALL,), (ONE,), False),
        ((ONE,), (OTHER,), False),
        ((ONE,), (DRAG_OF_ALL,), False),  # another law
        ((DRAG, ONE), (DRAG, ALL), True),
        ((DRAG, ONE), (DRAG_OF_ALL, ALL), True),
        ((ONE,), (ONE,), False),
    ],
)
def test_what_is_narrower(one, other, narrower):
    assert is_narrower(one, other) is narrower
