"""Sheets of instruments (``sensors.toml``), or the model's own sensors, -> instruments of a machine."""

import fnmatch
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field

from rille.model import Effect, InputRefused, Rover, Sensor, nearest_names
from rille.model.quantity import to_si
from rille.model.recording import ANGLES, AXES, QUANTITIES, Quantity, find_quantity, unit_of
from rille.model.rover import COMMAND_QUANTITIES
from rille.model.sheet import Sheet, read_sheet
from rille.recording.instrument import CommandLog, Instrument, Instruments, Lapses, SampleClock

Number = float | int | str


class _Lapses(Sheet):
    fraction: float = Field(ge=0, lt=1)
    mean_length: Number = 0.0


class _Clock(Sheet):
    name: str | None = Field(default=None, min_length=1)
    rate: Number | None = None
    jitter: Number = 0.0
    phase: Number = 0.0
    stamp: Literal["true", "nominal"] = "true"
    offset: Number = 0.0
    skew: Number = 0.0
    gaps: _Lapses | None = None


class _Coloured(Sheet):
    sigma: Number
    time_constant: Number


class _Noise(Sheet):
    white: Number = 0.0
    coloured: _Coloured | None = None
    drift: Number = 0.0


class _Sensor(Sheet):
    name: str | None = Field(default=None, min_length=1)
    quantity: str
    target: str | list[str]
    components: list[str] | None = None
    component: str | None = None
    rate: Number | None = None
    clock: str | _Clock | None = None
    frame: Literal["world", "body"] = "world"
    unit: str | None = None
    delay: Number = 0.0
    scale: float = 1.0
    bias: Number = 0.0
    trend: Number = 0.0
    noise: Number | _Noise = 0.0
    saturation: Number | list[Number] | None = None
    resolution: Number = 0.0
    dropout: _Lapses | None = None
    stuck: list[list[Number]] = []


class _Command(Sheet):
    drive: str | list[str] = "*"
    rate: Number | None = None
    clock: str | _Clock | None = None
    delay: Number = 0.0


class _Seed(Sheet):
    seed: int = Field(default=0, ge=0)


class _Instruments(Sheet):
    name: str | None = Field(default=None, min_length=1)
    clock: list[_Clock] = []
    sensor: list[_Sensor] = []
    command: list[_Command] = []
    noise: _Seed = _Seed()


def read_instruments(path: Path, rover: Rover) -> Instruments:
    """Read ``sensors.toml`` for a machine.

    Raises
    ------
    InputRefused : if the sheet has unknown keys, wrong units or quantities, a target that the machine lacks, or nothing to record.
    """
    sheet = read_sheet(path, _Instruments)
    if not sheet.sensor and not sheet.command:
        raise InputRefused(f"'{path}' has neither [[sensor]] nor [[command]]; say what to record")
    clocks: dict[str, SampleClock] = {}
    for entry in sheet.clock:
        if entry.name is None:
            raise InputRefused(f"'{path}' has a [[clock]] without a name; give it one that sensors refer to")
        if entry.name in clocks:
            raise InputRefused(f"'{path}' has two clocks '{entry.name}'; give every clock its own name")
        clocks[entry.name] = _clock(entry, entry.name, None)
    sensors: list[Instrument] = []
    for entry in sheet.sensor:
        sensors += _instruments(entry, rover, clocks)
    logs: list[CommandLog] = []
    for entry in sheet.command:
        logs += _logs(entry, rover, clocks)
    used = {sensor.clock for sensor in sensors} | {log.clock for log in logs}
    made = Instruments(
        clocks={name: clock for name, clock in clocks.items() if name in used},
        sensors=tuple(sensors),
        commands=tuple(logs),
        seed=sheet.noise.seed,
        name=sheet.name,
    )
    _require_unique(made, f"'{path}'")
    return made


def own_instruments(sensors: Sequence[Sensor], effects: Sequence[Effect], rover: Rover) -> Instruments:
    """The model's own sensors with the faults that its effects give them, and the commands of all drives.

    Raises
    ------
    InputRefused : if the model has no sensors.
    """
    if not sensors:
        raise InputRefused("the model has no sensors of its own; give a sheet of instruments: --sensors sensors.toml")
    clocks: dict[str, SampleClock] = {}
    made: list[Instrument] = []
    for sensor in sensors:
        faults = [effect for effect in effects if effect.target in ("*", sensor.name)]
        components = ["w", "x", "y", "z"] if sensor.quantity == "part.orientation" else None
        inverse_range = max(_each(faults, "saturation", "inverse_range"), default=0.0)
        lost = 1 - math.prod(1 - fraction for fraction in _each(faults, "dropout", "fraction"))
        entry = _Sensor(
            name=sensor.name,
            quantity=sensor.quantity,
            target=sensor.target,
            components=components,
            frame=sensor.frame if sensor.quantity not in ("part.position", "part.orientation") else "world",
            clock=_Clock(rate=sensor.rate, skew=math.prod(1 + skew for skew in _each(faults, "clock_skew", "skew")) - 1),
            delay=sum(_each(faults, "delay", "delay")),
            scale=math.prod(1 + error for error in _each(faults, "scale", "relative_error"))
            * math.prod(1 - 2 * flip for flip in _each(faults, "wrong_sign", "flip")),
            bias=sum(_each(faults, "bias", "offset")),
            trend=sum(_each(faults, "drift", "rate")),
            saturation=1 / inverse_range if inverse_range > 0 else None,
            dropout=_Lapses(fraction=min(lost, 0.999)) if lost > 0 else None,
        )
        made += _instruments(entry, rover, clocks)
    result = Instruments(clocks=clocks, sensors=tuple(made), commands=tuple(_logs(_Command(), rover, clocks)))
    _require_unique(result, "the model")
    return result


def _each(faults: Sequence[Effect], kind: str, parameter: str) -> list[float]:
    """A parameter of every fault of a kind: one for all sensors and one for this may come together."""
    values = [fault.parameters.get(parameter, 0.0) for fault in faults if fault.kind == kind]
    return [float(value) for value in values if isinstance(value, int | float)]


def _require_unique(made: Instruments, where: str) -> None:
    names = [column for sensor in made.sensors for column in sensor.columns] + [log.column for log in made.commands]
    for name in names:
        if names.count(name) > 1:
            raise InputRefused(f"{where} records two channels '{name}'; give the sensors different names: name = \"...\"")


def _instruments(entry: _Sensor, rover: Rover, clocks: dict[str, SampleClock]) -> list[Instrument]:
    label = f"sensor '{entry.name or entry.quantity}'"
    quantity = find_quantity(entry.quantity, label)
    targets = _targets(entry.target, _names(rover, quantity.target), quantity.target, label)
    components = _components(entry, quantity, label)
    if entry.frame == "body" and quantity.name in ("part.position", "part.orientation"):
        raise InputRefused(f'{label} gives {quantity.name} in the axes of the body, which is always the same; leave frame = "body" out')
    clock = _find_clock(entry.clock, entry.rate, entry.name or entry.quantity.replace(".", "_"), clocks, label)
    return [_instrument(entry, rover, quantity, target, components, len(targets) > 1, clock, label) for target in targets]


def _instrument(
    entry: _Sensor, rover: Rover, quantity: Quantity, target: str, components: tuple[str, ...], several: bool, clock: str, label: str
) -> Instrument:
    unit = unit_of(quantity, components[0] if components else "")
    if quantity.target == "joint" and {joint.name: joint.kind for joint in rover.joints}[target] == "prismatic":
        unit = quantity.units[1]
    noise = entry.noise if isinstance(entry.noise, _Noise) else _Noise(white=entry.noise)
    coloured = None
    if noise.coloured is not None:
        coloured = (
            _positive(noise.coloured.sigma, unit, f"sigma of the coloured noise of {label}"),
            _positive(noise.coloured.time_constant, "s", f"time constant of the noise of {label}", above_zero=True),
        )
    lower, upper = _range(entry.saturation, unit, label)
    return Instrument(
        columns=tuple(_column(entry.name, quantity, target, component, several, len(components) > 1) for component in components or ("",)),
        quantity=quantity.name,
        target=target,
        clock=clock,
        unit=unit,
        components=components,
        frame=entry.frame,
        written_unit=entry.unit or unit,
        factor=1.0 if entry.unit is None else to_si(f"1 {entry.unit}", unit, f"unit of {label}"),
        delay=_positive(entry.delay, "s", f"delay of {label}"),
        scale=entry.scale,
        bias=to_si(entry.bias, unit, f"bias of {label}"),
        trend=to_si(entry.trend, f"{unit}/s", f"trend of {label}"),
        white=_positive(noise.white, unit, f"noise of {label}"),
        coloured=coloured,
        drift=_positive(noise.drift, f"{unit}/s^0.5", f"drift of {label}"),
        lower=lower,
        upper=upper,
        resolution=_positive(entry.resolution, unit, f"resolution of {label}"),
        dropout=_lapses(entry.dropout, f"dropout of {label}"),
        stuck=tuple(_interval(pair, label) for pair in entry.stuck),
    )


def _logs(entry: _Command, rover: Rover, clocks: dict[str, SampleClock]) -> list[CommandLog]:
    label = "a [[command]]"
    drives = {drive.name: drive for drive in rover.drives}
    names = _targets(entry.drive, list(drives), "drive", label) if drives or entry.drive != "*" else []
    timed = entry.clock is not None or entry.rate is not None
    clock = _find_clock(entry.clock, entry.rate, "commands", clocks, label) if timed else ""
    kinds = {joint.name: joint.kind for joint in rover.joints}
    result = []
    for name in names:
        drive = drives[name]
        quantity = QUANTITIES[COMMAND_QUANTITIES[drive.mode]]
        unit = quantity.units[1 if kinds[drive.joint] == "prismatic" else 0]
        delay = _positive(entry.delay, "s", f"delay of {label}")
        made = CommandLog(
            column=f"{name}_command", drive=name, quantity=quantity.name, target=drive.joint, unit=unit, clock=clock, delay=delay
        )
        result.append(made)
    return result


def _names(rover: Rover, kind: str) -> list[str]:
    """Names of what a quantity can be measured of."""
    if kind == "joint":
        return [joint.name for joint in rover.joints if joint.kind in ("hinge", "prismatic")]
    named = {"part": rover.bodies, "wheel": rover.wheels, "drive": rover.drives}[kind]
    return [one.name for one in named]


def _targets(patterns: str | list[str], known: Sequence[str], kind: str, label: str) -> list[str]:
    found: list[str] = []
    for pattern in [patterns] if isinstance(patterns, str) else patterns:
        some = [name for name in known if name == pattern] or [name for name in known if fnmatch.fnmatchcase(name, pattern)]
        if not some:
            raise InputRefused(f"{label} reads the {kind} '{pattern}', which the model does not have; {nearest_names(pattern, known)}")
        found += [name for name in some if name not in found]
    return found


def _components(entry: _Sensor, quantity: Quantity, label: str) -> tuple[str, ...]:
    stated = [entry.component] if entry.component is not None else entry.components
    if not quantity.components:
        if stated:
            raise InputRefused(f"{label} names the component '{stated[0]}', but {quantity.name} is one number; leave it out")
        return ()
    chosen = tuple(stated or (ANGLES if quantity.name == "part.orientation" else AXES))
    for component in chosen:
        if component not in quantity.components:
            known = ", ".join(quantity.components)
            raise InputRefused(f"{label} names the component '{component}' of {quantity.name}, which has {known}")
    if len({unit_of(quantity, component) for component in chosen}) > 1:
        raise InputRefused(f"{label} mixes angles with numbers of a quaternion; make two sensors of it")
    return chosen


def _column(name: str | None, quantity: Quantity, target: str, component: str, several: bool, vector: bool) -> str:
    """Name of a channel: that of the sensor with what it lacks, else target, quantity and component."""
    if name is not None:
        return "_".join([name, *([target] if several else []), *([component] if vector else [])])
    word = quantity.name.partition(".")[2]
    return f"{target}_{component if component in ANGLES else '_'.join(filter(None, (word, component)))}"


def _find_clock(stated: str | _Clock | None, rate: Number | None, owner: str, clocks: dict[str, SampleClock], label: str) -> str:
    """Name of the clock that an entry asks for; a new one is added to ``clocks``."""
    if isinstance(stated, str):
        if stated not in clocks:
            raise InputRefused(f"{label} is sampled by the clock '{stated}', which no [[clock]] is; {nearest_names(stated, clocks)}")
        if rate is not None:
            raise InputRefused(f"{label} has a rate of its own beside the clock '{stated}'; leave one out")
        return stated
    if stated is None:
        if rate is None:
            raise InputRefused(f'{label} has neither rate nor clock; write for example rate = "100 Hz"')
        name = f"{_positive(rate, 'Hz', f'rate of {label}', above_zero=True):.9g}hz"
        clocks.setdefault(name, _clock(_Clock(rate=rate), name, None))
        return name
    name, count = owner, 2
    while name in clocks:
        name, count = f"{owner}_{count}", count + 1
    clocks[name] = _clock(stated, name, rate)
    return name


def _clock(entry: _Clock, name: str, rate: Number | None) -> SampleClock:
    label = f"clock '{name}'"
    stated = entry.rate if entry.rate is not None else rate
    if stated is None:
        raise InputRefused(f'{label} has no rate; write for example rate = "100 Hz"')
    skew = to_si(entry.skew, "1", f"skew of {label}")
    if abs(skew) > 0.5:
        raise InputRefused(f"{label} has a skew of {skew:g}; a clock is off by less than 0.5, typically by 2e-5")
    return SampleClock(
        name=name,
        rate=_positive(stated, "Hz", f"rate of {label}", above_zero=True),
        jitter=_positive(entry.jitter, "s", f"jitter of {label}"),
        phase=_positive(entry.phase, "s", f"phase of {label}"),
        stamp=entry.stamp,
        offset=to_si(entry.offset, "s", f"offset of {label}"),
        skew=skew,
        gaps=_lapses(entry.gaps, f"gaps of {label}"),
    )


def _lapses(entry: _Lapses | None, label: str) -> Lapses | None:
    if entry is None or entry.fraction == 0:
        return None
    return Lapses(fraction=entry.fraction, mean_length=_positive(entry.mean_length, "s", f"mean length of the {label}"))


def _range(stated: Number | list[Number] | None, unit: str, label: str) -> tuple[float, float]:
    what = f"saturation of {label}"
    if stated is None:
        return -math.inf, math.inf
    if not isinstance(stated, list):
        upper = _positive(stated, unit, what, above_zero=True)
        return -upper, upper
    if len(stated) != 2 or (ends := [to_si(end, unit, what) for end in stated])[0] >= ends[1]:
        raise InputRefused(f"{what} is {stated}; give one largest value, or the lower and the upper end")
    return ends[0], ends[1]


def _interval(pair: list[Number], label: str) -> tuple[float, float]:
    what = f"time in which {label} is stuck"
    if len(pair) != 2 or (ends := [to_si(end, "s", what) for end in pair])[0] >= ends[1]:
        raise InputRefused(f'{what} is {pair}; give its begin and end, for example ["2 s", "3 s"]')
    return ends[0], ends[1]


def _positive(value: Number, unit: str, what: str, *, above_zero: bool = False) -> float:
    number = to_si(value, unit, what)
    if number < 0 or (above_zero and number == 0):
        raise InputRefused(f"{what} is {number:g} {unit}; it must {'be above 0' if above_zero else 'not be negative'}")
    return number
