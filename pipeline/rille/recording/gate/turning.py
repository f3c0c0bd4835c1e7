"""What a recorded orientation says of turning: angles whose rates are the components of the angular velocity, whatever the tilt."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.model.quaternion import conjugate, from_angles, logarithm, product, unit
from rille.model.recording import ANGLES, AXES, Channel, Frame

Array = NDArray[np.float64]
QUATERNION = ("w", "x", "y", "z")
SHORTEST = 0.1  # length below which four numbers are no orientation


@dataclass(frozen=True, slots=True, kw_only=True)
class Turning:
    """The angle about one axis, of the body or of W, as counted on from sample to sample of an orientation.

    parts : names of its channels, w, x, y, z or roll, pitch, yaw, on one clock. axis : x, y or z. frame : of that axis.
    """

    parts: tuple[str, ...]
    axis: str
    frame: Frame

    @property
    def of_quaternion(self) -> bool:
        """Whether a quaternion tells it, and not three angles."""
        return len(self.parts) == len(QUATERNION)

    @property
    def name(self) -> str:
        """Of the channel that it makes."""
        return f"turn of {', '.join(self.parts)} about {self.axis}{' of the body' if self.frame == 'body' else ''}"

    def in_other_axes(self) -> "Turning":
        """About the axis of that letter of W if this is of the body, and the other way round."""
        return replace(self, frame="world" if self.frame == "body" else "body")

    def channel(self, head: Channel) -> Channel:
        """What it is. head : the first of its parts, with the times whose interval is asked for."""
        return Channel(
            name=self.name,
            quantity=head.quantity,
            component=self.axis,
            target=head.target,
            unit="rad",
            frame=self.frame,
            clock=head.clock,
            time=head.time,
        )

    def samples(self, time: Array, parts: Array) -> tuple[Array, Array]:
        """Times [s] and angles [rad] where the orientation is known, from its parts (n, 4) or (n, 3) at times (n,).

        phi_k+1 = phi_k + log(q_k* q_k+1) about axes of the body, log(q_k+1 q_k*) about those of W: exact up to the turning of the axis
        between two samples.
        """
        quaternion = parts if self.of_quaternion else from_angles(parts)
        good = np.isfinite(time) & (np.linalg.norm(quaternion, axis=1) > SHORTEST)  # NaN is not larger
        if good.sum() < 2:
            return np.empty(0), np.empty(0)
        q = unit(quaternion[good])
        before, after = q[:-1], q[1:]
        turned = product(conjugate(before), after) if self.frame == "body" else product(after, conjugate(before))
        return time[good], np.concatenate([[0.0], np.cumsum(logarithm(turned)[:, AXES.index(self.axis)])])


def turnings(channels: Sequence[Channel]) -> Iterable[tuple[Turning, Channel]]:
    """Each component of an angular velocity that was observed with the whole orientation of its body, as a turning and its rate."""
    observed = [channel for channel in channels if channel.role == "observed"]
    for rate in observed:
        if rate.quantity != "part.angular_velocity" or rate.component not in AXES:
            continue
        parts: dict[str, dict[str, Channel]] = {}
        for channel in observed:
            if (channel.quantity, channel.target) == ("part.orientation", rate.target):
                parts.setdefault(channel.clock, {}).setdefault(channel.component, channel)
        for known in parts.values():
            for whole in (QUATERNION, ANGLES):
                if known.keys() >= set(whole):
                    yield Turning(parts=tuple(known[part].name for part in whole), axis=rate.component, frame=rate.frame), rate
