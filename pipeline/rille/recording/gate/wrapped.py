"""Angles of joints that jump by a full turn where an encoder begins anew."""

import numpy as np

from rille.model.recording import Channel, GateFinding
from rille.model.turns import unwrapped


def check_wrapped(channel: Channel) -> list[GateFinding]:
    """A note on an observed angle of a joint that wraps: it is compared without these jumps."""
    if channel.role != "observed" or channel.quantity != "joint.position" or channel.unit != "rad":
        return []
    good = np.isfinite(channel.value)
    value = channel.value[good]
    turns = unwrapped(value) - value
    jumps = np.flatnonzero(np.abs(np.diff(turns)) > np.pi)
    if not len(jumps):
        return []
    first = float(channel.time[good][jumps[0] + 1])
    message = (
        f"channel '{channel.name}' jumps by a full turn {len(jumps)} time{'s' if len(jumps) > 1 else ''}, first at {first:.6g} s, as an "
        "encoder does that counts to +-pi; it is compared without these jumps"
    )
    return [
        GateFinding(code="wrapped", severity="note", channel=channel.name, detail={"count": len(jumps), "first": first}, message=message)
    ]
