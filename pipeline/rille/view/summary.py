"""A run in a few numbers."""

from dataclasses import asdict, dataclass

import numpy as np

from rille.model import JointTrace, Rover, Trace
from rille.model.over_time import shares, slipping


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelSummary:
    """A wheel in numbers.

    mean_slip_ratio : [-] over the times at which the wheel moved, signed. max_sinkage : [m]. mean_normal_load : [N].
    mean_drive_torque : [N m].
    """

    name: str
    mean_slip_ratio: float
    max_sinkage: float
    mean_normal_load: float
    mean_drive_torque: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveSummary:
    """A drive in numbers.

    peak_effort : [N m or N]. mean_power, peak_power : effort times speed [W]; the peak is the value of largest magnitude, positive where
    it drives, negative where it brakes. work : [J].
    """

    name: str
    peak_effort: float
    mean_power: float
    peak_power: float
    work: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """A run in numbers.

    duration : [s]. distance : length of the path of the root body (of the fastest body, if the root is held) [m].
    energy : work done by all drives [J]; regenerated work counts negative. max_sinkage : [m], None without wheels.
    balance : where the energy went [J], columns of table ``energy_state`` at the end; None for a run without them.
    """

    status: str
    duration: float
    distance: float
    energy: float
    max_sinkage: float | None
    wheels: tuple[WheelSummary, ...]
    drives: tuple[DriveSummary, ...]
    balance: dict[str, float] | None

    def as_dict(self) -> dict:
        """For JSON."""
        return asdict(self)

    def lines(self) -> list[str]:
        """For people."""
        lines = [
            f"{'status':<24} {self.status}",
            f"{'simulated time':<24} {self.duration:.2f} s",
            f"{'distance':<24} {self.distance:.3f} m",
        ]
        if self.wheels:
            lines.append(
                f"{'energy of the drives':<24} {self.energy:.1f} J"
                + (f" ({self.energy / self.distance:.1f} J/m)" if self.distance > 0.01 else "")
            )
            lines += self._balance_lines()
            lines.append(f"{'maximal sinkage':<24} {1e3 * (self.max_sinkage or 0):.1f} mm")
            lines.append("")
            lines.append(f"{'wheel':<24} {'mean slip ratio':>15} {'max sinkage':>14} {'mean load':>12} {'mean torque':>14}")
            for wheel in self.wheels:
                lines.append(
                    f"{wheel.name:<24} {wheel.mean_slip_ratio:15.3f} {1e3 * wheel.max_sinkage:11.1f} mm {wheel.mean_normal_load:10.1f} N "
                    f"{wheel.mean_drive_torque:10.2f} N m"
                )
            lines.append("")
        return lines

    def _balance_lines(self) -> list[str]:
        lines = []
        if self.balance is not None:
            b = self.balance
            parts = {
                "soil": b["soil_loss"],
                "joints": b["joint_loss"],
                "rigid contacts": b["contact_loss"],
                "height": b["potential"],
                "motion": b["kinetic"],
                "other forces": -b["external_work"],
            }
            went = ", ".join(f"{name} {value:.1f}" for name, value in parts.items() if abs(value) >= 0.05)
            scale = max(abs(b["drive_work"]), *(abs(value) for value in parts.values()), 1e-9)
            lines.append(f"{'  went into [J]':<24} {went or 'nothing'}; open {100 * abs(b['residual']) / scale:.2g} %")
        if self.drives:
            most = max(self.drives, key=lambda drive: abs(drive.peak_power))
            way = "braking" if most.peak_power < 0 else "driving"
            lines.append(f"{'peak power of a drive':<24} {abs(most.peak_power):.2f} W ({most.name}, {way})")
        return lines


def summary(trace: Trace, rover: Rover) -> Summary:
    """Reduce a trace to a summary. Path lengths are sums of straight pieces between stored states."""
    lengths = {body.name: float(np.linalg.norm(np.diff(body.position, axis=0), axis=1).sum()) for body in trace.bodies}
    carried = {joint.child for joint in rover.joints}
    roots = [name for name in lengths if name not in carried]
    distance = lengths[roots[0]] if roots else max(lengths.values(), default=0.0)
    rims = {wheel.name: wheel for wheel in rover.wheels}
    spins = {joint.name: joint for joint in trace.joints}
    root = next((body for body in trace.bodies if roots and body.name == roots[0]), None)
    speed = np.zeros(len(trace.time)) if root is None else np.linalg.norm(root.velocity, axis=1)
    lasts = shares(trace.time)
    wheels = []
    for wheel in trace.wheels:
        moving = slipping(speed, spins[rims[wheel.name].joint].velocity * rims[wheel.name].radius, wheel.sinkage)
        wheels.append(
            WheelSummary(
                name=wheel.name,
                mean_slip_ratio=_mean(wheel.slip_ratio[moving], lasts[moving]),
                max_sinkage=float(wheel.sinkage.max(initial=0.0)),
                mean_normal_load=_mean(wheel.normal_load, lasts),
                mean_drive_torque=_mean(wheel.drive_torque, lasts),
            )
        )
    return Summary(
        status=trace.status,
        duration=float(trace.time[-1]) if len(trace.time) else 0.0,
        distance=distance,
        energy=float(sum(joint.work[-1] for joint in trace.joints if len(joint.work))),
        max_sinkage=max((wheel.max_sinkage for wheel in wheels), default=None),
        wheels=tuple(wheels),
        drives=tuple(_drive(drive.name, spins[drive.joint], trace.time) for drive in rover.drives if drive.joint in spins),
        balance={name: float(values[-1]) for name, values in asdict(trace.energy).items()} if trace.energy else None,
    )


def _mean(values: np.ndarray, lasts: np.ndarray) -> float:
    """Over time; 0 of nothing. lasts : [s] that each value stands for."""
    return float(np.average(values, weights=lasts)) if lasts.any() else 0.0


def _drive(name: str, joint: JointTrace, time: np.ndarray) -> DriveSummary:
    if len(time) == 0:
        return DriveSummary(name=name, peak_effort=0.0, mean_power=0.0, peak_power=0.0, work=0.0)
    power = joint.effort * joint.velocity
    work = float(joint.work[-1])
    return DriveSummary(
        name=name,
        peak_effort=float(joint.effort[np.argmax(np.abs(joint.effort))]),
        mean_power=work / float(time[-1]) if time[-1] > 0 else 0.0,
        peak_power=float(power[np.argmax(np.abs(power))]),
        work=work,
    )
