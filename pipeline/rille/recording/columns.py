"""What each column becomes: channel, factor to SI and offset, checked against the vocabulary, pint and the model."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rille.model.errors import InputRefused, nearest_names
from rille.model.quantity import counts_no_turns, to_si, unit_registry
from rille.model.recording import ANGLES, Channel, Correction, Quantity, find_quantity
from rille.model.rover import COMMAND_QUANTITIES, Rover
from rille.recording.manifest import ChannelSheet, ManifestSheet

LONGEST_DELAY = 10.0  # [s] a sensor that tells later than this is a log, whose clock is to be shifted


@dataclass(frozen=True, slots=True, kw_only=True)
class Targets:
    """Names in the model. joints : name -> kind. drives : name -> joint that it drives. commands : drive -> quantity that is commanded."""

    joints: Mapping[str, str]
    parts: frozenset[str]
    wheels: frozenset[str]
    drives: Mapping[str, str]
    commands: Mapping[str, str]

    def named(self, kind: str) -> frozenset[str]:
        """All names of one kind of target."""
        return frozenset({"joint": self.joints, "part": self.parts, "wheel": self.wheels, "drive": self.drives}[kind])


def targets_of(rover: Rover) -> Targets | None:
    """Names that channels can have as targets; None for a database without a model."""
    if not rover.bodies:
        return None
    return Targets(
        joints={joint.name: joint.kind for joint in rover.joints},
        parts=frozenset(body.name for body in rover.bodies),
        wheels=frozenset(wheel.name for wheel in rover.wheels),
        drives={drive.name: drive.joint for drive in rover.drives},
        commands={drive.name: COMMAND_QUANTITIES[drive.mode] for drive in rover.drives},
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column and the channel that it becomes: value = factor * written + offset [SI].

    entry : name of the channel in the manifest, which may make several. accepted : codes of the gate.
    """

    column: str
    entry: str
    channel: Channel
    factor: float
    offset: float
    missing: str
    accepted: frozenset[str]


def plan_columns(sheet: ManifestSheet, targets: Targets | None) -> tuple[Column, ...]:
    """The columns of a manifest, in its order; one with several targets becomes several channels "name (target)".

    Columns with role ``ignore`` that say no quantity or target are left out.

    Raises
    ------
    InputRefused : for unknown quantities, components, units or targets, units of another dimension, and two channels for one thing.
    """
    planned = []
    for entry in sheet.channel:
        if entry.role == "ignore" and not (entry.quantity and entry.target):
            continue
        planned += _plan(entry, targets if sheet.kind == "time" else None)
    if not planned:
        raise InputRefused(
            f"recording '{sheet.name}' has no channel that is observed or commanded; give one a quantity, a target and a unit"
        )
    _refuse_twins(sheet, planned)
    return tuple(planned)


def scale_steps(columns: Sequence[Column], sheet: ManifestSheet) -> list[Correction]:
    """Scales and offsets as recorded steps; a plain conversion of units is none."""
    stated = {entry.name or entry.column: entry for entry in sheet.channel if entry.scale != 1.0 or entry.offset != 0.0}
    steps = []
    for column in columns:
        entry = stated.get(column.entry)
        if entry is not None:
            detail: dict[str, object] = {"factor": column.factor, "offset": column.offset, "unit": column.channel.unit}
            detail |= {"written": f"{entry.unit} * {entry.scale} + {entry.offset}"}
            steps.append(Correction(kind="scale", channel=column.channel.name, detail=detail, reason="scale and offset of the manifest"))
    return steps


def _plan(entry: ChannelSheet, targets: Targets | None) -> list[Column]:
    name = entry.name or entry.column
    what = f"channel '{name}'"
    for key in ("quantity", "target"):
        if not getattr(entry, key):
            raise InputRefused(f'{what} says no {key}; give one, or role = "ignore"')
    quantity = find_quantity(entry.quantity, what)
    _check_component(entry, quantity, what)
    names = [entry.target] if isinstance(entry.target, str) else entry.target
    if isinstance(entry.target, list) and entry.role != "command":
        raise InputRefused(f"{what} has several targets, but what was observed was observed at one; only a command may have several")
    columns = []
    for target in names:
        units = _units(entry, quantity, target, targets, what)
        factor, unit = _factor(entry, units, what)
        numbers: dict[str, Any] = {}
        for key in ("noise", "slow_noise", "resolution"):
            stated = getattr(entry, key)
            numbers[key] = None if stated is None else to_si(stated, unit, f"{key} of {what}")
            if stated is not None and numbers[key] <= 0:
                raise InputRefused(f"{key} of {what} is {stated}; it must be larger than 0, or left out if it is not known")
        if numbers["slow_noise"] and numbers["noise"] and numbers["slow_noise"] > numbers["noise"]:
            raise InputRefused(f"slow_noise of {what} is {entry.slow_noise}, more than its noise, {entry.noise}, of which it is a part")
        delay = to_si(entry.delay, "time", f"delay of {what}")
        if not 0 <= delay <= LONGEST_DELAY:
            raise InputRefused(
                f"delay of {what} is {entry.delay}; it must lie in 0 to {LONGEST_DELAY:g} s, or be left out if it is not known"
            )
        channel = Channel(
            name=name if isinstance(entry.target, str) else f"{name} ({target})",
            quantity=entry.quantity,
            component=entry.component,
            target=target,
            unit=unit,
            role=entry.role,
            frame=entry.frame,
            delay=delay,
            **numbers,
        )
        offset = to_si(entry.offset, unit, f"offset of {what}")
        accepted = frozenset(entry.accepted) | ({"missing"} if entry.missing == "accept" else frozenset())
        columns.append(
            Column(column=entry.column, entry=name, channel=channel, factor=factor, offset=offset, missing=entry.missing, accepted=accepted)
        )
    return columns


def _check_component(entry: ChannelSheet, quantity: Quantity, what: str) -> None:
    if quantity.components and entry.component not in quantity.components:
        known = ", ".join(quantity.components)
        said = f"has the component '{entry.component}'" if entry.component else "says no component"
        raise InputRefused(f"{what} {said}, but {entry.quantity} has the components {known}; give one of them")
    if entry.component and not quantity.components:
        raise InputRefused(f"{what} has the component '{entry.component}', but {entry.quantity} is one number; remove it")


def _units(entry: ChannelSheet, quantity: Quantity, target: str, targets: Targets | None, what: str) -> tuple[str, ...]:
    """SI units that the channel may have; checks the target."""
    if quantity.components and "rad" in quantity.units:
        return ("rad",) if entry.component in ANGLES else ("1",)
    if targets is None:
        return quantity.units
    known = targets.named(quantity.target)
    joint = target
    if quantity.target == "joint" and entry.role == "command" and target not in known:
        joint = targets.drives.get(target, target)
        known = known | frozenset(targets.drives)
    if target not in known:
        raise InputRefused(f"{what} is of the {quantity.target} '{target}', which the model does not have; {nearest_names(target, known)}")
    if quantity.target == "joint":
        return quantity.units[1:] if targets.joints[joint] == "prismatic" else quantity.units[:1]
    return quantity.units


def _factor(entry: ChannelSheet, units: Sequence[str], what: str) -> tuple[float, str]:
    """Factor from the written numbers to SI, and the SI unit that fits."""
    import pint

    registry = unit_registry()
    written = entry.unit.strip() or "1"
    if entry.unit == "" and units != ("1",):
        raise InputRefused(f'{what} says no unit; {entry.quantity} has {" or ".join(units)}: write for example unit = "{units[0]}"')
    try:
        unit = registry.parse_units("dimensionless" if written == "1" else written)
        scale = registry.Quantity(entry.scale) if isinstance(entry.scale, str) else registry.Quantity(float(entry.scale), "")
    except pint.UndefinedUnitError as error:
        unknown = error.unit_names if isinstance(error.unit_names, str) else ", ".join(error.unit_names)
        raise InputRefused(f"{what} has the unit '{unknown}', which is unknown; {nearest_names(unknown, COMMON_UNITS)}") from None
    except Exception as error:  # pint lets errors of its parser through
        raise InputRefused(f"{what} has a unit or scale that cannot be read ('{written}', '{entry.scale}': {error})") from None
    if not 0 < abs(scale.m) < float("inf"):
        raise InputRefused(f"scale of {what} is {entry.scale}; give a finite number that is not 0")
    for si in units:
        try:
            number = registry.Quantity(1.0, unit) * scale
            factor = float(number.m_as(si if si != "1" else ""))
        except pint.DimensionalityError:
            continue
        except pint.OffsetUnitCalculusError:
            break
        if counts_no_turns(number, si):
            raise InputRefused(f"{what} has the unit '{written}', which for {entry.quantity} may mean turns or radians; write {si} or turn")
        return factor, si
    total = written if entry.scale == 1.0 else f"{written} times the scale {entry.scale}"
    hint = '; standard gravity is written "g_0"' if written == "g" else ""
    raise InputRefused(
        f"{what} has the unit {total}, but {entry.quantity} is measured in {' or '.join(units)}; correct the unit or the quantity{hint}"
    )


COMMON_UNITS = (
    *("rad", "deg", "turn", "mrad", "m", "mm", "cm", "km", "s", "ms", "us", "ns", "min", "rad/s", "deg/s", "rpm", "m/s", "mm/s", "km/h"),
    *(
        "m/s^2",
        "g_0",
        "N",
        "kN",
        "mN",
        "N m",
        "mN m",
        "kg",
        "A",
        "mA",
        "V",
        "mV",
        "percent",
        "1",
        "Hz",
        "degree",
        "radian",
        "meter",
        "second",
    ),
)


def _refuse_twins(sheet: ManifestSheet, columns: Sequence[Column]) -> None:
    names = Counter(column.channel.name for column in columns)
    for name, count in names.items():
        if count > 1:
            raise InputRefused(f"recording '{sheet.name}' has {count} channels named '{name}'; give all but one another name (name = ...)")
    redundant = {entry.name or entry.column for entry in sheet.channel if entry.redundant}
    seen: dict[tuple[str, ...], str] = {}
    for column in columns:
        channel = column.channel
        if channel.role == "ignore" or (channel.role == "observed" and channel.name in redundant):
            continue
        key = (channel.quantity, channel.component, channel.target, channel.role, channel.frame)
        if key in seen:
            fix = 'role = "ignore"' if channel.role == "command" else 'redundant = true, or role = "ignore"'
            raise InputRefused(
                f"channels '{seen[key]}' and '{channel.name}' are both {channel.of} ({channel.role}); keep one, or mark the other {fix}"
            )
        seen[key] = channel.name


def on_clock(columns: Sequence[Column], clocks: Mapping[str, str]) -> tuple[Column, ...]:
    """The columns with the clock that stamps each, by column."""
    return tuple(replace(column, channel=replace(column.channel, clock=clocks[column.column])) for column in columns)
