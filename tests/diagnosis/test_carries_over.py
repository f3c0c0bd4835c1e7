"""An answer that does not hold for what was held out is no answer."""

from dataclasses import replace

import numpy as np
import pytest

from rille.diagnosis.answer.prove import carries_over
from rille.model.diagnosis import Proof


@pytest.mark.parametrize(
    ("before", "gap", "high", "expected"),
    [
        (1.24, 0.27, 0.66, False),  # plainly beyond the noise, and surely most of a third of that is left
        (5.4, 0.17, 1.0, True),  # one block of windows decides: nothing is sure
        (1.07, 0.25, 0.46, True),  # hardly beyond the noise: G divides by nothing
        (1.5, 0.95, 1.0, True),
        (np.nan, np.nan, np.nan, True),  # nothing was held out
    ],
)
def test_an_answer_must_hold_for_what_was_held_out(before, gap, high, expected):
    proof = Proof(gap_closed=gap, low=gap - 0.2, high=high, before=before, after=1.0, floor=1.0, held_out="'held_out'")
    assert carries_over(proof) is expected


def test_several_pieces_must_close_some_of_the_gap():
    """Where it may be that they close nothing they are no answer; one piece may be."""
    proof = Proof(gap_closed=0.3, low=-0.1, high=0.8, before=1.1, after=1.07, floor=1.0, held_out="'held_out'")
    assert carries_over(proof)
    assert not carries_over(proof, pieces=2)
    assert carries_over(replace(proof, gap_closed=0.9, low=0.6, high=1.0), pieces=2)
    assert carries_over(replace(proof, gap_closed=np.nan, low=np.nan, high=np.nan), pieces=2)
