"""Values that no quantity of that kind has."""

import numpy as np

from rille.model.recording import Channel, GateFinding

FULL = {"roll": np.pi, "pitch": np.pi / 2}  # [rad] largest angles there are; yaw may be counted on over many turns
LARGEST = {  # beyond these a unit is wrong rather than the machine fast
    "joint.velocity": 5000.0,
    "part.linear_velocity": 3000.0,
    "part.angular_velocity": 1000.0,
    "wheel.slip_angle": 2 * np.pi,
    "wheel.sinkage": 10.0,
}


def check_range(channel: Channel) -> list[GateFinding]:
    """Slip ratios beyond 1, angles beyond a half turn, and speeds that nothing reaches: 99.5 % of the values must lie within."""
    size = np.abs(channel.value[np.isfinite(channel.value)])
    if not len(size):
        return []
    size = float(np.quantile(size if len(size) <= 200_000 else size[:: len(size) // 200_000 + 1], 0.995))
    if channel.quantity == "wheel.slip_ratio":
        return _refusal(channel, size, 1.0, "percent") if size > 1.5 else []
    if channel.component in FULL:
        bound = FULL[channel.component]
        return _refusal(channel, size, bound, "deg") if size > 1.05 * bound else []
    if channel.quantity == "part.orientation" and channel.component in ("w", "x", "y", "z"):
        return _refusal(channel, size, 1.0, "1") if size > 1.05 else []
    bound = LARGEST.get(channel.quantity)
    return _refusal(channel, size, bound, "") if bound is not None and size > bound else []


def _refusal(channel: Channel, size: float, bound: float, unit: str) -> list[GateFinding]:
    perhaps = f' (perhaps it is unit = "{unit}")' if unit not in ("", "1") else ""
    message = (
        f"channel '{channel.name}' reaches {size:.4g} {channel.unit}, but {channel.of} cannot exceed {bound:.4g}; "
        f'check its unit{perhaps}, or accept "range" for this channel'
    )
    detail = {"value": size, "bound": bound, "unit": unit}
    return [GateFinding(code="range", severity="error", channel=channel.name, detail=detail, message=message)]
