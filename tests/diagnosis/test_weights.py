"""Probabilities from scores: they add up, ties are even, errors count, and calibration finds the temperature that trials were made with."""

import numpy as np

from rille.diagnosis.inference.folds import folds
from rille.diagnosis.inference.rank import standard_errors_that_count
from rille.diagnosis.inference.weights import Calibration, Trial, calibrated, evidence_against, probabilities

FIRM = Calibration(temperature=1.0, none_offset=1.5, none_slope=3.0)


def test_probabilities_add_up_and_ties_are_even():
    each, none = probabilities(np.array([0.0, 0.0, 50.0]), np.array([0.0, 0.0, 5.0]), 0.05, FIRM)
    assert np.isclose(each.sum() + none, 1.0)
    assert np.isclose(each[0], each[1])
    assert each[2] < 1e-9


def test_what_is_left_speaks_for_none():
    assert [round(probabilities(np.zeros(1), np.zeros(1), left, FIRM)[1], 2) for left in (0.0, 0.3, 1.0)] == [0.0, 0.48, 0.82]
    assert probabilities(np.empty(0), np.empty(0), 0.0, FIRM)[1] == 1.0


def test_a_lead_with_a_large_error_says_little():
    """100 nats with an error of 100 are one standard error: half a nat."""
    assert np.allclose(evidence_against(np.array([100.0, 100.0, 1e-6]), np.array([100.0, 1.0, 1e-9])), [0.5, 100.0, 1e-6])


def test_calibration_finds_how_firm_scores_are():
    """Truth drawn with the odds of temperature 3 among two hypotheses: found within 40 % from 400 trials."""
    rng = np.random.default_rng(3)
    trials = []
    for _ in range(400):
        behind = np.array([0.0, rng.uniform(0, 10)])
        right = rng.uniform() < 1 / (1 + np.exp(-behind[1] / 3.0))
        trials.append(Trial(behind=behind, behind_error=np.array([0.0, 1e-3]), truth=0 if right else 1, leftover=0.0))
    assert np.isclose(calibrated(trials, "drawn").temperature, 3.0, rtol=0.4)


def test_folds_take_recordings_whole_or_neighbours_together():
    assert folds(np.repeat(np.arange(5), 3)).tolist() == np.repeat(np.arange(5), 3).tolist()
    alone = folds(np.zeros(32, dtype=np.int64))
    assert np.all(alone[::2] == alone[1::2])
    assert np.bincount(alone).tolist() == [4] * 8
    assert folds(np.empty(0, dtype=np.int64)).size == 0


def test_few_windows_need_more_standard_errors():
    assert np.isclose(standard_errors_that_count(10_000), 2.0, atol=1e-3)
    assert 3.0 < standard_errors_that_count(4) < 3.5
