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
STATED = "as stated"
WHOSE = {"body": "the body", "world": "the world"}  # axes, by their frame
# What the numbers said to be w, x, y, z may be instead: which of them are the true w, x, y, z, and with which sign.
READINGS: dict[str, tuple[tuple[int, ...], tuple[float, ...]]] = {
    STATED: ((0, 1, 2, 3), (1.0, 1.0, 1.0, 1.0)),
    "inverse": ((0, 1, 2, 3), (1.0, -1.0, -1.0, -1.0)),
    "x, y, z, w": ((3, 0, 1, 2), (1.0, 1.0, 1.0, 1.0)),
    "w, x, y, z": ((1, 2, 3, 0), (1.0, 1.0, 1.0, 1.0)),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Turning:
    """The angle about one axis, of the body or of W, as counted on from sample to sample of an orientation.

    parts : names of its channels, w, x, y, z or roll, pitch, yaw, on one clock. axis : x, y or z. frame : of that axis.
    reading : what a quaternion's numbers are taken for, of ``READINGS``.
    """

    parts: tuple[str, ...]
    axis: str
    frame: Frame
    reading: str = STATED

    @property
    def of_quaternion(self) -> bool:
        """Whether a quaternion tells it, and not three angles."""
        return len(self.parts) == len(QUATERNION)

    @property
    def name(self) -> str:
        """Of the channel that it makes."""
        read = "" if self.reading == STATED else f" ({self.reading})"
        return f"turn of {', '.join(self.parts)}{read} about {self.axis}{' of the body' if self.frame == 'body' else ''}"

    def in_other_axes(self) -> "Turning":
        """About the axis of that letter of W if this is of the body, and the other way round."""
        return replace(self, frame="world" if self.frame == "body" else "body")

    def ways(self) -> "tuple[Turning, ...]":
        """Itself first, and about the axis of that letter of the other frame, with all that its numbers may be taken for."""
        readings = READINGS if self.of_quaternion else (STATED,)
        return tuple(replace(way, reading=reading) for way in (self, self.in_other_axes()) for reading in readings)

    def about(self, axis: str) -> "Turning":
        """The same about another axis."""
        return replace(self, axis=axis)

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
        """Times (n,) [s] and angles (n, 3) [rad] about all axes of its frame where the orientation is known, from its parts (m, 4) or
        (m, 3) at times (m,).

        phi_k+1 = phi_k + log(q_k* q_k+1) about axes of the body, log(q_k+1 q_k*) about those of W: exact up to the turning of the axis
        between two samples.
        """
        which, sign = READINGS[self.reading]
        quaternion = parts[:, which] * sign if self.of_quaternion else quaternions(parts)
        good = np.isfinite(time) & (np.linalg.norm(quaternion, axis=1) > SHORTEST)  # NaN is not larger
        if good.sum() < 2:
            return np.empty(0), np.empty((0, len(AXES)))
        q = unit(quaternion[good])
        before, after = q[:-1], q[1:]
        turned = product(conjugate(before), after) if self.frame == "body" else product(after, conjugate(before))
        return time[good], np.concatenate([np.zeros((1, len(AXES))), np.cumsum(logarithm(turned), axis=0)])


def turnings(channels: Sequence[Channel]) -> Iterable[tuple[Turning, Channel]]:
    """Each component of an angular velocity that was observed with the whole orientation of its body, as a turning and its rate."""
    for rate in channels:
        if rate.role != "observed" or rate.quantity != "part.angular_velocity" or rate.component not in AXES:
            continue
        for parts in orientations(channels, rate.target):
            yield Turning(parts=parts, axis=rate.component, frame=rate.frame), rate


def orientations(channels: Sequence[Channel], target: str) -> list[tuple[str, ...]]:
    """Names of the channels of each whole orientation of a body that was observed on one clock: w, x, y, z or roll, pitch, yaw."""
    own = [channel for channel in channels if channel.target == target]
    return [tuple(part.name for part in whole) for whole in wholes(own, "part.orientation", QUATERNION, ANGLES)]


def wholes(channels: Sequence[Channel], quantity: str, *components: tuple[str, ...]) -> list[tuple[Channel, ...]]:
    """Channels of a quantity that was observed with all of one of the sets of components, of one thing in one frame on one clock."""
    parts: dict[tuple[str, str, str], dict[str, Channel]] = {}
    for channel in channels:
        if (channel.role, channel.quantity) == ("observed", quantity):
            parts.setdefault((channel.target, channel.frame, channel.clock), {}).setdefault(channel.component, channel)
    return [tuple(known[part] for part in whole) for known in parts.values() for whole in components if known.keys() >= set(whole)]


def quaternions(parts: Array) -> Array:
    """(n, 4) w x y z of the parts (n, 4) or (n, 3) of an orientation."""
    return parts if parts.shape[1] == len(QUATERNION) else from_angles(parts)
