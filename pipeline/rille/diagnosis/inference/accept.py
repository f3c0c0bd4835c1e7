"""When a piece is added to the answer, and when the difference is gone."""

import numpy as np

from rille.diagnosis.evidence.evidence import Array, Whole
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.rank import Scores

NATS = 3.0  # log-likelihood beyond the price of having tried many
LEAST_SHARE = 0.02  # of the degrees of freedom: chi-squared that a piece must take away,
LEAST_IN_WINDOW = 0.5  # or that of a window's degrees, in one window at least
LEAST_IN_CHANNEL = 0.25  # of a channel's degrees: its noise may be stated wrong by a tenth
LEAST_EXCESS = 0.015  # of all the excess: smaller drops may be curvature of what was found before
LEAST_OF_REST = 0.2  # of the excess that is left without the piece: many small pieces are an expansion of something else
NO_TRIFLE, LEAST_OF_IT = 0.25, 0.3  # excess per degree at which what is left is no trifle, whatever was found; share of it, then
SIGNIFICANT = 4.0  # standard deviations of chi-squared


def is_accepted(scores: Scores, new: int, old: int, judge: Judge, *, tries: int, excess: float) -> bool:
    """Whether ``new`` says more than ``old``: more than its errors, than the price of ``tries`` hypotheses, and more than a trifle.

    excess : chi-squared beyond noise of the base model.
    """
    drop = scores.chi2[old] - scores.chi2[new]
    in_window = scores.window_chi2[old] - scores.window_chi2[new]
    felt = drop > LEAST_SHARE * judge.degrees or bool(
        np.any(in_window > np.maximum(LEAST_IN_WINDOW * judge.window_degrees, 25.0 * judge.floor))
    )
    rest = scores.chi2[old] - judge.floor * judge.degrees
    large = (rest > NO_TRIFLE * judge.degrees and drop > LEAST_OF_IT * rest) or drop > max(LEAST_EXCESS * excess, LEAST_OF_REST * rest)
    return felt and large and scores.clearly_ahead(new, old, np.log(max(tries, 1)) + NATS)


def is_trifle(judge: Judge, excess: float) -> bool:
    """Whether what the base of a judge leaves, as a whole or in the channels that differ, is little beside what there was, and little
    beside the noise. excess : as of ``is_accepted``.
    """
    loud = loud_channels(judge)
    rest = max(judge.excess, float(np.sum(_beyond(judge)[loud])))
    return rest <= LEAST_EXCESS * excess and judge.excess <= NO_TRIFLE * judge.degrees


def differs(judge: Judge) -> bool:
    """Whether the base of a judge differs from the data beyond its noise: as a whole, in some window, or in some channel."""
    degrees = judge.window_degrees
    beyond = judge.per_window(judge.base**2) - judge.floor * degrees
    allowed = judge.floor * SIGNIFICANT * np.sqrt(2.0 * np.maximum(degrees, 1.0)) + 2.0 * LEAST_SHARE * degrees
    whole = judge.excess > max(judge.floor * SIGNIFICANT * np.sqrt(2.0 * judge.degrees), LEAST_SHARE * judge.degrees)
    return bool(whole or np.any(beyond > np.maximum(allowed, LEAST_IN_WINDOW * degrees)) or len(loud_channels(judge)))


def loud_channels(judge: Judge) -> Whole:
    """Numbers of the channels in which the base of a judge differs from the data beyond the noise."""
    degrees = np.maximum(judge.per_channel(judge.metric.own_degrees), 1.0)
    return np.flatnonzero(_beyond(judge) > np.maximum(judge.floor * SIGNIFICANT * np.sqrt(2.0 * degrees), LEAST_IN_CHANNEL * degrees))


def noise_of(judge: Judge, chi2: float, degrees: float) -> float:
    """Chi-squared per degree of noise: the floor, or less where a setting shows by its chi2 and degrees that noise is overstated."""
    return min(judge.floor, chi2 / max(degrees, 1.0))


def _beyond(judge: Judge) -> Array:
    """(channels,) chi-squared beyond what noise gives."""
    return judge.per_channel(judge.base**2) - judge.floor * np.maximum(judge.per_channel(judge.metric.own_degrees), 1.0)
