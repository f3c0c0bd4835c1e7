"""A library of maneuvers: what a machine can be asked to do so that effects show apart from each other.

Each is a start and a few set values per drive, within what the machine did in its recordings (or a little more where it may): efforts and
speeds are shares of its natural ones. ``scenario_text`` writes one as a scenario file that ``rille run`` takes.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rille.diagnosis.hypotheses.natural import Natural
from rille.model.machine import Machine, MachineDrive
from rille.model.rover import Vector

Values = tuple[tuple[float, float], ...]
"""(time [s], set value) one after the other; each holds until the next."""

HOLD = 0.1  # [s] between two set values of a wave
DURATION = 8.0  # [s]
FASTEST = 3 * np.pi  # [rad/s] of a wave: seven set values a period


@dataclass(frozen=True, slots=True, kw_only=True)
class Maneuver:
    """commands : of drives by name [rad/s, rad or N m, by mode]. positions : of joints at the start that differ from the
    scenario's [rad or m]. velocity, turning : of a free root at the start [m/s, rad/s]. purpose : what it tells apart, in words.
    """

    name: str
    purpose: str
    duration: float = DURATION
    commands: Mapping[str, Values] = field(default_factory=dict)
    positions: Mapping[str, float] = field(default_factory=dict)
    velocity: Vector | None = None
    turning: Vector | None = None


def library(machine: Machine, scales: Natural, tied: Sequence[str] = ()) -> tuple[Maneuver, ...]:
    """Maneuvers for this machine.

    Parameters
    ----------
    scales : as of ``natural``. tied : joints that a gear or a loop ties to others: their starts stay those of the scenario.
    """
    rims = {wheel.joint for wheel in machine.wheels} if machine.has_ground else set()
    driving = [d for d in machine.drives if d.joint in rims]
    arms = [d for d in machine.drives if d.joint not in rims]
    found: list[Maneuver] = []
    if driving and machine.root:
        found += _drives(machine, driving, arms, scales)
    else:
        found += _joints(machine, [*arms, *driving], scales)
        found += _releases(machine, scales, tied) if not machine.root else _throws(machine, scales)
    return tuple(found)


# ---------------------------------------------------------------- joints


def _size(drive: MachineDrive, scales: Natural) -> float:
    """Usual set value: effort, speed or travel."""
    here = scales.at("joint", drive.joint)
    usual = {
        "torque": here.get("N", drive.max_torque),
        "speed": here.get("rad", 1.0) / here.get("s", 1.0),
        "position": 0.5 * here.get("rad", 1.0),
    }
    size = usual[drive.mode]
    if drive.mode == "torque":
        return min(size, drive.max_torque)
    return min(size, drive.max_speed) if drive.mode == "speed" and drive.max_speed else size


def _joints(machine: Machine, drives: Sequence[MachineDrive], scales: Natural) -> Iterable[Maneuver]:
    """Each drive alone, others at zero (a position drive where it is)."""
    for drive in drives:
        size, own = _size(drive, scales), [d for d in drives if d is not drive and d.mode != "position"]
        rest = {d.name: ((0.0, 0.0),) for d in own}
        pace = 1.0 / scales.at("joint", drive.joint).get("s", 1.0)  # [1/s] of its usual motion
        named = drive.name

        def made(name: str, purpose: str, values: Values, named: str = named, rest: Mapping[str, Values] = rest) -> Maneuver:
            return Maneuver(name=f"{name}_{named}", purpose=purpose, commands={**rest, named: values})

        yield made("slow_reversals", "dry friction, play and stiction show where it reverses slowly", _wave(size, 0.25 * 2 * np.pi))
        yield made("fast_reversals", "elasticity, lags and what grows with speed show in fast motion", _wave(size, min(2 * pace, FASTEST)))
        yield made(
            "staircase",
            "what grows with speed or load shows from step to step",
            _stairs(size * np.array([0.25, 0.5, 0.75, 1, 0, -0.25, -0.5, -1])),
        )
        yield made(
            "kicks", "delays, lags and the largest effort show at jumps", _stairs(size * np.array([1.3, 0, -1.3, 0, 1.3, -1.3, 0.65, 0]))
        )


def _wave(size: float, pace: float) -> Values:
    time = np.arange(0.0, DURATION, HOLD)
    return tuple((round(float(t), 6), float(v)) for t, v in zip(time, size * np.sin(pace * time), strict=True))


def _stairs(levels: np.ndarray) -> Values:
    return tuple((round(float(t), 6), float(v)) for t, v in zip(np.arange(len(levels)) * DURATION / len(levels), levels, strict=True))


def _releases(machine: Machine, scales: Natural, tied: Sequence[str]) -> Iterable[Maneuver]:
    """Let go from a deflection, without any effort: friction and drag alone take the motion out."""
    idle = {d.name: ((0.0, 0.0),) for d in machine.drives if d.mode == "torque"}
    held = {d.joint for d in machine.drives if d.mode != "torque"} | set(tied)
    free = [j for j in machine.joints if j.kind in ("hinge", "prismatic") and j.name not in held]
    for name, angle in (("far", 1.5), ("near", 0.3)):
        if not free:
            return
        yield Maneuver(
            name=f"release_from_{name}",
            purpose="a free motion that dies out: dry, viscous and quadratic losses take it out along different curves",
            commands=idle,
            positions={free[0].name: _inside(angle * scales.at("joint", free[0].name).get("rad", 1.0), free[0].lower, free[0].upper)},
        )


def _inside(value: float, lower: float, upper: float) -> float:
    """A position within nine tenths of the way to the stops."""
    return float(np.clip(value, 0.9 * lower, 0.9 * upper))


# ---------------------------------------------------------------- free bodies


def _throws(machine: Machine, scales: Natural) -> Iterable[Maneuver]:
    """A body in flight: at rest, fast, slow, spinning."""
    v, g = max(scales.speed, 0.5), max(machine.gravity, 0.1)
    idle = {d.name: ((0.0, 0.0),) for d in machine.drives if d.mode != "position"}
    speed = max(v, 0.25 * g)
    throws: tuple[tuple[str, Vector, Vector, str], ...] = (
        ("drop", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "from rest to fast: losses grow from nothing, each with its own power of the speed"),
        ("fast_throw", (2 * speed, 0.0, speed), (0.0, 0.0, 0.0), "fast from the first moment, also sideways"),
        ("slow_throw", (0.3 * speed, 0.0, 0.3 * speed), (0.0, 0.0, 0.0), "slow: what does not fade with speed shows"),
        ("spinning_throw", (speed, 0.0, speed), (3.0, 4.0, 5.0), "turning about all axes: masses that lie or move elsewhere show"),
    )
    for name, velocity, turning, purpose in throws:
        yield Maneuver(name=name, purpose=purpose, duration=3.0, commands=idle, velocity=velocity, turning=turning)


# ---------------------------------------------------------------- rovers


def _drives(machine: Machine, driving: Sequence[MachineDrive], arms: Sequence[MachineDrive], scales: Natural) -> Iterable[Maneuver]:
    """Wheels in speed mode, sides by where the wheels are; steering drives where position drives are."""
    side = {d.name: _side(machine, d.joint) for d in driving}
    rim = float(np.median([_size(d, scales) for d in driving]))
    steering = {d.name: _front(machine, d.joint) for d in arms if d.mode == "position"}

    def wheels(levels: Sequence[tuple[float, float]]) -> dict[str, Values]:
        """Set values of the left and the right side, one after the other."""
        times = [round(k * DURATION / len(levels), 6) for k in range(len(levels))]
        return {name: tuple((t, rim * level[0 if side[name] > 0 else 1]) for t, level in zip(times, levels, strict=True)) for name in side}

    def drive(name: str, purpose: str, levels: Sequence[tuple[float, float]], steer: float = 0.0) -> Maneuver:
        turned = {joint: ((0.0, steer * front),) for joint, front in steering.items()}
        return Maneuver(name=name, purpose=purpose, commands={**wheels(levels), **turned})

    both = [(k, k) for k in (0.3, 0.6, 1.0, 1.3)]
    yield drive("speed_staircase", "straight on at four speeds: what grows with speed shows from step to step", both)
    yield drive(
        "stop_and_go", "starts and stops: lags, play and stiction show at jumps", [(1, 1), (0, 0), (1, 1), (-1, -1), (0, 0), (1, 1)]
    )
    yield drive("forth_and_back", "over its own track: ground that remembers shows on the way back", [(1, 1), (-1, -1), (1, 1)])
    yield drive(
        "turn_on_the_spot", "turning without driving: scrub and width show as different torques and rates", [(-0.7, 0.7), (0.7, -0.7)]
    )
    yield drive(
        "curves",
        "curves of several radii: a width scales all of them alike, lateral forces do not",
        [(0.2, 1), (0.5, 1), (0.8, 1), (1, 0.2), (1, 0.5)],
    )
    if steering:
        yield drive("steered_curve", "steered wheels follow an arc: lateral forces show without skidding", [(1, 1)], steer=0.3)
        yield drive("crab", "driving with all wheels turned against their way: lateral forces show", [(0.6, 0.6), (1, 1)], steer=-0.5)
    rows = {
        side_: sorted((d for d in driving if (side[d.name] > 0) == side_), key=lambda d: _along(machine, d.joint))
        for side_ in (True, False)
    }
    uneven = {d.name: ((0.0, rim * (0.5 if k % 2 else 1.2)),) for row in rows.values() for k, d in enumerate(row)}
    yield Maneuver(
        name="uneven_wheels",
        purpose="every other wheel of a side slower: wheels slip at different rates while the machine goes straight",
        commands=uneven,
    )


def _side(machine: Machine, joint: str) -> float:
    """Left is positive: y of the wheel's joint against the middle of all."""
    across = {j.name: float(j.point[1]) for j in machine.joints}
    return across[joint] - float(np.mean([across[w.joint] for w in machine.wheels]))


def _front(machine: Machine, joint: str) -> float:
    """1 for a steering joint ahead of the middle, -1 behind it."""
    return 1.0 if _along(machine, joint) > float(np.mean([_along(machine, w.joint) for w in machine.wheels])) else -1.0


def _along(machine: Machine, joint: str) -> float:
    return next(float(j.point[0]) for j in machine.joints if j.name == joint)


# ---------------------------------------------------------------- as a scenario file


def scenario_text(
    maneuver: Maneuver,
    machine: Machine,
    *,
    step: float,
    start: Sequence[float] | None = None,
    positions: Mapping[str, float] | None = None,
) -> str:
    """The scenario as TOML, SI throughout; ``rille run MODEL --scenario FILE`` takes it.

    Parameters
    ----------
    step : [s]. start : of a free root (x, y, z, heading) [m, rad]; on a terrain z comes from the ground.
    positions : of joints at the start where the maneuver says nothing [rad or m]; for a machine on the ground none: it settles.
    """
    gravity = [machine.parameters.get(f"gravity.{k}", (0.0, 0.0, 0.0))[0] for k in "xyz"]
    lines = [
        f"# {maneuver.purpose}",
        f'name = "{maneuver.name}"',
        f"duration = {maneuver.duration!r}",
        f"step = {step!r}",
        f"gravity = [{', '.join(repr(float(g)) for g in gravity)}]",
    ]
    if machine.terrain:
        lines.append(f'terrain = "{machine.terrain}"')
    if start is not None and machine.root:
        lines += ["", "[start]", *(f"{word} = {_number(start[k])}" for word, k in (("x", 0), ("y", 1), ("heading", 3)))]
        lines += [] if machine.terrain else [f"z = {_number(start[2])}"]
        lines += [f"velocity = {list(maneuver.velocity)!r}"] if maneuver.velocity is not None else []
        lines += [f"angular_velocity = {list(maneuver.turning)!r}"] if maneuver.turning is not None else []
    for joint, position in {**(positions or {}), **maneuver.positions}.items():
        if abs(position) > 1e-9:
            lines += ["", "[[initial_state]]", f'joint = "{joint}"', f"position = {_number(position)}"]
    for time, value, drives in _shared_commands(maneuver.commands):
        names = ", ".join(_literal(d) for d in drives)
        lines += ["", "[[command]]", f"drives = [{names}]", f"time = {time!r}", f"value = {_number(value)}"]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """Nine digits; what is nothing is 0."""
    return repr(float(f"{value:.9g}")) if abs(value) > 1e-12 else "0.0"


def _literal(text: str) -> str:
    """A name as a TOML string that stands for itself where patterns are allowed."""
    literal = "".join(f"[{c}]" if c in "*?[" else c for c in text)
    return '"' + literal.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _shared_commands(commands: Mapping[str, Values]) -> list[tuple[float, float, list[str]]]:
    """Drives that get the same value at the same time, in one entry."""
    shared: dict[tuple[float, float], list[str]] = {}
    for drive, values in commands.items():
        for time, value in values:
            shared.setdefault((time, value), []).append(drive)
    return [(time, value, drives) for (time, value), drives in sorted(shared.items())]
