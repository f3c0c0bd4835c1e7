"""Envelopes: percentiles of a channel over the cases, instant by instant."""

import warnings

import numpy as np
from numpy.typing import NDArray

from rille.model.study import Bands, StudyPlan, TracedChannel

LEVELS = (5.0, 25.0, 50.0, 75.0, 95.0)


def bands(plan: StudyPlan, channel: TracedChannel, traces: NDArray[np.float64]) -> Bands:
    """Percentiles of traces (cases, times); a case counts as long as it lasted."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # instants that no case reached
        values = np.nanpercentile(traces, LEVELS, axis=0) if len(traces) else np.full((len(LEVELS), len(plan.trace_time)), np.nan)
    return Bands(channel=channel, time=np.array(plan.trace_time), levels=LEVELS, values=values, cases=len(traces))
