"""The step of a quantised channel, found from its values."""

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding

Array = NDArray[np.float64]
SAMPLES = 20_000


def resolution_of(value: Array) -> float | None:
    """Smallest step of which all differences are multiples; None: values are continuous, as far as double or single precision tells.

    Values (n,) are taken in pieces of neighbours, which see small steps. The smallest step is refined by the widest range, and accepted if
    all values lie on its lattice within 2 % of it.
    """
    finite = value[np.isfinite(value)]
    if len(finite) > SAMPLES:
        starts = np.linspace(0, len(finite) - 500, SAMPLES // 500).astype(int)
        finite = np.concatenate([finite[start : start + 500] for start in starts])
    levels = np.unique(finite)
    if len(levels) < 3 or len(levels) > 0.5 * len(finite):
        return None
    floor = 4e-6 * float(np.abs(levels).max())
    gaps = np.diff(levels)
    gaps = gaps[gaps > max(floor, 1e-3 * float(np.median(gaps)))]
    if not len(gaps):
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    for reach in (10, 100, 1000, 10_000, np.inf):
        near = levels[levels - levels[0] <= reach * step] - levels[0]
        whole = np.round(near / step)
        if whole @ whole > 0:
            step = float(whole @ near / (whole @ whole))
    off = (levels - levels[0]) / step
    return step if float(np.quantile(np.abs(off - np.round(off)), 0.98)) < 0.05 else None


def check_quantisation(channel: Channel) -> tuple[float | None, list[GateFinding]]:
    """The resolution, and a note where it matters and is not stated."""
    step = resolution_of(channel.value)
    if step is None:
        return None, []
    detail: dict[str, object] = {"resolution": step}
    stated = channel.resolution
    if stated is not None and 0.5 < stated / step < 2:
        return step, []
    against = "" if stated is None else f", where {stated:.4g} {channel.unit} is stated"
    message = f"channel '{channel.name}' is quantised in steps of {step:.6g} {channel.unit}{against}"
    return step, [GateFinding(code="quantised", severity="note", channel=channel.name, detail=detail, message=message)]
