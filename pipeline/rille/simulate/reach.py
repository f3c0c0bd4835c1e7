"""What a scenario asks of drives that they cannot do, for the solver does in silence as much as they can."""

from rille.model import Drive, JointLimit, Rover, Scenario

EXACT = 1e-9  # share of a bound by which the numbers of files miss it


def beyond_reach(rover: Rover, scenario: Scenario) -> tuple[str, ...]:
    """One sentence for each drive that is commanded beyond its speed, its torque, or the range of its joint, with the first such command.

    The solver keeps commanded speeds within ``max_speed`` and efforts within ``max_torque``; a joint ends at its stops.
    """
    limits = {joint.name: joint.limit for joint in rover.joints}
    units = rover.drive_units
    said = []
    for drive in rover.drives:
        bound, what = _bound(drive, limits[drive.joint])
        if bound is None:
            continue
        lower, upper = bound
        spare = EXACT * max(abs(lower), abs(upper))
        for command in sorted((c for c in scenario.commands if c.drive == drive.name), key=lambda c: c.time):
            if lower - spare <= command.value <= upper + spare:
                continue
            most = upper if command.value > upper else lower
            unit = units[drive.name]
            said.append(
                f"drive '{drive.name}' is commanded {command.value:g} {unit} at {command.time:g} s, beyond {what}, {most:g} {unit}; "
                "it does no more than that"
            )
            break
    return tuple(said)


def _bound(drive: Drive, limit: JointLimit | None) -> tuple[tuple[float, float] | None, str]:
    """The range of the commands that a drive can follow, and its name."""
    if drive.mode == "torque":
        return (-drive.max_torque, drive.max_torque), "its max_torque"
    if drive.mode == "speed" and drive.max_speed is not None:
        return (-drive.max_speed, drive.max_speed), "its max_speed"
    if drive.mode == "position" and limit is not None:
        return (limit.lower, limit.upper), f"the range of joint '{drive.joint}'"
    return None, ""
