"""A recording as a run that can be shown: where the machine was, as far as its channels say."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import BodyTrace, Event, InputRefused, JointTrace, Rover, Trace, WheelTrace
from rille.model.kinematics import forward_kinematics, movable_joints
from rille.model.quaternion import angles as angles_of
from rille.model.quaternion import from_angles, unit
from rille.model.recording import ANGLES, AXES, Channel, Recording, full_name
from rille.model.rotation import matrix_of, quaternion
from rille.view.scene3d.animation import continuous
from rille.view.scene3d.page_source import Extra
from rille.view.scene3d.tracks import WHEEL

Array = NDArray[np.float64]
RATE = 50.0  # [Hz] poses are worked out this often at most
MOST_PLOTTED = 20_000  # samples of a channel in the plots


def recorded_trace(recording: Recording, rover: Rover, beside: Trace) -> tuple[Trace, list[str]]:
    """Poses from what was recorded, and notes on what was assumed: joints that nobody measured stand at zero, a height or a tilt that is
    missing is that of the run ``beside``.

    Raises
    ------
    InputRefused : if no channel says where the machine or a joint is, or those that do have no time in common.
    """
    seen = {(c.quantity, c.target, c.component): c for c in recording.channels if c.role == "observed" and np.isfinite(c.value).any()}
    carried = {joint.child for joint in rover.joints}
    root = next((body.name for body in rover.bodies if body.name not in carried), None)
    placed = [seen[key] for key in seen if key[0] in ("part.position", "part.orientation") and key[1] == root]
    joints = {joint.name: seen[key] for joint in movable_joints(rover) if (key := ("joint.position", joint.name, "")) in seen}
    used = [*placed, *joints.values()]
    if not used:
        raise InputRefused(
            f"recording '{recording.name}' says neither where {root or 'the machine'} is nor where a joint stands; "
            "`rille compare` shows it in plots"
        )
    first, last = max(float(c.time[0]) for c in used), min(float(c.time[-1]) for c in used)
    if not first < last:
        names = ", ".join(c.name for c in used[:6])
        raise InputRefused(
            f"the channels {names} of recording '{recording.name}' have no time in common; `rille compare` shows them in plots"
        )
    rate = min(RATE, max(len(c.time) for c in used) / max(last - first, 1e-9))
    time = np.linspace(first, last, max(2, int((last - first) * rate) + 1))
    notes = []
    missing = [joint.name for joint in movable_joints(rover) if joint.name not in joints]
    if missing:
        notes.append(
            f"{len(missing)} joints were not recorded and stand at zero: {', '.join(missing[:6])}{' ...' if len(missing) > 6 else ''}"
        )
    position, rotation = _root(seen, root, time, beside, notes)
    hinges = {joint.name for joint in rover.joints if joint.kind == "hinge"}
    positions = {name: at(channel, time, angle=name in hinges) for name, channel in joints.items()}
    bodies = _poses(rover, root, time, position, rotation, positions)
    return (
        Trace(
            run_id=0,
            scenario=recording.name,
            status="recorded",
            message="",
            step=0.0,
            time=time,
            bodies=bodies,
            joints=tuple(_joint(seen, joint.name, time) for joint in movable_joints(rover)),
            wheels=tuple(_wheel(seen, rover, wheel.name, bodies, time) for wheel in rover.wheels),
            events=tuple(Event(time=first, kind=f.code, subject=f.channel, message=f.message) for f in recording.findings),
        ),
        notes,
    )


def at(channel: Channel, time: Array, *, angle: bool = False) -> Array:
    """Values of a channel at times [s], its delay taken off; missing ones are bridged, angles [rad] the short way round."""
    good = np.isfinite(channel.value)
    if not good.any():
        return np.full(len(time), np.nan)
    value = np.unwrap(channel.value[good]) if angle else channel.value[good]
    return np.interp(time, channel.time[good] - channel.delay, value)


def turned_at(channels: Sequence[Channel], time: Array) -> Array:
    """Quaternions (n, 4) at times [s] of channels w x y z: q and -q are one orientation, and neighbours are taken on one side."""
    own = channels[0].time
    whole = np.column_stack([at(c, own - c.delay) for c in channels])
    near = continuous(whole)
    return np.column_stack([np.interp(time, own - channels[0].delay, near[:, k]) for k in range(4)])


def extras(recording: Recording) -> list[Extra]:
    """Every channel for the plots, thinned, at the times at which it was so or acted: its delay is taken off."""
    found = []
    for channel in recording.channels:
        stride = max(1, -(-len(channel.time) // MOST_PLOTTED))
        label = f"{full_name(channel.quantity, channel.component, channel.target)} ({channel.name})"
        late = {"observed": -channel.delay, "command": channel.delay}.get(channel.role, 0.0)
        found.append(Extra(label=label, unit=channel.unit, time=channel.time[::stride] + late, values=channel.value[::stride]))
    return found


Seen = Mapping[tuple[str, str, str], Channel]


def _root(seen: Seen, root: str | None, time: Array, beside: Trace, notes: list[str]) -> tuple[Array, Array]:
    """Positions (n, 3) [m] and quaternions (n, 4) of the root."""
    if root is None:
        return np.zeros((len(time), 3)), np.tile([1.0, 0.0, 0.0, 0.0], (len(time), 1))
    run = next(body for body in beside.bodies if body.name == root)
    columns, borrowed = [], []
    for k, axis in enumerate(AXES):
        channel = seen.get(("part.position", root, axis))
        columns.append(at(channel, time) if channel is not None else np.interp(time, beside.time, run.position[:, k]))
        borrowed += [axis] if channel is None else []
    measured = [seen.get(("part.orientation", root, c)) for c in ("w", *AXES)]
    if all(measured):
        turned = turned_at([c for c in measured if c is not None], time)
    else:
        angles = []
        run_angles = angles_of(run.rotation)
        for k, name in enumerate(ANGLES):
            channel = seen.get(("part.orientation", root, name))
            angles.append(
                at(channel, time, angle=True) if channel is not None else np.interp(time, beside.time, np.unwrap(run_angles[:, k]))
            )
            borrowed += [name] if channel is None else []
        turned = from_angles(np.column_stack(angles))
    if borrowed:
        notes.append(f"{', '.join(borrowed)} of '{root}' were not recorded and are those of run {beside.run_id}")
    return np.column_stack(columns), unit(turned)


def _poses(
    rover: Rover, root: str | None, time: Array, position: Array, rotation: Array, joints: Mapping[str, Array]
) -> tuple[BodyTrace, ...]:
    """Every body at every time: X_WB = X_WR X_RM X_MB by forward kinematics."""
    frames = {body.name: np.array(body.frame) for body in rover.bodies}
    places = {body.name: (np.empty((len(time), 3)), np.empty((len(time), 4))) for body in rover.bodies}
    for k in range(len(time)):
        found = forward_kinematics(rover, {name: float(values[k]) for name, values in joints.items()})
        turn = matrix_of(rotation[k])
        offset = position[k] - turn @ frames[root] if root is not None else position[k]
        for name, pose in found.items():
            places[name][0][k] = turn @ pose[:3, 3] + offset
            places[name][1][k] = quaternion(turn @ pose[:3, :3])
    unknown = np.full((len(time), 3), np.nan)
    return tuple(
        BodyTrace(name=name, position=p, rotation=q, velocity=unknown, angular_velocity=unknown) for name, (p, q) in places.items()
    )


def _joint(seen: Seen, name: str, time: Array) -> JointTrace:
    unknown = np.full(len(time), np.nan)

    def values(quantity: str) -> Array:
        channel = seen.get((quantity, name, ""))
        return unknown if channel is None else at(channel, time)

    return JointTrace(
        name=name, position=values("joint.position"), velocity=values("joint.velocity"), effort=values("joint.effort"), work=unknown
    )


def _wheel(seen: Seen, rover: Rover, name: str, bodies: Sequence[BodyTrace], time: Array) -> WheelTrace:
    wheel = next(wheel for wheel in rover.wheels if wheel.name == name)
    child = next(joint.child for joint in rover.joints if joint.name == wheel.joint)
    body = next(body for body in bodies if body.name == child)
    arm = np.array(wheel.center) - np.array(next(b.frame for b in rover.bodies if b.name == child))
    center = body.position + np.array([matrix_of(q) @ arm for q in body.rotation])
    values = {}
    for field in WHEEL:
        channel = seen.get((f"wheel.{field}", name, ""))
        values[field] = np.full(len(time), np.nan) if channel is None else at(channel, time)
    return WheelTrace(name=name, center=center, ground_height=np.full(len(time), np.nan), **values)
