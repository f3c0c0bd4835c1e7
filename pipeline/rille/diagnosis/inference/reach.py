"""What could explain a difference at all. A fault of sensors, no more than what is gone if their channels are left out.

A fault changes nothing but what its channels say (and, within what their samples leave open, the start). So it cannot take away more of
chi-squared = r^T (I + D D^T)^-1 r than leaving out these samples does, and the noise in them stays. With r_o, D_o of the others that leaves
|r_o|^2 - g^T (I + D_o^T D_o)^-1 g, g = D_o^T r_o (Woodbury 1950): no replay is needed.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rille.diagnosis.evidence.evidence import Array, Whole
from rille.diagnosis.hypotheses.sensor_hypotheses import channels_of
from rille.diagnosis.inference.accept import noise_of
from rille.diagnosis.inference.judge import Judge
from rille.model.hypothesis import Hypothesis
from rille.model.recording import Channel

SHARE = 0.05  # of the excess, at least: what takes less away is looked for on top of what takes more
CHANCE = 3.0  # standard deviations of chi-squared by which noise may have less than its expected share


def within_reach(judge: Judge, hypotheses: Sequence[Hypothesis], least: float) -> list[Hypothesis]:
    """Hypotheses without the faults of sensors that cannot take ``least`` of chi-squared away, or ``SHARE`` of the excess."""
    least = max(least, SHARE * judge.excess)
    about = [channels_of(h, judge.evidence.channels) if h.cause == "sensor" else None for h in hypotheses]
    several = sorted({names for names in about if names is not None})
    most = dict(zip(several, most_explained(judge, several), strict=True))
    return [h for h, names in zip(hypotheses, about, strict=True) if names is None or most[names] >= least]


def may_show(hypothesis: Hypothesis, channels: Sequence[Channel], loud: Whole) -> bool:
    """Whether the channels of what a hypothesis acts on are among those that differ; or there are none. What acts on a joint moves that
    joint most.
    """
    own = [k for k, channel in enumerate(channels) if hypothesis.target in ("*", channel.target)]
    return bool(np.isin(own, loud).any()) if own else bool(len(loud))


def most_explained(judge: Judge, several: Sequence[Sequence[str]]) -> Array:
    """(k,) chi-squared beyond noise that is gone if the samples of each of several sets of channels, by name, are left out."""
    evidence = judge.evidence
    if not several:
        return np.empty(0)
    about = np.array([[channel.name in names for channel in evidence.channels] for names in several], dtype=bool)
    gone = np.zeros(len(several))
    chi2 = judge.per_window(judge.base**2)
    for window, (first, last) in enumerate(pairwise(judge.metric.edges.tolist())):
        gain, left = evidence.start_gain[first:last], judge.raw[first:last]
        own, pull = gain.T @ gain + np.eye(gain.shape[1]), gain.T @ left
        for k, rows in enumerate(about[:, evidence.channel[first:last]]):
            if rows.any():
                part, rest = gain[rows], pull - gain[rows].T @ left[rows]
                gone[k] += chi2[window] - left[~rows] @ left[~rows] + rest @ np.linalg.solve(own - part.T @ part, rest)
    degrees = about @ judge.per_channel(judge.metric.own_degrees)
    noise = noise_of(judge, judge.chi2, judge.degrees)
    return np.asarray(gone - noise * (degrees - CHANCE * np.sqrt(2.0 * degrees)), dtype=float)
