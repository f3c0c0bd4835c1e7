"""Faults of sensors that could not explain a difference are not tried, those that could are."""

import numpy as np

from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.reach import may_show, most_explained, within_reach
from toy_evidence import NAMES, catalogue, named, recorded

LEAST = 20.0


def test_what_is_gone_without_a_channel_is_chi_squared_of_the_others():
    """Against chi-squared of the evidence without these samples, taken straight from its metric: to rounding, but for the noise's share,
    which is that of as many samples.
    """
    evidence = recorded((named("bias", "left position", offset=0.006),), seconds=10)
    judge = Judge(evidence)
    (found,) = most_explained(judge, [("left position",)])
    others = np.flatnonzero(evidence.channel != NAMES.index("left position"))
    metric = Metric(evidence.window[others], evidence.start_gain[others])
    left = metric.whitened(evidence.residuals([()])[:, others])[0]
    degrees = float(np.sum(judge.metric.own_degrees[evidence.channel == NAMES.index("left position")]))
    chance = judge.chi2 - left @ left - found
    assert abs(chance - (degrees - 3.0 * np.sqrt(2.0 * degrees))) < 1e-6 * judge.chi2


def test_the_sensor_that_lies_is_tried_and_those_that_agree_are_not():
    """A gain of one speed: that sensor takes all away, the position that contradicts it most, those of the other cart hardly anything."""
    judge = Judge(recorded((named("scale", "left speed", relative_error=0.3),), seconds=20))
    kept = within_reach(judge, catalogue(), LEAST)
    assert {h.target for h in kept if h.cause == "sensor"} == {"left position", "left speed"}
    assert [h for h in kept if h.cause != "sensor"] == [h for h in catalogue() if h.cause != "sensor"]
    assert most_explained(judge, [("left speed",)])[0] > 0.99 * judge.excess


def test_no_sensor_takes_away_what_physics_does_to_all():
    """A friction of the left cart shows in its position and speed: leaving one of them out leaves most of it."""
    judge = Judge(recorded((named("coulomb", "left", force=0.4),), seconds=20))
    gone = most_explained(judge, [(name,) for name in NAMES])
    assert gone.max() < judge.excess
    assert gone[NAMES.index("right speed")] < 0.1 * judge.excess


def test_what_acts_where_nothing_differs_is_not_looked_at_closely():
    evidence = recorded((named("coulomb", "left", force=0.4),), seconds=5)
    by_title = {h.title: h for h in catalogue()}
    channels = evidence.channels
    loud = np.array([k for k, c in enumerate(channels) if c.target == "left"])
    assert len(loud) == 2
    assert may_show(by_title["coulomb of left"], channels, loud)
    assert may_show(by_title["coulomb of all"], channels, loud)
    assert not may_show(by_title["coulomb of right"], channels, loud)
    assert not may_show(by_title["coulomb of right"], channels, np.array([], dtype=int))
