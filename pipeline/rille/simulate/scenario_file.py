"""Scenario files (TOML) -> Scenario."""

import csv
import fnmatch
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from pydantic import Field

from rille import __version__
from rille.model import Command, InitialJointState, InputRefused, Pose, Rover, Scenario, StateChange, Watch, nearest_names
from rille.model.quantity import to_si
from rille.model.sheet import Sheet, read_sheet, source_of

GRAVITY = {"moon": 1.625, "mars": 3.728, "earth": 9.80665, "none": 0.0}  # [m/s^2] mean surface gravity

Number = float | int | str
JointUnits = Mapping[str, tuple[str, str]]  # of position and velocity

PART_UNITS = {"part.position": "m", "part.orientation": "1", "part.linear_velocity": "m/s", "part.angular_velocity": "rad/s"}


class _Start(Sheet):
    x: Number = 0.0
    y: Number = 0.0
    z: Number | None = None
    heading: Number = 0.0
    velocity: list[Number] = Field(default=[0.0, 0.0, 0.0], min_length=3, max_length=3)
    angular_velocity: list[Number] = Field(default=[0.0, 0.0, 0.0], min_length=3, max_length=3)


class _InitialState(Sheet):
    joint: str
    position: Number = 0.0
    velocity: Number = 0.0


class _Command(Sheet):
    drives: list[str] = Field(min_length=1)
    time: Number = 0.0
    value: Number


class _Watch(Sheet):
    name: str = Field(min_length=1)
    event: str | None = None
    quantity: str | None = None
    component: int = Field(0, ge=0, le=3)
    target: str = ""
    above: float | None = None
    below: float | None = None
    hold: Number = 0.0
    action: Literal["mark", "stop", "command"] = "mark"
    drive: str | None = None
    value: Number | None = None


class _StateChange(Sheet):
    time: Number
    quantity: Literal[
        "joint.position", "joint.velocity", "part.position", "part.orientation", "part.linear_velocity", "part.angular_velocity"
    ]
    target: str = Field(min_length=1)
    values: list[Number] = Field(min_length=1, max_length=4)


class _ScenarioSheet(Sheet):
    name: str = Field(min_length=1)
    duration: Number
    terrain: str | None = None
    gravity: Number | list[Number] = "earth"
    step: Number = 0.001
    output_interval: Number = 0.02
    integrator: Literal["auto", "semi_implicit_euler", "rk4"] = "auto"
    settle_time: Number | None = None
    start: _Start = _Start()
    initial_state: list[_InitialState] = []
    command: list[_Command] = []
    command_table: str | None = None
    state_change: list[_StateChange] = []
    watch: list[_Watch] = []


def surface_gravity(value: Number) -> float:
    """Gravity [m/s^2] of ``moon``, ``mars``, ``earth``, ``none``, or of a number or quantity.

    Raises
    ------
    InputRefused : with the nearest names.
    """
    if isinstance(value, str) and value.isalpha():
        if value not in GRAVITY:
            raise InputRefused(f"gravity is '{value}'; {nearest_names(value, GRAVITY)}")
        return GRAVITY[value]
    return to_si(value, "acceleration", "gravity")


def _gravity(value: Number | list[Number]) -> tuple[float, float, float]:
    if isinstance(value, list):
        if len(value) != 3:
            raise InputRefused(f"gravity has {len(value)} components; give three, or one of {', '.join(GRAVITY)}")
        x, y, z = (to_si(v, "acceleration", "gravity") for v in value)
        return x, y, z
    return 0.0, 0.0, -abs(surface_gravity(value))


def read_scenario_file(path: Path, rover: Rover) -> Scenario:
    """Read a scenario file.

    Parameters
    ----------
    path : TOML file; keys are those of table ``scenario``, angles and speeds may carry units, ``drives`` takes patterns.
    rover : whose drives and joints the scenario moves; it tells their units, and patterns are expanded against the names of its drives.

    Raises
    ------
    InputRefused : with the key and its place, the nearest names of a drive or joint, or the unit that does not fit.
    """
    sheet = read_sheet(path, _ScenarioSheet)
    drive_units, joint_units = rover.drive_units, rover.joint_units
    what = f"of scenario '{sheet.name}'"
    on_terrain = sheet.terrain is not None and sheet.start.z is None
    heading = to_si(sheet.start.heading, "angle", f"heading {what}")
    position = (
        to_si(sheet.start.x, "length", f"start.x {what}"),
        to_si(sheet.start.y, "length", f"start.y {what}"),
        to_si(sheet.start.z or 0.0, "length", f"start.z {what}"),
    )
    commands = [c for entry in sheet.command for c in _commands(entry, sheet.name, drive_units)]
    if sheet.command_table is not None:
        commands += read_command_table(Path(path).parent / sheet.command_table, drive_units)
    settle = sheet.settle_time if sheet.settle_time is not None else (10.0 if on_terrain else 0.0)
    vx, vy, vz = (to_si(v, "speed", f"start.velocity {what}") for v in sheet.start.velocity)
    wx, wy, wz = (to_si(v, "angular_speed", f"start.angular_velocity {what}") for v in sheet.start.angular_velocity)
    return Scenario(
        name=sheet.name,
        duration=to_si(sheet.duration, "time", f"duration {what}"),
        gravity=_gravity(sheet.gravity),
        step=to_si(sheet.step, "time", f"step {what}"),
        output_interval=to_si(sheet.output_interval, "time", f"output_interval {what}"),
        integrator=sheet.integrator,
        terrain=sheet.terrain,
        placement="on_terrain" if on_terrain else "as_given",
        settle_time=to_si(settle, "time", f"settle_time {what}"),
        start=Pose(position=position, rotation=(math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))),
        start_velocity=(vx, vy, vz),
        start_angular_velocity=(wx, wy, wz),
        initial_states=tuple(_initial_state(entry, joint_units, what) for entry in sheet.initial_state),
        commands=tuple(sorted(commands, key=lambda c: (c.time, c.drive))),
        changes=tuple(sorted((_change(entry, joint_units, what) for entry in sheet.state_change), key=lambda change: change.time)),
        watches=tuple(_watch(entry, sheet.name, drive_units) for entry in sheet.watch),
        sources=(source_of(path, f"scenario {sheet.name}", f"rille {__version__}"),),
    )


def _initial_state(entry: _InitialState, joint_units: JointUnits, what: str) -> InitialJointState:
    position, velocity = _units_of(entry.joint, joint_units, f"an initial_state {what}")
    return InitialJointState(
        joint=entry.joint,
        position=to_si(entry.position, position, f"position of joint '{entry.joint}'"),
        velocity=to_si(entry.velocity, velocity, f"velocity of joint '{entry.joint}'"),
    )


def _change(entry: _StateChange, joint_units: JointUnits, what: str) -> StateChange:
    """Values of a joint in the unit of its kind, of the root in its own."""
    subject = f"{entry.quantity} of '{entry.target}' in a state_change {what}"
    if entry.quantity in PART_UNITS:
        unit = PART_UNITS[entry.quantity]
    else:
        unit = _units_of(entry.target, joint_units, f"a state_change {what}")[entry.quantity == "joint.velocity"]
    values = tuple(to_si(value, unit, subject) for value in entry.values)
    return StateChange(
        time=to_si(entry.time, "time", f"time of a state_change {what}"), quantity=entry.quantity, target=entry.target, values=values
    )


def _units_of(joint: str, joint_units: JointUnits, what: str) -> tuple[str, str]:
    if joint not in joint_units:
        raise InputRefused(f"{what} names the joint '{joint}', which the model does not have; {nearest_names(joint, joint_units)}")
    return joint_units[joint]


def _watch(entry: _Watch, scenario: str, drive_units: Mapping[str, str]) -> Watch:
    what = f"watch '{entry.name}' of scenario '{scenario}'"
    if (entry.event is None) == (entry.quantity is None):
        raise InputRefused(f'{what} needs either an event or a quantity, for example event = "stuck"')
    if entry.quantity is not None and entry.above is None and entry.below is None:
        raise InputRefused(f"{what} compares {entry.quantity} with nothing; give above or below, in SI")
    if (entry.action == "command") != (entry.drive is not None and entry.value is not None):
        raise InputRefused(f'{what}: drive and value belong to action = "command", and only to it')
    value = None
    if entry.drive is not None and entry.value is not None:
        if entry.drive not in drive_units:
            raise InputRefused(
                f"{what} commands the drive '{entry.drive}', which the model does not have; {nearest_names(entry.drive, drive_units)}"
            )
        value = to_si(entry.value, drive_units[entry.drive], f"value of {what}")
    fields = ("name", "action", "event", "quantity", "component", "target", "above", "below", "drive")
    return Watch(hold=to_si(entry.hold, "time", f"hold of {what}"), value=value, **{f: getattr(entry, f) for f in fields})


def _commands(entry: _Command, scenario: str, drive_units: Mapping[str, str]) -> list[Command]:
    time = to_si(entry.time, "time", f"time of a command of scenario '{scenario}'")
    commands = []
    for pattern in entry.drives:
        matched = fnmatch.filter(drive_units, pattern)
        if not matched:
            raise InputRefused(
                f"scenario '{scenario}' commands the drive '{pattern}', which the model does not have; "
                f"{nearest_names(pattern, drive_units)}"
            )
        for drive in matched:
            value = to_si(entry.value, drive_units[drive], f"the command of drive '{drive}'")
            commands.append(Command(drive=drive, time=time, value=value))
    return commands


def read_command_table(path: Path, drive_units: Mapping[str, str]) -> list[Command]:
    """Commands from a CSV: a column ``time`` [s] and one for each drive, or pattern of drives, ``wheel_* [deg/s]``; SI without a unit.

    A set value holds until the next row that has one; an empty cell commands nothing.

    Raises
    ------
    InputRefused : for a file that cannot be read, a column that is no drive, a cell that is no number or has the wrong unit.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputRefused(f"the command_table '{path}' cannot be read: {error}") from error
    header = [name.strip() for name in rows[0]] if rows else []
    if not header or header[0].partition(" ")[0] != "time":
        raise InputRefused(f"the command_table '{path}' must begin with a header: time, then names of drives")
    columns = [(name, unit.strip(" ]") or None) for name, _, unit in (column.partition("[") for column in header)]
    commands = []
    for line, row in enumerate(rows[1:], start=2):
        if len(row) > len(header):
            raise InputRefused(f"line {line} of '{path}' has {len(row)} cells, the header {len(header)}")
        numbers = [_cell(cell, f"line {line}, column '{name.strip()}' of '{path}'") for cell, (name, _) in zip(row, columns, strict=False)]
        if not numbers or numbers[0] is None:
            if any(number is not None for number in numbers):
                raise InputRefused(f"line {line} of '{path}' has no time")
            continue
        for number, (name, unit) in zip(numbers[1:], columns[1:], strict=False):
            if number is not None:
                value = number if unit is None else f"{number!r} {unit}"
                entry = _Command(
                    drives=[name.strip()], time=numbers[0] if columns[0][1] is None else f"{numbers[0]!r} {columns[0][1]}", value=value
                )
                commands += _commands(entry, path.name, drive_units)
    return commands


def _cell(text: str, what: str) -> float | None:
    if not text.strip():
        return None
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputRefused(f"{what} is '{text.strip()}', which is no number")
    return number
