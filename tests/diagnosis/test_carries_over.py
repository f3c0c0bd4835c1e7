"""An answer that does not hold for what was held out is no answer."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rille.diagnosis.answer.prove import _gap_of, _left, _touched, carries_over, none_by
from rille.model.diagnosis import Gap, Proof


@pytest.mark.parametrize(
    ("before", "gap", "high", "expected"),
    [
        (1.24, 0.27, 0.66, False),  # plainly beyond the noise, and surely most of a third of that is left
        (5.4, 0.17, 1.0, True),  # one block of windows decides: nothing is sure
        (1.07, 0.25, 0.46, True),  # hardly beyond the noise: G divides by nothing
        (1.5, 0.95, 1.0, True),
        (1.03, -1.06, -0.001, False),  # worse than without it, and surely no better
        (1.03, -0.3, 0.4, True),  # worse, but that may be chance
        (1.01, 0.0, 0.001, True),  # it does not act there: nothing is said
        (np.nan, np.nan, np.nan, True),  # nothing was held out
    ],
)
def test_an_answer_must_hold_for_what_was_held_out(before, gap, high, expected):
    proof = Proof(gap_closed=gap, low=gap - 0.2, high=high, before=before, after=1.0, floor=1.0, held_out="'held_out'")
    assert carries_over(proof) is expected


@pytest.mark.parametrize(("likelier", "expected"), [(-4.0, True), (-6.0, False), (3.0, True), (np.nan, True)])
def test_an_answer_does_not_make_what_was_held_out_less_likely(likelier, expected):
    """A law that is right and changes chi-squared by d lowers it by d +- 2 sqrt(d): that it rises by 10 is 3.2 sigma, whatever d."""
    proof = Proof(gap_closed=np.nan, low=np.nan, high=np.nan, before=0.98, after=0.99, floor=1.0, held_out="h", likelier=likelier)
    assert carries_over(proof) is expected


@pytest.mark.parametrize(
    ("before", "after", "floor", "likelier"),
    [
        (1000.0, 900.0, 1.0, 50.0),
        (900.0, 1000.0, 1.0, -50.0),
        (1000.0, 900.0, 1.25, 40.0),  # the noise is understated
        (9000.0, 8000.0, 1.0, 500.0 / 8.0),  # the better of both leaves eight times the noise
    ],
)
def test_how_much_likelier_what_was_held_out_is(before, after, floor, likelier):
    """Half of what chi-squared of 1000 degrees falls by, in terms of what noise gives."""
    sizes = [np.array([np.full(4, chi2 / 4), np.full(4, 250.0)]) for chi2 in (before, after)]
    assert _gap_of(*sizes, floor).likelier == pytest.approx(likelier)


def test_several_pieces_must_close_some_of_the_gap():
    """Where it may be that they close nothing they are no answer; one piece may be."""
    proof = Proof(gap_closed=0.3, low=-0.1, high=0.8, before=1.1, after=1.07, floor=1.0, held_out="'held_out'")
    assert carries_over(proof)
    assert not carries_over(proof, pieces=2)
    assert carries_over(replace(proof, gap_closed=0.9, low=0.6, high=1.0), pieces=2)
    assert carries_over(replace(proof, gap_closed=np.nan, low=np.nan, high=np.nan), pieces=2)


@pytest.mark.parametrize(
    ("before", "after", "floor", "share"),
    [
        (4000.0, 1000.0, 1.0, 0.0),  # at the noise
        (4000.0, 2000.0, 1.0, (2000 - 1000 - 2 * np.sqrt(2000)) / 3000),  # a third is left, less what may be chance
        (4000.0, 1300.0, 1.25, 0.0),  # noise may be understated by a quarter
        (1000.0, 1900.0, 1.0, 1.0),  # nothing differed, now it does
        (1000.0, 1010.0, 1.0, np.nan),  # nothing differs
    ],
)
def test_the_share_that_is_left_sets_chance_aside(before, after, floor, share):
    """Chi-squared of 1000 degrees in four windows; chance is two standard deviations, sqrt(2 n)."""
    sizes = [np.array([np.full(4, chi2 / 4), np.full(4, 250.0)]) for chi2 in (before, after)]
    assert _left(*sizes, floor) == pytest.approx(share, nan_ok=True)


def test_what_an_answer_does_not_change_does_not_speak_against_it():
    """A scale of one sensor predicts that sensor. Wheels that slip at other moments, in channels of their own, are none of its business;
    where it acts it is judged as ever.
    """
    proof = Proof(gap_closed=0.2, low=0.1, high=0.5, before=1.25, after=1.2, floor=1.0, held_out="'held_out'", left=0.7)
    right = Gap(gap_closed=1.0, low=0.9, high=1.0, before=1.5, after=1.0, left=0.0)
    assert not carries_over(proof)
    assert carries_over(replace(proof, touched=right))
    assert none_by(replace(proof, touched=right)) < 0.5 < none_by(proof)
    assert not carries_over(replace(right_everywhere(right), touched=replace(right, gap_closed=0.2, high=0.5, after=1.4, left=0.8)))


def right_everywhere(gap):
    return Proof(
        gap_closed=gap.gap_closed, low=gap.low, high=gap.high, before=gap.before, after=gap.after, left=gap.left, floor=1.0, held_out="h"
    )


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ([3.0, 0.0, 0.0], [True, False, False]),
        ([3.0, 0.05, 0.5], [True, False, True]),  # a twentieth of the noise is no touch: its square is below a hundredth
        ([0.0, 0.0, 0.0], [True, True, True]),  # it does not act there: nothing is set apart
    ],
)
def test_which_channels_an_answer_touches(change, expected):
    """Three channels of 40 samples in two windows, residuals shifted by so many sigmas; no starts."""
    channel = np.repeat([0, 1, 2, 0, 1, 2], 20)
    residuals = np.random.default_rng(3).standard_normal(120)
    evidence = SimpleNamespace(
        channel=channel,
        channels=("a", "b", "c"),
        window=np.repeat([0, 1], 60),
        start_gain=np.empty((120, 0)),
        residuals=lambda settings: np.stack([residuals + (np.array(change)[channel] if setting else 0.0) for setting in settings]),
    )
    assert _touched(evidence, ("a term",)).tolist() == expected
