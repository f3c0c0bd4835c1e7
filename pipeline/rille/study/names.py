"""Names of what can vary -> what they change, and their units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rille.model import EffectKind, InputRefused, Scenario, nearest_names
from rille.model.study import Change
from rille.study.matching import matching

UNITS = {  # of parameters, by the first word of the name and the last
    **{("soil", word): "-" for word in ("sinkage_exponent", "peak_angle_offset", "peak_angle_slip", "exit_sinkage_ratio")},
    **{("soil", f"reece_{word}_modulus"): "-" for word in ("cohesive", "frictional")},
    ("soil", "cohesive_modulus"): "N/m^(n+1)",
    ("soil", "frictional_modulus"): "N/m^(n+2)",
    ("soil", "cohesion"): "Pa",
    ("soil", "friction_angle"): "rad",
    ("soil", "shear_modulus"): "m",
    ("soil", "lateral_shear_modulus"): "m",
    ("soil", "damping"): "Pa s/m",
    ("soil", "unit_weight"): "N/m^3",
    ("body", "mass"): "kg",
    **{("body", f"com_{axis}"): "m" for axis in "xyz"},
    **{("body", f"i{axis}{axis}"): "kg m^2" for axis in "xyz"},
    ("wheel", "radius"): "m",
    ("wheel", "width"): "m",
    ("track_width", "track_width"): "m",
    ("drive", "max_torque"): "N m",
    ("drive", "position_gain"): "1/s",
    ("drive", "integral_gain"): "N m/rad",
    ("drive", "speed_gain"): "N m s/rad",
    **{("gravity", axis): "m/s^2" for axis in "xyz"},
}
SLIDING = {"N m": "N", "N m/rad": "N/m", "N m s/rad": "N s/m", "rad/s": "m/s", "rad": "m"}  # the same of a drive that slides
SCENARIO = {"step": "s", "duration": "s", "gravity": "m/s^2"}
START = {"x": "m", "y": "m", "heading": "rad"}
PLACE = {"x": "m", "y": "m", "heading": "rad", "scale": "-", "age": "-"}
BASE = {"slope": "rad", "direction": "rad", "hurst": "-", "median_slope": "rad", "seed": "-"}
KEYS_OF_BASE = {"plane": ("slope", "direction"), "fractal": ("hurst", "median_slope", "seed")}  # that change its ground
COMMAND = {"speed": "rad/s", "position": "rad", "torque": "N m"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What a study is about, as far as names go.

    bounds : of every parameter of the solver, (value, lower, upper). drives : mode of each; sliding : those whose joint slides.
    ground : tables of the scene that is varied; None: none. drivers : (landform's name, driver) -> unit. targets : names by kind of
    effect target.
    """

    bounds: Mapping[str, tuple[float, float, float]]
    drives: Mapping[str, str]
    scenario: Scenario
    effects: Sequence[EffectKind]
    sliding: frozenset[str] = frozenset()
    ground: Mapping[str, Any] | None = None
    drivers: Mapping[tuple[str, str], str] = field(default_factory=dict)
    targets: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def scenario_value(self, key: str) -> float:
        """What the scenario has of ``scenario.KEY`` [SI]."""
        return -self.scenario.gravity[2] if key == "gravity" else getattr(self.scenario, key)


@dataclass(frozen=True, slots=True, kw_only=True)
class Meaning:
    """What a name means. unit : of its value [SI]."""

    changes: tuple[Change, ...]
    unit: str


def meaning(name: str, subject: Subject, relative: bool) -> Meaning:
    """What a name changes.

    name : a parameter of the model, or a pattern of several (``wheel.*.radius``); ``scenario.step``, ``duration``, ``gravity``;
        ``start.x``, ``y``, ``heading``; ``command.DRIVE`` or ``command.DRIVE@TIME``, TIME in s; ``effect.LAW.TARGET.NUMBER``;
        ``landform.NAME.KEY`` and ``base.KEY`` of the scene.

    Raises
    ------
    InputRefused : with the nearest names; for a pattern of numbers in several units, unless it is relative.
    """
    if name in subject.bounds:
        return Meaning(changes=(_parameter(name, relative),), unit=_unit(name, subject))
    first, _, rest = name.partition(".")
    if first in ("scenario", "start"):
        return _of_scenario(name, first, rest, subject, relative)
    if first == "command":
        return _of_command(name, rest, subject, relative)
    if first in ("landform", "base"):
        return _of_ground(name, first, rest, subject, relative)
    if first == "effect":
        return _of_effect(name, rest, subject, relative)
    matched = matching(name, subject.bounds)
    if not matched:
        raise InputRefused(f"nothing is called '{name}' in this study; {nearest_names(name, _all_names(subject))}")
    unit = _common_unit(name, {one: _unit(one, subject) for one in matched}, relative)
    return Meaning(changes=tuple(_parameter(one, relative) for one in matched), unit=unit)


def _parameter(name: str, relative: bool) -> Change:
    return Change(kind="parameter", name=name, relative=relative)


def _common_unit(name: str, units: Mapping[str, str], relative: bool) -> str:
    """The unit of all that a pattern meets. units : by name."""
    example = {unit: one for one, unit in units.items()}
    if len(example) > 1 and not relative:
        found = ", ".join(f"{one} [{unit}]" for unit, one in example.items())
        raise InputRefused(f"'{name}' means numbers in several units: {found}; name those of one unit, or write relative = true")
    return next(iter(example))


def _unit(name: str, subject: Subject) -> str:
    first, last = name.partition(".")[0], name.rpartition(".")[2]
    if first == "effect":
        kind = name.split(".")[1]
        return _dimension(next((p.unit for e in subject.effects if e.name == kind for p in e.parameters if p.name == last), "-"))
    unit = UNITS.get((first, last), "-")
    sliding = first == "drive" and name.removeprefix("drive.").removesuffix(f".{last}") in subject.sliding
    return SLIDING.get(unit, unit) if sliding else unit


def _dimension(unit: str) -> str:
    """As studies write units: registers of effects and landforms have other words for a number without one."""
    return "-" if unit in ("1", "dimensionless") else unit


def _all_names(subject: Subject) -> list[str]:
    names = [*subject.bounds, *(f"scenario.{key}" for key in SCENARIO), *(f"start.{key}" for key in START)]
    names += [f"command.{drive}" for drive in subject.drives]
    names += [f"effect.{kind.name}.*.{p.name}" for kind in subject.effects for p in kind.parameters]
    return names


def _known(word: str, known: Mapping[str, Any] | Sequence[str], name: str, what: str) -> None:
    if word not in known:
        raise InputRefused(f"'{name}' names the {what} '{word}', which is not there; {nearest_names(word, known)}")


def _of_scenario(name: str, first: str, key: str, subject: Subject, relative: bool) -> Meaning:
    known = SCENARIO if first == "scenario" else START
    _known(key, known, name, "key")
    scenario = subject.scenario
    if key == "gravity" and (scenario.gravity[:2] != (0.0, 0.0) or scenario.gravity[2] == 0):
        raise InputRefused(f"'{name}' needs gravity along -z that is not 0; it is {scenario.gravity} m/s^2: vary gravity.x, .y or .z")
    tilted = any(abs(component) > 1e-12 for component in scenario.start.rotation[1:3])
    if first == "start" and tilted and scenario.placement == "as_given":
        raise InputRefused(f"'{name}' cannot vary: the scenario starts tilted as given; place it on the terrain")
    return Meaning(changes=(Change(kind=first, name=key, relative=relative),), unit=known[key])  # type: ignore[arg-type]


def _of_command(name: str, rest: str, subject: Subject, relative: bool) -> Meaning:
    pattern, at, time = (rest, "", "") if matching(rest, subject.drives) or "@" not in rest else rest.rpartition("@")
    matched = matching(pattern, subject.drives)
    if not matched:
        raise InputRefused(f"'{name}' names the drive '{pattern}', which is not there; {nearest_names(pattern, subject.drives)}")
    try:
        wanted = float(time) if at else None
    except ValueError:
        raise InputRefused(f"'{name}' ends in no time; write the number of seconds, such as command.{pattern}@8") from None
    changes = []
    for drive in matched:
        given = sorted(command.time for command in subject.scenario.commands if command.drive == drive)
        places = [k for k, t in enumerate(given) if wanted is None or abs(t - wanted) < 1e-9]
        if not places or (len(places) > 1 and not relative):
            times = ", ".join(f"{t:g}" for t in given) or "none"
            raise InputRefused(f"'{name}' means no single command of drive '{drive}', whose times are {times} s; write @TIME, or relative")
        changes += [Change(kind="command", name=drive, number=str(k), relative=relative) for k in places]
    units = {drive: COMMAND[subject.drives[drive]] for drive in matched}
    units = {drive: SLIDING[unit] if drive in subject.sliding else unit for drive, unit in units.items()}
    return Meaning(changes=tuple(changes), unit=_common_unit(name, units, relative))


def _of_effect(name: str, rest: str, subject: Subject, relative: bool) -> Meaning:
    law, _, more = rest.partition(".")
    target, _, number = more.rpartition(".")
    kinds = {kind.name: kind for kind in subject.effects}
    _known(law, kinds, name, "law")
    if not target:
        raise InputRefused(f"'{name}' does not say where; write effect.{law}.TARGET.NUMBER, TARGET * for every one")
    numbers = {parameter.name: parameter.unit for parameter in kinds[law].parameters}
    _known(number, numbers, name, "number")
    targets = subject.targets.get(kinds[law].target)
    if target != "*" and targets is not None:
        _known(target, targets, name, kinds[law].target)
    if relative:
        raise InputRefused(f"'{name}' is relative to an effect that the model does not have; give its value")
    _require_alone(name, law, target, number, subject)
    change = Change(kind="effect", name=law, target=target, number=number)
    return Meaning(changes=(change,), unit=_dimension(numbers[number]))


def _require_alone(name: str, law: str, target: str, number: str, subject: Subject) -> None:
    """Refuse what would add an effect to wheels, joints or bodies that have it already."""
    begin = f"effect.{law}."
    there = dict.fromkeys(one.removeprefix(begin).rpartition(".")[0] for one in subject.bounds if one.startswith(begin))
    if there and (target == "*" or "*" in there):
        own = ", ".join(f"{begin}{other}.{number}" for other in there)
        raise InputRefused(f"'{name}' would add a second {law} to that of the model; vary the model's own: {own}")


def _of_ground(name: str, first: str, rest: str, subject: Subject, relative: bool) -> Meaning:
    if subject.ground is None:
        raise InputRefused(f"'{name}' needs the scene of the ground; give the study a terrain = \"SCENE.toml\"")
    if relative:
        raise InputRefused(f"'{name}' cannot be relative; give its values")
    if first == "base":
        _known(rest, BASE, name, "key")
        kind = subject.ground["base"]["kind"]
        if rest not in KEYS_OF_BASE.get(kind, ()):
            has = ", ".join(f"base.{key}" for key in KEYS_OF_BASE.get(kind, ())) or "nothing of it"
            raise InputRefused(f"'{name}' changes nothing of a base that is {kind}; {has} can vary")
        return Meaning(changes=(Change(kind="ground", name="base", number=rest),), unit=BASE[rest])
    placed = {entry["name"]: entry for entry in subject.ground.get("landform", [])}
    target, _, key = rest.rpartition(".")
    _known(target, placed, name, "landform")
    known = {driver: unit for (landform, driver), unit in subject.drivers.items() if landform == target}
    _known(key, PLACE | known, name, "driver")
    change = Change(kind="ground", name=target, number=key)
    return Meaning(changes=(change,), unit=_dimension(PLACE.get(key) or known[key]))
