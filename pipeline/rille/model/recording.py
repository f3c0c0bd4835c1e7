"""What was really measured: channels over time (or steady points of a bench), with clocks, noise and roles. SI and radians."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model.errors import InputRefused, nearest_names
from rille.model.severity import Severity

Array = NDArray[np.float64]
Role = Literal["observed", "command", "ignore"]
Frame = Literal["world", "body"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """One word of the controlled vocabulary.

    units : SI units that its values may have; the second is of prismatic joints. target : what it is measured of. components : which
    numbers it has; empty for a scalar.
    """

    name: str
    units: tuple[str, ...]
    target: Literal["joint", "part", "wheel", "drive"]
    components: tuple[str, ...] = ()


AXES = ("x", "y", "z")
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity(name="joint.position", units=("rad", "m"), target="joint"),
        Quantity(name="joint.velocity", units=("rad/s", "m/s"), target="joint"),
        Quantity(name="joint.effort", units=("N m", "N"), target="joint"),
        Quantity(name="part.position", units=("m",), target="part", components=AXES),
        Quantity(name="part.orientation", units=("1", "rad"), target="part", components=("w", *AXES, "roll", "pitch", "yaw")),
        Quantity(name="part.linear_velocity", units=("m/s",), target="part", components=AXES),
        Quantity(name="part.angular_velocity", units=("rad/s",), target="part", components=AXES),
        Quantity(name="part.linear_acceleration", units=("m/s^2",), target="part", components=AXES),
        Quantity(name="wheel.sinkage", units=("m",), target="wheel"),
        Quantity(name="wheel.drawbar_pull", units=("N",), target="wheel"),
        Quantity(name="wheel.normal_load", units=("N",), target="wheel"),
        Quantity(name="wheel.side_force", units=("N",), target="wheel"),
        Quantity(name="wheel.drive_torque", units=("N m",), target="wheel"),
        Quantity(name="wheel.slip_ratio", units=("1",), target="wheel"),
        Quantity(name="wheel.slip_angle", units=("rad",), target="wheel"),
        Quantity(name="motor.current", units=("A",), target="drive"),
        Quantity(name="motor.voltage", units=("V",), target="drive"),
    )
}
# What is a state at an instant; all other quantities are made by a step, and are its means.
MOTION_QUANTITIES = (
    "joint.position",
    "joint.velocity",
    "part.position",
    "part.orientation",
    "part.linear_velocity",
    "part.angular_velocity",
)
ANGLES = ("roll", "pitch", "yaw")  # [rad] intrinsic z-y-x angles of an orientation (REP-103): R = Rz(yaw) Ry(pitch) Rx(roll)


def find_quantity(name: str, what: str) -> Quantity:
    """The word of the vocabulary.

    Raises
    ------
    InputRefused : if there is none of that name; ``what`` begins the sentence ("channel 'v1'").
    """
    if name not in QUANTITIES:
        raise InputRefused(f"{what} has the quantity '{name}', which is none known here; {nearest_names(name, QUANTITIES)}")
    return QUANTITIES[name]


def unit_of(quantity: Quantity, component: str) -> str:
    """SI unit of a component: angles of an orientation are in rad, the rest has the quantity's first unit."""
    return "rad" if component in ANGLES else quantity.units[0]


def full_name(quantity: str, component: str, target: str) -> str:
    """Quantity, component and target in one word: "part.position.x of chassis"."""
    return f"{quantity}{'.' + component if component else ''} of {target}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One column of a recording.

    name : of the column in the source, unique in the recording. quantity, component, target : what was measured, as in ``QUANTITIES``.
    unit : SI unit of ``value``. clock : name of the clock that stamped it; channels of one clock share ``time``.
    noise : 1 sigma [unit], None: not known. slow_noise : of that part of it that varies slowly (coloured), None: none known.
    resolution : step of quantised values [unit]. delay : [s], observed: the value stamped t is that of t - delay; command: what is
    stamped t acts at t + delay.
    time : (n,) [s]. value : (n,) [unit], NaN where missing.
    """

    name: str
    quantity: str
    target: str
    unit: str
    component: str = ""
    role: Role = "observed"
    frame: Frame = "world"
    clock: str = "time"
    noise: float | None = None
    slow_noise: float | None = None
    delay: float = 0.0
    resolution: float | None = None
    time: Array = field(default_factory=lambda: np.empty(0))
    value: Array = field(default_factory=lambda: np.empty(0))

    @property
    def of(self) -> str:
        """What was measured of what, as ``full_name`` says it."""
        return full_name(self.quantity, self.component, self.target)


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """A step by which import changed what was recorded: ``kind``, the channel or clock ('' = all), its numbers and why."""

    kind: str
    channel: str = ""
    detail: Mapping[str, object] = field(default_factory=dict)
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class GateFinding:
    """Something that the data gate found. code : kind, "stuck". detail : value, bound, intervals, other channel; plain JSON values.

    message : one sentence with the numbers and what to do next.
    """

    code: str
    severity: Severity
    channel: str = ""
    detail: Mapping[str, object] = field(default_factory=dict)
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """One recording.

    kind : ``time``, or ``points``: steady points of a wheel bench; ``time`` of the channels is then the number of the point.
    scenario : name in the database, None: not stated. source, digest : file and its SHA-256. manifest : TOML text.
    setup : of points: ``wheel`` {radius, width, grouser_count, grouser_height}, ``soil`` (name), ``law``, ``gravity``.
    """

    name: str
    kind: Literal["time", "points"] = "time"
    scenario: str | None = None
    source: str = ""
    digest: str = ""
    manifest: str = ""
    setup: Mapping[str, object] = field(default_factory=dict)
    channels: tuple[Channel, ...] = ()
    corrections: tuple[Correction, ...] = ()
    findings: tuple[GateFinding, ...] = ()

    def channel(self, name: str) -> Channel:
        """The channel of that name.

        Raises
        ------
        InputRefused : if there is none.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InputRefused(f"recording '{self.name}' has no channel '{name}'; {nearest_names(name, [c.name for c in self.channels])}")

    def with_role(self, role: Role) -> tuple[Channel, ...]:
        """Channels of one role, in their order."""
        return tuple(channel for channel in self.channels if channel.role == role)

    def flagged(self, *codes: str) -> frozenset[str]:
        """Names of channels that a finding with one of these codes speaks of."""
        return frozenset(finding.channel for finding in self.findings if finding.code in codes)
