"""When a piece is added to the answer, and when the difference is gone."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rille.diagnosis.evidence.evidence import Array, Whole
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.rank import Scores

NATS = 3.0  # log-likelihood beyond the price of having tried many
LEAST_SHARE = 0.02  # of the degrees of freedom: chi-squared that a piece must take away,
LEAST_IN_WINDOW = 0.5  # or that of a window's degrees, in one window at least
LEAST_IN_CHANNEL = 0.25  # of a channel's degrees: its noise may be stated wrong by a tenth
LEAST_EXCESS = 0.015  # of all the excess: smaller drops may be curvature of what was found before
LEAST_OF_REST = 0.2  # of the excess that is left without the piece: many small pieces are an expansion of something else
LEAST_OF_CHANNEL = 0.05  # of a channel's excess: what is little beside a strong effect is none where that one hardly shows
NO_TRIFLE, LEAST_OF_IT = 0.25, 0.3  # excess per degree at which what is left is no trifle, whatever was found; share of it, then
SIGNIFICANT = 4.0  # standard deviations of chi-squared
LOUD_IN_WINDOW, NEVER = 2.0, 1e-9  # of the noise's chi-squared in one window of one channel, that is loud; chance of that, at most
LEAST_SAMPLES = 8  # degrees of freedom of a channel in a window, fewer of which say nothing on their own


def is_accepted(scores: Scores, new: int, old: int, judge: Judge, *, tries: int, first: Judge) -> bool:
    """Whether ``new`` says more than ``old``: more than its errors, than the price of ``tries`` hypotheses, and more than a trifle.

    first : of the base model.
    """
    drop = scores.chi2[old] - scores.chi2[new]
    in_window = scores.window_chi2[old] - scores.window_chi2[new]
    felt = drop > LEAST_SHARE * judge.degrees or bool(
        np.any(in_window > np.maximum(LEAST_IN_WINDOW * judge.window_degrees, 25.0 * judge.floor))
    )
    rest = scores.chi2[old] - judge.floor * judge.degrees
    large = (
        (rest > NO_TRIFLE * judge.degrees and drop > LEAST_OF_IT * rest)
        or drop > max(LEAST_EXCESS * first.excess, LEAST_OF_REST * rest)
        or _is_large_in_a_channel(scores.channel_chi2[old], scores.channel_chi2[new], judge, first)
    )
    return felt and large and scores.clearly_ahead(new, old, np.log(max(tries, 1)) + NATS)


def is_trifle(judge: Judge, first: Judge) -> bool:
    """Whether what the base of a judge leaves, as a whole or in the channels that differ, is little beside what there was, in each of these
    channels, too, and little beside the noise. first : of the base model.
    """
    beyond = _beyond(judge)
    loud = _is_loud(beyond, judge)
    rest = max(judge.excess, float(np.sum(beyond[loud])))
    beside = bool(np.any(beyond[loud] > LEAST_OF_CHANNEL * _beyond(first)[loud]))
    return rest <= LEAST_EXCESS * first.excess and judge.excess <= NO_TRIFLE * judge.degrees and not beside


def differs(judge: Judge) -> bool:
    """Whether the base of a judge differs from the data beyond its noise: as a whole, in some window, or in some channel."""
    degrees = judge.window_degrees
    beyond = judge.window_excess
    allowed = judge.floor * SIGNIFICANT * np.sqrt(2.0 * np.maximum(degrees, 1.0)) + 2.0 * LEAST_SHARE * degrees
    whole = judge.excess > max(judge.floor * SIGNIFICANT * np.sqrt(2.0 * judge.degrees), LEAST_SHARE * judge.degrees)
    return bool(whole or np.any(beyond > np.maximum(allowed, LEAST_IN_WINDOW * degrees)) or len(loud_channels(judge)))


def loud_channels(judge: Judge) -> Whole:
    """Numbers of the channels in which the base of a judge differs from the data beyond the noise: as a whole, or in one window, be it the
    only one in which a wheel starts from rest.
    """
    return np.flatnonzero(_is_loud(_beyond(judge), judge) | _is_loud_in_a_window(judge))


def _is_large_in_a_channel(old: Array, new: Array, judge: Judge, first: Judge) -> bool:
    """Whether a channel that differs comes far nearer to its noise. old, new (channels,) : chi-squared."""
    rest = old - judge.floor * _degrees(judge)
    return bool(np.any(_is_loud(rest, judge) & (old - new > np.maximum(LEAST_OF_CHANNEL * _beyond(first), LEAST_OF_IT * rest))))


def noise_of(judge: Judge, chi2: float, degrees: float) -> float:
    """Chi-squared per degree of noise: the floor, or less where a setting shows by its chi2 and degrees that noise is overstated."""
    return min(judge.floor, chi2 / max(degrees, 1.0))


def _is_loud(beyond: Array, judge: Judge) -> NDArray[np.bool_]:
    """(channels,) where so much chi-squared beyond noise is a difference. beyond (channels,)."""
    degrees = _degrees(judge)
    return beyond > np.maximum(judge.floor * SIGNIFICANT * np.sqrt(2.0 * degrees), LEAST_IN_CHANNEL * degrees)


def _is_loud_in_a_window(judge: Judge) -> NDArray[np.bool_]:
    """(channels,) where noise alone would not give the chi-squared of some window, and that is far more than noise gives."""
    count, windows = len(judge.evidence.channels), judge.metric.n_windows
    cell = np.repeat(np.arange(windows), np.diff(judge.metric.edges)) * count + judge.evidence.channel
    found, degrees = (
        np.bincount(cell, values, windows * count).reshape(windows, count) for values in (judge.base**2, judge.metric.own_degrees)
    )
    heard = (degrees >= LEAST_SAMPLES) & (found > LOUD_IN_WINDOW * judge.floor * degrees)
    return np.asarray(np.any(heard & (chi2.sf(found / judge.floor, np.maximum(degrees, 1.0)) < NEVER), axis=0), dtype=bool)


def _beyond(judge: Judge) -> Array:
    """(channels,) chi-squared beyond what noise gives."""
    return judge.per_channel(judge.base**2) - judge.floor * _degrees(judge)


def _degrees(judge: Judge) -> Array:
    """(channels,) degrees of freedom, at least 1."""
    return np.maximum(judge.per_channel(judge.metric.own_degrees), 1.0)
