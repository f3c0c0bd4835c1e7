"""Turns that do not jump: q and -q are one orientation, and recorders change between them; encoders begin anew after a full turn."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rille.model.recording import Channel
from rille.model.turns import unwrapped


def with_steady_turns(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """The channels; angles of joints count full turns, and where all four components of an orientation share their instants, each sample
    has the sign that is nearer to the last.
    """
    result = [replace(c, value=unwrapped(c.value)) if c.quantity == "joint.position" and c.unit == "rad" else c for c in channels]
    for target in {c.target for c in channels if c.quantity == "part.orientation"}:
        places = {c.component: k for k, c in enumerate(channels) if c.quantity == "part.orientation" and c.target == target}
        if not all(k in places for k in "wxyz"):
            continue
        four = [channels[places[k]] for k in "wxyz"]
        if any(len(c.time) != len(four[0].time) or not np.array_equal(c.time, four[0].time) for c in four):
            continue
        value = np.stack([c.value for c in four], axis=1)
        whole = np.flatnonzero(np.isfinite(value).all(axis=1))
        along = (value[whole[1:]] * value[whole[:-1]]).sum(axis=1)
        sign = np.ones(len(value))
        sign[whole[1:]] = np.cumprod(np.where(along < 0, -1.0, 1.0))
        for k, channel in zip("wxyz", four, strict=True):
            result[places[k]] = replace(channel, value=channel.value * sign)
    return tuple(result)
