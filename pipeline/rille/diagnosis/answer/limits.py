"""What recordings cannot tell, whatever one makes of them, and why: motions, loads and sensors that are missing.

An effect that no sample excites leaves no residual, and two that act alike in all samples leave the same one. Each sentence says what was
not seen, what therefore cannot be known, and what to record instead.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.hypotheses.natural import most, rates
from rille.model.difference import Difference
from rille.model.machine import Machine
from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
SHORTEST = 4.0  # [s] of all recordings together; about eight windows, of which two are held out
STILL = 4.0  # [noise] less motion than this is none
ONE_WAY = 0.02  # share of the samples that must move the other way for a reversal
OVER = (0.1, 0.3, 1.0)  # [s] over which positions are made into speeds
STEADY = 0.1  # [-] relative spread below which a speed or a load was one
TURNING = 0.02  # [rad/s] slower turning is none
STEEP = 0.03  # [rad] less slope is flat
MOST_NAMES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """A joint over all recordings: speeds (n,) [rad/s or m/s] with the noise of one of them."""

    speeds: Array
    noise: float

    @property
    def moves(self) -> bool:
        """More than its noise lets it seem."""
        return most(self.speeds) > STILL * self.noise

    @property
    def reverses(self) -> bool:
        """Clearly, both ways."""
        clear = self.speeds[np.abs(self.speeds) > STILL * self.noise]
        return len(clear) > 0 and bool(min(np.mean(clear > 0), np.mean(clear < 0)) > ONE_WAY)

    @property
    def one_speed(self) -> bool:
        """While it moves, its speed hardly differs."""
        size = np.abs(self.speeds[np.abs(self.speeds) > max(STILL * self.noise, 0.1 * most(self.speeds))])
        return len(size) > 8 and float(np.quantile(size, 0.9) - np.quantile(size, 0.1)) < STEADY * float(np.median(size)) + 2 * self.noise


def limits(recordings: Sequence[Recording], machine: Machine, difference: Difference | None = None) -> tuple[str, ...]:
    """Sentences on what these recordings cannot tell.

    Parameters
    ----------
    recordings : with samples, of one machine. difference : for where the noise of each channel is from; None: only stated noise counts.
    """
    points = [r for r in recordings if r.kind == "points"]
    runs = [r for r in recordings if r.kind == "time"]
    return (
        *(_of_points(points) if points else ()),
        *(_of_length(runs) if runs else ()),
        *(_of_ends(difference) if difference is not None else ()),
        *_of_noise(recordings, difference),
        *(_of_joints(runs, machine) if runs else ()),
        *(_of_forces(runs, machine) if runs else ()),
        *(_of_driving(runs, machine) if runs and machine.wheels and machine.has_ground else ()),
    )


def _of_length(recordings: Sequence[Recording]) -> Iterable[str]:
    total = sum(_duration(r) for r in recordings)
    if total < SHORTEST:
        yield (
            f"the recordings that were fitted last {total:.3g} s together, less than {SHORTEST:g} s: a fit can hardly be told from a "
            "coincidence; record for longer, or once more"
        )


def _of_ends(difference: Difference) -> Iterable[str]:
    """Windows that the model does not survive."""
    ended = [w for w in difference.windows if w.ended]
    if ended:
        yield (
            f"the model's run ends early in {len(ended)} of {len(difference.windows)} windows ({ended[0].ended}): what it would have shown "
            "there cannot be known; look at the model in a plain `rille run` first"
        )


def _of_noise(recordings: Sequence[Recording], difference: Difference | None) -> Iterable[str]:
    observed = {c.name: c for r in recordings for c in r.with_role("observed")}
    source = {c.name: (c.noise_from, c.noise) for c in difference.channels} if difference is not None else {}
    guessed = [
        name
        for name, c in observed.items()
        if c.noise is None and c.resolution is None and source.get(name, ("", 0.0))[0] not in ("repeats", "stated")
    ]
    unknown = [name for name, (_, noise) in source.items() if not noise > 0]
    guessed = [name for name in guessed if name not in unknown]
    if unknown:
        yield (
            f"{_names('channel', unknown)} no noise that the samples could tell: how much of a difference is the sensor's own cannot be "
            "known there; state its noise in the manifest"
        )
    if guessed:
        yield (
            f"the noise of {_list(guessed)} is not stated and is taken from how neighbouring samples jump: slow errors of such a sensor "
            "count as missing physics; state noise and slow_noise in the manifest, or record the machine at rest"
        )


def _of_joints(recordings: Sequence[Recording], machine: Machine) -> Iterable[str]:
    joints = [j.name for j in machine.joints if j.kind in ("hinge", "prismatic")]
    motions = {name: motion for name in joints if (motion := _motion(recordings, name)) is not None}
    unseen = [name for name in joints if name not in motions and not _shown_otherwise(recordings, machine, name)]
    still = [name for name, m in motions.items() if not m.moves]
    one_way = [name for name, m in motions.items() if m.moves and not m.reverses]
    steady = [name for name, m in motions.items() if m.moves and m.one_speed]
    if unseen:
        yield (
            f"no channel shows {_joints(unseen)}: what is amiss there can only show in other channels, and cannot be told from what acts "
            "on those; record position or velocity"
        )
    if still:
        yield (
            f"{_joints(still)} never move{_s(still)} by more than the noise: friction, play and elasticity there cannot be known; record a "
            "run that moves it"
        )
    if one_way:
        yield (
            f"{_joints(one_way)} never reverse{_s(one_way)}: dry friction there cannot be told from a constant effort (an offset of the "
            "torque, a tilt); record both directions"
        )
    if steady:
        yield (
            f"{_joints(steady)} move{_s(steady)} at one speed: dry friction cannot be told from viscous friction or from what grows with "
            "speed otherwise; record several speeds"
        )


def _of_forces(recordings: Sequence[Recording], machine: Machine) -> Iterable[str]:
    """What gives a force its scale: an effort, a current, a weight that changes."""
    shows = ("joint.effort", "motor.current", "wheel.drawbar_pull", "wheel.drive_torque", "wheel.normal_load", "wheel.side_force")
    known = {c.target for r in recordings for c in r.channels if c.role != "ignore" and c.quantity in shows and np.isfinite(c.value).any()}
    if not known:
        yield (
            "no effort, current or force was recorded or commanded: only ratios of forces to masses can be known, and a force cannot be "
            "told from a change of the mass that it moves; record efforts or currents"
        )
        return
    mute = [d.name for d in machine.drives if d.mode != "torque" and d.speed_gain is None and not {d.name, d.joint} & known]
    if mute:
        verb = "hold" if len(mute) > 1 else "holds"
        yield (
            f"{_many('drive', mute)} {verb} a speed or position, and no effort is recorded there: friction and load do not show while the "
            "drive is strong enough; record the effort or the current"
        )
    for drive in machine.drives:
        efforts = [np.abs(c.value) for c in _of(recordings, shows[:2], (drive.name, drive.joint))]
        size = np.concatenate(efforts) if efforts else np.empty(0)
        size = size[np.isfinite(size)]
        if len(size) > 8 and np.median(size) > 0 and np.quantile(size, 0.95) - np.quantile(size, 0.05) < STEADY * np.median(size):
            yield (
                f"drive '{drive.name}' works at a single load ({np.median(size):.3g}): friction that grows with load cannot be told from "
                "friction that does not; record another load"
            )


def _of_driving(recordings: Sequence[Recording], machine: Machine) -> Iterable[str]:
    """What a rover did not do."""
    rims = [c for r in recordings for c in r.channels if c.quantity == "joint.velocity" and c.target in _rim_names(machine)]
    rims = [c for c in rims if c.role != "ignore" and np.isfinite(c.value).any()]
    if rims and all(most(c.value) <= STILL * (c.noise or 0.0) + 1e-3 for c in rims):
        yield "no wheel turns: slip, resistance and everything that acts on rolling wheels cannot be known; record a drive"
        return
    rates_z = [most(c.value) for c in _of(recordings, ("part.angular_velocity",), (machine.root,)) if c.component == "z"]
    rates_z += [
        most(rates(c.time, np.unwrap(c.value[np.isfinite(c.value)]), 0.5))
        for c in _of(recordings, ("part.orientation",), (machine.root,))
        if c.component == "yaw" and np.isfinite(c.value).all()
    ]
    if rates_z and max(rates_z) < TURNING:
        yield (
            f"the machine never turns faster than {max(rates_z):.2g} rad/s: lateral forces, track width and what a turning wheel drags "
            "around cannot be known; record curves and a turn on the spot"
        )
    tilts = [most(c.value) for c in _of(recordings, ("part.orientation",), (machine.root,)) if c.component in ("roll", "pitch")]
    if tilts and max(tilts) < STEEP:
        yield (
            f"the ground is level within {max(tilts):.2g} rad: the load of each wheel hardly changes, and what grows with it cannot be "
            "told from what does not; record a slope"
        )


def _rim_names(machine: Machine) -> tuple[str, ...]:
    rims = [wheel.joint for wheel in machine.wheels]
    return (*rims, *(d.name for d in machine.drives if d.joint in rims))


def _of_points(recordings: Sequence[Recording]) -> Iterable[str]:
    """Steady points of a bench."""
    found = [np.concatenate([c.value for c in _of(recordings, (q,))] or [np.empty(0)]) for q in ("wheel.normal_load", "wheel.slip_ratio")]
    loads, slips = (values[np.isfinite(values)] for values in found)
    if len(loads) and np.ptp(loads) < STEADY * np.median(loads):
        yield (
            f"all points have one load, {np.median(loads):.3g} N: how pressure grows with sinkage cannot be known, so that the moduli, the "
            "exponent and the size of the plate cannot be told apart; record other loads"
        )
    if len(slips) and np.ptp(slips) < STEADY:
        yield (
            f"all points have one slip, {np.median(slips):.2g}: what grows with slip cannot be told from the rest; record a sweep of slip"
        )
    n = sum(len(r.channels[0].value) for r in recordings if r.channels)
    if n < 8:
        yield f"there are {n} points, less than 8: a law with a free number fits them by chance; record more points"


def _motion(recordings: Sequence[Recording], joint: str) -> Motion | None:
    """From velocity channels, else from positions over the time that shows most; None: neither was recorded."""
    velocities = _of(recordings, ("joint.velocity",), (joint,))
    if velocities:
        speeds = np.concatenate([c.value for c in velocities])
        return Motion(speeds=speeds[np.isfinite(speeds)], noise=max(c.noise or 0.0 for c in velocities))
    positions = _of(recordings, ("joint.position",), (joint,))
    spans = [
        Motion(
            speeds=np.concatenate([rates(c.time, c.value, over) for c in positions]),
            noise=max((c.noise or c.resolution or 0.0) * np.sqrt(2) / over for c in positions),
        )
        for over in OVER
        if positions
    ]
    return max(spans, key=lambda m: most(m.speeds) / max(m.noise, 1e-12), default=None)


def _shown_otherwise(recordings: Sequence[Recording], machine: Machine, joint: str) -> bool:
    """Whether the pose of what the joint carries is recorded, or a drive without slack holds it to its command."""
    (child,) = (j.child for j in machine.joints if j.name == joint)
    pose = ("part.position", "part.orientation", "part.linear_velocity", "part.angular_velocity")
    held = any(d.joint == joint and d.mode != "torque" and d.speed_gain is None for d in machine.drives)
    return held or bool(_of(recordings, pose, (child,)))


def _of(recordings: Sequence[Recording], quantities: Sequence[str], targets: Sequence[str] | None = None) -> list[Channel]:
    """Channels of these quantities that hold samples, observed or commanded efforts."""
    return [
        c
        for r in recordings
        for c in r.channels
        if c.quantity in quantities
        and (targets is None or c.target in targets)
        and (c.role == "observed" or (c.role == "command" and c.quantity == "joint.effort"))
        and np.isfinite(c.value).any()
    ]


def _duration(recording: Recording) -> float:
    times = [c.time for c in recording.with_role("observed") if len(c.time)]
    return max((float(t[-1]) for t in times), default=0.0) - min((float(t[0]) for t in times), default=0.0)


def _list(names: Sequence[str]) -> str:
    shown = ", ".join(f"'{name}'" for name in names[:MOST_NAMES])
    return shown + (f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else "")


def _many(word: str, names: Sequence[str]) -> str:
    return f"{word}{'s' if len(names) > 1 else ''} {_list(names)}"


def _joints(names: Sequence[str]) -> str:
    return _many("joint", names)


def _names(word: str, names: Sequence[str]) -> str:
    return f"{_many(word, names)} {'have' if len(names) > 1 else 'has'}"


def _s(names: Sequence[str]) -> str:
    """Ending of a verb."""
    return "" if len(names) > 1 else "s"
