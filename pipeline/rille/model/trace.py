"""A run's results as arrays, one row per stored time. Column names and units are those of ``schema/schema.sql``."""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyTrace:
    """position (n, 3) [m], rotation (n, 4) quaternion w x y z, velocity (n, 3) [m/s], angular_velocity (n, 3) [rad/s]."""

    name: str
    position: Array
    rotation: Array
    velocity: Array
    angular_velocity: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTrace:
    """position, velocity, effort, work, each (n,) [rad or m, per second, N m or N, J]."""

    name: str
    position: Array
    velocity: Array
    effort: Array
    work: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelTrace:
    """center (n, 3) [m]; the rest (n,): see table ``wheel_state`` for meaning and units."""

    name: str
    center: Array
    ground_height: Array
    slip_ratio: Array
    slip_angle: Array
    sinkage: Array
    normal_load: Array
    drawbar_pull: Array
    side_force: Array
    drive_torque: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened: ``time`` [s], ``kind``, ``subject`` (name) and a sentence."""

    time: float
    kind: str
    subject: str
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyTrace:
    """Energies since t = 0, each (n,) [J]: see table ``energy_state``."""

    kinetic: Array
    potential: Array
    drive_work: Array
    soil_loss: Array
    joint_loss: Array
    contact_loss: Array
    external_work: Array
    residual: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Ruts:
    """What wheels left in the soil. sinkage : (n_rows, n_cols) [m] below the undisturbed terrain, 0 = untouched, row 0 north.

    pressure : (n_rows, n_cols) [Pa], largest normal stress. The value of row i, column j stands at x_west + j posting, y_north - i posting.
    """

    sinkage: Array
    pressure: Array
    posting: float
    x_west: float
    y_north: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace:
    """One run. time : (n,) [s]."""

    run_id: int
    scenario: str
    status: str
    message: str
    step: float
    time: Array
    bodies: tuple[BodyTrace, ...]
    joints: tuple[JointTrace, ...]
    wheels: tuple[WheelTrace, ...]
    events: tuple[Event, ...]
    energy: EnergyTrace | None = None

    def until(self, time: float) -> "Trace":
        """The run up to the stored state nearest to ``time`` [s]; events and energies are left as they are."""
        n = int(np.argmin(np.abs(self.time - time))) + 1

        def cut(item):  # type: ignore[no-untyped-def]
            arrays = {f.name: getattr(item, f.name)[:n] for f in fields(item) if isinstance(getattr(item, f.name), np.ndarray)}
            return replace(item, **arrays)

        pieces = {name: tuple(cut(item) for item in getattr(self, name)) for name in ("bodies", "joints", "wheels")}
        return replace(self, time=self.time[:n], **pieces)
