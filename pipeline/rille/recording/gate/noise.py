"""White noise of a channel, from its samples, and whether it is what was stated."""

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding
from rille.model.scatter import beyond_stated, stated_noise

Array = NDArray[np.float64]


def white_noise(value: Array) -> float:
    """Standard deviation of white noise on a smooth signal (n,): 1.48 median |v[i-1] - 2 v[i] + v[i+1]| / sqrt(6); 0 below three values."""
    value = value[np.isfinite(value)]
    if len(value) < 3:
        return 0.0
    return float(1.4826 * np.median(np.abs(value[2:] - 2 * value[1:-1] + value[:-2])) / np.sqrt(6))


def check_noise(channel: Channel) -> list[GateFinding]:
    """A warning where the samples of an observed channel plainly scatter more than its stated noise and resolution say."""
    seen = beyond_stated(channel) if channel.role == "observed" else None
    if seen is None:
        return []
    stated = stated_noise(channel)
    message = (
        f"channel '{channel.name}' scatters by {seen:.3g} {channel.unit} from sample to sample, {seen / max(stated, 1e-300):.3g} times the "
        f"{stated:.3g} {channel.unit} that are stated as its noise; state what it is: comparisons take what is seen"
    )
    return [GateFinding(code="noise", severity="warning", channel=channel.name, detail={"seen": seen, "stated": stated}, message=message)]
