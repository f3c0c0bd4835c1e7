"""What counts beside a strong effect: little as a whole, but not in a channel in which that one hardly shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from rille.diagnosis.inference.accept import is_accepted, is_trifle

SAMPLES = 1000  # of each channel
CHANNEL = np.repeat(np.arange(2), SAMPLES)
STRONG = (3e6, 8e3)  # chi-squared beyond noise of the base model: of the joint with the strong effect, and of its neighbour


def judge(*beyond):
    """A judge whose channels have so much chi-squared beyond their noise, in ten windows."""
    base = np.sqrt(1.0 + np.asarray(beyond)[CHANNEL] / SAMPLES)
    return SimpleNamespace(
        base=base,
        chi2=float(base @ base),
        floor=1.0,
        degrees=2.0 * SAMPLES,
        excess=float(sum(beyond)),
        window_degrees=np.full(10, 0.2 * SAMPLES),
        per_channel=lambda values: np.bincount(CHANNEL, values, 2),
        per_window=lambda values: values.reshape(10, -1).sum(axis=1),
        metric=SimpleNamespace(own_degrees=np.ones(2 * SAMPLES)),
    )


def scores(old, new):
    """Of the base (0) and of what is judged (1), which predicts clearly better; by chi-squared beyond noise of both channels."""
    channel = np.array([old, new], dtype=float) + SAMPLES
    whole = channel.sum(axis=1)
    return SimpleNamespace(
        chi2=whole,
        channel_chi2=channel,
        window_chi2=np.repeat(whole[:, None] / 10, 10, axis=1),
        clearly_ahead=lambda i, j, nats: True,
    )


@pytest.mark.parametrize(
    ("left", "new", "counts"),
    [
        ((0, 420), (0, 0), True),  # a twentieth of what the neighbour had: no inaccuracy of the strong effect is as large there
        ((0, 380), (0, 0), False),
        ((420, 0), (0, 0), False),  # at the strong effect's own joint: its law need only be wrong by a hundredth for that
        ((0, 480), (0, 380), False),  # an explanation of a part of it
    ],
)
def test_a_second_piece_counts_where_the_first_hardly_shows(left, new, counts):
    """All of them are a ten-thousandth of the excess, and a fifth of the noise."""
    first, now = judge(*STRONG), judge(*left)
    assert is_accepted(scores(left, new), 1, 0, now, tries=100, first=first) == counts


@pytest.mark.parametrize(("left", "trifle"), [((0, 420), False), ((0, 380), True), ((420, 0), True)])
def test_what_is_left_there_is_no_trifle(left, trifle):
    assert is_trifle(judge(*left), judge(*STRONG)) == trifle
