"""What noise alone leaves."""

from collections.abc import Mapping

import numpy as np

from rille.diagnosis.evidence.replay_evidence import ReplayEvidence

UNSTATED = 0.25  # share of its variance by which noise is understated if it is taken from how neighbouring samples jump


def chi2_floor(evidence: ReplayEvidence, noise: Mapping[str, tuple[float, str]]) -> float:
    """Chi-squared per degree that noise alone may give: more where it is not stated and its slow part is unknown."""
    unstated = [noise[channel.name][1] != "stated" for channel in evidence.channels]
    return 1.0 + UNSTATED * float(np.mean(np.array(unstated)[evidence.channel])) if len(evidence.channel) else 1.0
