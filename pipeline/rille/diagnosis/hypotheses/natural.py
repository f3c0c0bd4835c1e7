"""What is large and what is small for a machine: efforts, speeds, masses and lengths that its catalogue numbers are measured by.

The catalogue states one usual value for all machines. What is usual for a pendulum of 0.2 N m stalls nothing on a rover, and the other way
round: dimensional numbers are usual in proportion to the machine. ``usual`` scales them from ``REFERENCE``, the machine that the catalogue
has in mind, to this one (dimensional similarity; numbers without dimension stay).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rille.model.machine import Machine, MachineJoint
from rille.model.recording import Channel

Array = NDArray[np.float64]
Scales = Mapping[str, float]
"""Size of each symbol of a unit at one target: {"N": 5.0, "rad": 1.0, "s": 0.2, ...}."""

# Symbols as the catalogue's usual values mean them. At joints N stands for the effort (N m on a hinge, N on a slide) and m for 1, so that
# "N m s/rad" is an effort over a speed on both; rad is the travel, kg the inertia.
REFERENCE: Mapping[str, Scales] = {
    "joint": {"N": 5.0, "m": 1.0, "rad": 1.0, "s": 0.2, "kg": 0.1},
    "body": {"N": 100.0, "m": 0.5, "kg": 10.0, "s": 0.2},
    "wheel": {"N": 100.0, "m": 0.165, "s": 1.65},
    "terrain": {"m": 16.0},
    "channel": {"SI": 1.0, "s": 0.02},
}
SMALL = 1e-12
SMALLEST_MASS = 0.03  # share of the machine's mass
MOST_SEEN = (0.02, 0.98)  # of the samples of a joint's position: between these it was seen
MOTOR_SHARE = 0.03  # of a drive's largest effort that it usually needs


@dataclass(frozen=True, slots=True, kw_only=True)
class Natural:
    """Natural scales of a machine.

    joints, bodies, wheels : by name. ranges : joint -> positions [rad or m] between which most of its samples lie.
    track : (m, 3) [m] positions where it was, at ``track_time`` (m,) [s]. span : first and last time [s] of the recordings. interval [s] :
    of the samples. speed [m/s] : of the machine.
    """

    joints: Mapping[str, Scales] = field(default_factory=dict)
    bodies: Mapping[str, Scales] = field(default_factory=dict)
    wheels: Mapping[str, Scales] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    track: Array = field(default_factory=lambda: np.zeros((0, 3)))
    track_time: Array = field(default_factory=lambda: np.zeros(0))
    span: tuple[float, float] = (0.0, 60.0)
    interval: float = 0.02
    speed: float = 1.0

    @property
    def extent(self) -> float:
        """Length [m] of the diagonal of the box that the track fills, at least 1 m."""
        return max(1.0, float(np.linalg.norm(np.ptp(self.track[:, :2], axis=0)))) if len(self.track) else 10.0

    def at(self, target_kind: str, target: str) -> Scales:
        """Scales at a target; of '*' the medians over all of its kind; {} where nothing is known."""
        if target_kind == "terrain":
            return {"m": self.extent}
        known = {"joint": self.joints, "body": self.bodies, "wheel": self.wheels}.get(target_kind, {})
        if target in known:
            return known[target]
        if target != "*" or not known:
            return {}
        symbols = set.intersection(*(set(scales) for scales in known.values()))
        return {symbol: float(np.median([scales[symbol] for scales in known.values()])) for symbol in symbols}


def size_of(unit: str, scales: Scales) -> float | None:
    """A unit with the sizes of its symbols put in: "N m s/rad" -> N m s / rad. None if a symbol has no size here."""
    size, over = 1.0, False
    for factor in unit.replace("(", " ").replace(")", " ").replace("/", " / ").split():
        if factor == "/":
            over = True
            continue
        symbol, _, power = factor.partition("^")
        value = 1.0 if symbol == "1" else scales.get(symbol)
        if value is None:
            return None
        size *= value ** ((-1 if over else 1) * int(power or 1))
    return size


def factor_of(unit: str, target_kind: str, scales: Scales) -> float:
    """How many times larger than on the catalogue's machine a number of that unit usually is; 1 where it cannot be told."""
    here, there = size_of(unit, scales), size_of(unit, REFERENCE.get(target_kind, {}))
    return here / there if here and there else 1.0


def natural(machine: Machine, channels: Sequence[Channel]) -> Natural:
    """Natural scales from the machine's masses, geometry and drives, and from what was recorded where ``channels`` hold samples."""
    clocks = [c.time for c in channels if c.role == "observed" and len(c.time) > 1]
    track = _track(machine, channels)
    speed = _speed(machine, channels, track)
    joints = {joint.name: _joint(machine, joint, channels, speed) for joint in machine.joints if joint.kind in ("hinge", "prismatic")}
    return Natural(
        joints=joints,
        bodies={body.name: _body(machine, body.name, speed, joints) for body in machine.bodies},
        wheels={
            wheel.name: {"N": max(_load(machine), SMALL), "m": wheel.width, "s": wheel.width / max(speed, 1e-3)} for wheel in machine.wheels
        },
        ranges={name: seen for name in joints if (seen := _range(channels, name)) is not None},
        track=track[:, 1:],
        track_time=track[:, 0],
        span=(min(float(t[0]) for t in clocks), max(float(t[-1]) for t in clocks)) if clocks else (0.0, 60.0),
        interval=float(np.median([np.median(np.diff(t)) for t in clocks])) if clocks else 0.02,
        speed=speed,
    )


def most(values: Array, share: float = 0.95) -> float:
    """Size that most finite values stay below; 0 without any."""
    values = np.abs(values[np.isfinite(values)])
    return float(np.quantile(values, share)) if len(values) else 0.0


def rates(time: Array, value: Array, over: float) -> Array:
    """Slopes [unit/s] over about that time [s]: of noisy positions a usable speed."""
    good = np.isfinite(value)
    time, value = time[good], value[good]
    if len(time) < 3:
        return np.empty(0)
    every = max(1, int(np.searchsorted(time, time[0] + over)))
    gaps = time[every:] - time[:-every]
    return ((value[every:] - value[:-every])[gaps > 0]) / gaps[gaps > 0]


def _recorded(channels: Sequence[Channel], quantity: str, targets: Sequence[str]) -> list[Channel]:
    return [c for c in channels if c.quantity == quantity and c.target in targets and c.role != "ignore" and len(c.value) > 2]


def _range(channels: Sequence[Channel], joint: str) -> tuple[float, float] | None:
    """Positions of a joint between which most samples lie; None where none were recorded or it does not move."""
    seen = [c for c in _recorded(channels, "joint.position", [joint]) if c.role == "observed" and _stands_out(c)]
    if not seen:
        return None
    low, high = np.nanquantile(np.concatenate([c.value for c in seen]), MOST_SEEN)
    return (float(low), float(high)) if high > low else None


def _track(machine: Machine, channels: Sequence[Channel]) -> Array:
    """(m, 4) time [s] and position [m] of the root, or of the part whose position was recorded; at most 400 rows of each recording."""
    known = [c for c in channels if c.quantity == "part.position" and c.role == "observed" and len(c.time) > 2]
    target = machine.root if any(c.target == machine.root for c in known) else known[0].target if known else ""
    by_axis = {axis: [c for c in known if c.target == target and c.component == axis] for axis in "xyz"}
    rows = []
    for number, x in enumerate(by_axis["x"]):
        at = np.linspace(x.time[0], x.time[-1], min(400, len(x.time)))
        columns = [at]
        for axis in "xyz":
            same = by_axis[axis][number] if number < len(by_axis[axis]) else None
            good = np.isfinite(same.value) if same is not None else np.zeros(0, dtype=bool)
            columns.append(np.interp(at, same.time[good], same.value[good]) if same is not None and good.any() else np.zeros(len(at)))
        rows.append(np.stack(columns, axis=1))
    return np.concatenate(rows) if rows else np.zeros((0, 4))


def _speed(machine: Machine, channels: Sequence[Channel], track: Array) -> float:
    """Usual speed [m/s] of the machine: recorded, of its track, or of its wheels; else 1 m/s."""
    recorded = [most(c.value) for c in _recorded(channels, "part.linear_velocity", [b.name for b in machine.bodies])]
    rim = [
        wheel.radius * most(c.value)
        for wheel in machine.wheels
        for c in _recorded(channels, "joint.velocity", [wheel.joint, *(d.name for d in machine.drives if d.joint == wheel.joint)])
    ]
    if len(track) > 4:
        forward = np.diff(track[:, 0]) > 0
        over = np.linalg.norm(np.diff(track[:, 1:], axis=0), axis=1)[forward] / np.diff(track[:, 0])[forward]
        recorded.append(most(over, 0.8))
    found = max([*recorded, *rim], default=0.0)
    return found if found > 1e-4 else 1.0


def _load(machine: Machine) -> float:
    """Mean load [N] of a wheel."""
    return sum(b.mass for b in machine.bodies) * machine.gravity / max(1, len(machine.wheels))


def matters(machine: Machine, moving: Sequence[str]) -> list[str]:
    """Of these bodies the root and those that are more than a small share of the mass; what is lighter acts like its carrier."""
    total = sum(b.mass for b in machine.bodies if b.name in moving)
    return [b.name for b in machine.bodies if b.name in moving and (b.mass >= SMALLEST_MASS * total or b.name == machine.root)]


def moving_bodies(machine: Machine) -> list[str]:
    """Bodies that are not fixed to the world."""
    held = {""}
    for _ in machine.joints:
        held |= {j.child for j in machine.joints if j.kind == "fixed" and j.parent in held}
    return [b.name for b in machine.bodies if b.name not in held]


def carried(machine: Machine, body: str) -> tuple[str, ...]:
    """The body and all that hangs on it."""
    found = [body]
    for name in found:
        found += [j.child for j in machine.joints if j.parent == name and j.child not in found]
    return tuple(found)


def _inertia(machine: Machine, joint: MachineJoint, names: Sequence[str]) -> tuple[float, float]:
    """Of what the joint carries: inertia about its axis [kg m^2] (mass [kg] of a slide), and its moment or force of weight [N m or N]."""
    bodies = [b for b in machine.bodies if b.name in names]
    mass = sum(b.mass for b in bodies)
    if joint.kind == "prismatic":
        return mass, mass * machine.gravity
    axis = np.asarray(joint.axis, dtype=float)
    total, moment = 0.0, np.zeros(3)
    for body in bodies:
        reach = np.asarray(body.com, dtype=float) - np.asarray(joint.point, dtype=float)
        reach -= axis * (reach @ axis)
        own = [machine.parameters.get(f"body.{body.name}.{word}", (0.0, 0.0, 0.0))[0] for word in ("ixx", "iyy", "izz")]
        total += float(body.mass * reach @ reach + np.square(axis) @ np.asarray(own))
        moment += body.mass * reach
    down = np.asarray([machine.parameters.get(f"gravity.{k}", (0.0, 0.0, 0.0))[0] for k in "xyz"])
    across = float(np.linalg.norm(np.cross(axis, down)))  # part of gravity that can turn it
    return total, float(np.linalg.norm(moment)) * across


def _joint(machine: Machine, joint: MachineJoint, channels: Sequence[Channel], machine_speed: float) -> Scales:
    """Efforts and speeds of a joint: recorded where they stand out of the noise, else what its weight and inertia ask for."""
    drive = next((d for d in machine.drives if d.joint == joint.name), None)
    names = [joint.name, *([drive.name] if drive else [])]
    wheel = next((w for w in machine.wheels if w.joint == joint.name), None)
    inertia, weight = _inertia(machine, joint, carried(machine, joint.child))
    if wheel is not None:
        weight = 0.3 * _load(machine) * wheel.radius if machine.has_ground or machine.soft_ground else weight
    speeds = [most(c.value) for c in _recorded(channels, "joint.velocity", names) if _stands_out(c)]
    speeds += [most(rates(c.time, c.value, 0.1)) for c in _recorded(channels, "joint.position", names) if _stands_out(c)]
    speed = max(speeds, default=0.0)
    if speed < 1e-6:
        speed = (
            machine_speed / wheel.radius if wheel is not None else float(np.sqrt(weight / inertia)) if weight > 0 and inertia > 0 else 1.0
        )
    efforts = [most(c.value) for c in _recorded(channels, "joint.effort", names) if _stands_out(c)]
    if drive is not None and drive.torque_constant:
        efforts += [drive.torque_constant * most(c.value) for c in _recorded(channels, "motor.current", names) if _stands_out(c)]
    asked = weight if weight > 1e-9 else inertia * speed * max(speed, 1.0)
    effort = max(efforts, default=0.0)
    if effort <= 0 and drive is not None:  # what it moves tells little of what its maker thought it might have to
        effort = float(np.sqrt(max(asked, SMALL) * max(asked, MOTOR_SHARE * drive.max_torque)))
    effort = effort if effort > 0 else asked
    if drive is not None:
        effort = min(effort, drive.max_torque)
    travel = (
        1.0 if joint.kind == "hinge" else max([most(c.value) for c in _recorded(channels, "joint.position", names)], default=0.0) or 1.0
    )
    return {"N": max(effort, 1e-9), "m": 1.0, "rad": travel, "s": travel / max(speed, 1e-3), "kg": max(inertia, 1e-9)}


def _stands_out(channel: Channel) -> bool:
    """Whether a channel shows more than its noise."""
    return most(channel.value) > 4 * (channel.noise or 0.0) + SMALL


def _body(machine: Machine, name: str, speed: float, joints: Mapping[str, Scales]) -> Scales:
    """A body: its mass, its size from its inertia, its weight (that of the whole machine for a free root), its speed."""
    body = next(b for b in machine.bodies if b.name == name)
    own = sum(machine.parameters.get(f"body.{name}.{word}", (0.0, 0.0, 0.0))[0] for word in ("ixx", "iyy", "izz"))
    size = float(np.sqrt(1.5 * own / body.mass)) if body.mass > 0 and own > 0 else 0.3
    mass = sum(b.mass for b in machine.bodies) if name == machine.root else body.mass
    if not machine.root:
        carrier = next((j for j in machine.joints if j.child == name), None)
        if carrier is not None and carrier.name in joints:
            lever = float(np.linalg.norm(np.asarray(body.com, dtype=float) - np.asarray(carrier.point, dtype=float))) or size
            speed = joints[carrier.name]["rad"] / joints[carrier.name]["s"] * (lever if carrier.kind == "hinge" else 1.0)
    force = mass * machine.gravity if machine.gravity > 0 else mass * speed
    return {"N": max(force, 1e-9), "m": size, "kg": max(body.mass, 1e-9), "s": size / max(speed, 1e-3)}
