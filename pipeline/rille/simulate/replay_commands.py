"""Commands of a recording as those of a model's drives."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
MODE_OF = {"joint.effort": "torque", "joint.velocity": "speed", "joint.position": "position"}
BEFORE_ALL = -1e12  # [s] the first value of a log holds from here


def drive_commands(recording: Recording, drives: Sequence[tuple[str, str, str]]) -> Mapping[str, tuple[Array, Array]]:
    """Times [s] at which values act, and values [rad/s, rad or N m], of every drive that a command channel speaks of.

    What is stamped t acts at t + delay and holds until the next; the first value also holds before. Missing values (NaN) are skipped: the
    one before holds on.

    Parameters
    ----------
    drives : (drive, joint, mode) of the model; a channel's target is a drive or a joint.

    Raises
    ------
    InputRefused : for a target without drive, a quantity that does not fit the drive's mode, two channels for one drive or no value at all.
    """
    by_name = {name: drive for drive in drives for name in (drive[1], drive[0])}
    commands: dict[str, tuple[Array, Array]] = {}
    source: dict[str, str] = {}
    for channel in recording.with_role("command"):
        what = f"command channel '{channel.name}' of recording '{recording.name}'"
        if channel.target not in by_name:
            raise InputRefused(
                f"{what} is for '{channel.target}', which is no drive and no driven joint of the model; "
                f"{nearest_names(channel.target, list(by_name))}"
            )
        drive, _, mode = by_name[channel.target]
        _require_fit(channel, drive, mode, what)
        if drive in commands:
            raise InputRefused(f"{what} commands drive '{drive}', as channel '{source[drive]}' does; give one of them role = \"ignore\"")
        seen = np.isfinite(channel.value)
        if not seen.any():
            raise InputRefused(f'{what} holds no value; give it role = "ignore" or import a channel that has some')
        time, value = channel.time[seen] + channel.delay, channel.value[seen]
        source[drive] = channel.name
        changed = np.r_[True, np.diff(value) != 0]
        commands[drive] = (np.r_[BEFORE_ALL, time[changed][1:]], value[changed])
    return commands


def _require_fit(channel: Channel, drive: str, mode: str, what: str) -> None:
    """A drive takes torques, speeds or positions, by its mode."""
    if channel.quantity not in MODE_OF:
        raise InputRefused(f"{what} has the quantity '{channel.quantity}'; drives are commanded by {', '.join(MODE_OF)}")
    if MODE_OF[channel.quantity] != mode:
        raise InputRefused(
            f"{what} gives '{channel.quantity}' to drive '{drive}', whose mode is {mode}; "
            f'set mode = "{MODE_OF[channel.quantity]}" for that drive in the sheet, or choose another channel as command'
        )
