"""What a scenario asks for and a run does not do: the solver does in silence as much as it can."""

import math
from collections.abc import Iterator, Sequence

from rille.model import Drive, JointLimit, Pose, Rover, Scenario

EXACT = 1e-9  # share of a bound by which the numbers of files miss it
ROUNDED = 1e-6  # share of a time by which whole steps may miss it, unsaid


def unheeded(rover: Rover, scenario: Scenario) -> tuple[str, ...]:
    """What is asked in vain, a sentence each: commands beyond what a drive can do, what comes after the end, the start of a machine that
    the world holds, velocities that are gone when it begins, times that are no whole number of steps.

    The solver keeps commanded speeds within ``max_speed`` and efforts within ``max_torque``; a joint ends at its stops.
    """
    return (
        *_beyond_reach(rover, scenario),
        *_after_the_end(scenario),
        *_start_in_vain(rover, scenario),
        *_velocity_in_vain(rover, scenario),
        *_rounded(scenario),
    )


def _after_the_end(scenario: Scenario) -> Iterator[str]:
    """Commands, and changes of state, of which the first is told."""
    for what, late in (
        ("command", [(c.time, f"drive '{c.drive}'") for c in scenario.commands if c.time > scenario.duration]),
        ("change", [(c.time, f"'{c.target}'") for c in scenario.changes if c.time > scenario.duration]),
    ):
        if late:
            time, of = min(late)
            count = f"1 {what} comes" if len(late) == 1 else f"{len(late)} {what}s come"
            yield (
                f"{count} after the end of scenario '{scenario.name}' at {scenario.duration:g} s, the first of {of} at {time:g} s; "
                "give a longer duration"
            )


def _start_in_vain(rover: Rover, scenario: Scenario) -> Iterator[str]:
    held = next((joint for joint in rover.joints if joint.parent is None), None)
    moved = scenario.start != Pose() or any(scenario.start_velocity) or any(scenario.start_angular_velocity)
    if held is not None and moved:
        yield (
            f"joint '{held.name}' hangs '{held.child}' on the world, so the start of scenario '{scenario.name}' (position, heading, "
            "velocity) moves nothing; where joints start is said by its [[initial_state]]"
        )


def _velocity_in_vain(rover: Rover, scenario: Scenario) -> Iterator[str]:
    """A velocity at the start of what is set down on its terrain, or comes to rest first."""
    rests = "comes to rest before t = 0 (settle_time)" if scenario.settle_time > 0 else None
    why = rests or ("is set down on its terrain" if scenario.placement == "on_terrain" else None)
    free = all(joint.parent is not None for joint in rover.joints)
    if why is not None and free and (any(scenario.start_velocity) or any(scenario.start_angular_velocity)):
        lost = f"the velocity of the start of scenario '{scenario.name}' is lost"
        yield f"{lost}, as the model {why}; give it in a [[state_change]] at time 0"
    spun = next((state.joint for state in scenario.initial_states if state.velocity), None)
    if rests is not None and spun is not None:
        yield f"the velocity of joint '{spun}' in [[initial_state]] is lost, as the model {rests}; give it in a [[state_change]] at time 0"


def _rounded(scenario: Scenario) -> Iterator[str]:
    """Times of which the nearest whole number of steps is taken; of times that cannot be, the solver speaks."""
    for what, time, done in (
        ("duration", scenario.duration, "the run ends at"),
        ("output_interval", max(scenario.output_interval, scenario.step), "states are stored every"),
    ):
        if not (0 < scenario.step < math.inf and 0 < time < math.inf):
            continue
        steps = max(1, round(time / scenario.step))
        if abs(steps * scenario.step - time) > ROUNDED * time:
            yield f"{what} is {time:g} s, no whole number of steps of {scenario.step:g} s; {done} {steps * scenario.step:g} s"


def _beyond_reach(rover: Rover, scenario: Scenario) -> Iterator[str]:
    """For each drive that is commanded beyond its speed, its torque, or the range of its joint, the first such command."""
    for drive in rover.drives:
        given = sorted((command.time, command.value) for command in scenario.commands if command.drive == drive.name)
        if sentence := _first_beyond(rover, drive, given):
            yield sentence


def beyond_reach(rover: Rover, drive: str, value: float, time: float) -> str | None:
    """What is said of a command that its drive can follow in part only, or None; also of a drive that there is not.

    Parameters
    ----------
    value : set value [rad/s, rad or N m; of a prismatic joint m/s, m or N]. time : [s] when it is given.
    """
    commanded = next((each for each in rover.drives if each.name == drive), None)
    return None if commanded is None else _first_beyond(rover, commanded, [(time, value)])


def _first_beyond(rover: Rover, drive: Drive, given: Sequence[tuple[float, float]]) -> str | None:
    """What is said of the first command, (time, value), that a drive cannot follow, or None."""
    bound, what = _bound(drive, next(joint.limit for joint in rover.joints if joint.name == drive.joint))
    if bound is None:
        return None
    lower, upper = bound
    spare = EXACT * max(abs(lower), abs(upper))
    for time, value in given:
        if not lower - spare <= value <= upper + spare:
            most, unit = upper if value > upper else lower, rover.drive_units[drive.name]
            commanded = f"drive '{drive.name}' is commanded {value:g} {unit} at {time:g} s"
            return f"{commanded}, beyond {what}, {most:g} {unit}; it does no more than that"
    return None


def _bound(drive: Drive, limit: JointLimit | None) -> tuple[tuple[float, float] | None, str]:
    """The range of the commands that a drive can follow, and its name."""
    if drive.mode == "torque":
        return (-drive.max_torque, drive.max_torque), "its max_torque"
    if drive.mode == "speed" and drive.max_speed is not None:
        return (-drive.max_speed, drive.max_speed), "its max_speed"
    if drive.mode == "position" and limit is not None:
        return (limit.lower, limit.upper), f"the range of joint '{drive.joint}'"
    return None, ""
