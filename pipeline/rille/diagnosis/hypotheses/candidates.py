"""Everything that may be wrong: each law of the catalogue at each target where it means something, each number of the model, each sensor.

Nothing here knows a law by name. What a law acts on, what it needs there, which of its numbers vanish with it and how the others are looked
for, is the catalogue's to say; how large its numbers usually are on this machine, ``natural`` says.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from difflib import get_close_matches

from rille.diagnosis.hypotheses.natural import Natural, Scales, factor_of, matters, moving_bodies, natural, size_of
from rille.diagnosis.hypotheses.parameter_hypotheses import MOST_SPREADS, parameter_hypotheses
from rille.diagnosis.hypotheses.sensor_hypotheses import sensor_hypotheses, shifts
from rille.diagnosis.hypotheses.shape_tries import EVERY_ORDER
from rille.model import InputRefused
from rille.model.diagnosis import Location
from rille.model.effect import EffectKind, EffectParameter
from rille.model.hypothesis import FreeNumber, Hypothesis, Search
from rille.model.machine import Machine
from rille.model.recording import Channel

LARGEST_SHARE = 0.3  # of what the machine's own scale is: a larger trial stalls it and says nothing about a small amount
FEW_BODIES = 3
FAR = 100.0  # numbers that are looked for over decades stay within this factor of their usual value, or of their spread above it
SHORT = 0.25  # of the time that was recorded: what lasts longer belongs to no moment
SLOW_MOMENTS = 3.0  # times slower than at its fastest is a joint at many moments


def candidates(
    machine: Machine, channels: Sequence[Channel], kinds: Sequence[EffectKind], location: Location | None = None
) -> tuple[Hypothesis, ...]:
    """Hypotheses about a machine and its recordings: effects first, then numbers of the model, then sensors.

    An effect that the model has already at a target is not proposed there again: its numbers are parameters.

    Parameters
    ----------
    machine : facts of the model. channels : of one or more recordings, better with samples: the natural scales are read from them, and
        sensor faults are proposed for the observed ones, once each by name.
    kinds : the catalogue. location : what is known about where and when; None: nothing. Laws of a moment are proposed at every target
        where the difference is short or nothing is known, else at the root alone; laws of a place at the root.
    """
    scales = natural(machine, channels)
    found = [
        _hypothesis(machine, kind, target, scales, location)
        for kind in kinds
        if kind.target in ("wheel", "joint", "body", "terrain", "world")
        for target in _targets(machine, kind, location)
    ]
    return (*found, *parameter_hypotheses(machine, kinds, scales), *sensor_hypotheses(channels, kinds))


def _targets(machine: Machine, kind: EffectKind, location: Location | None) -> list[str]:
    """Names of targets where the law means something; '*' beside them where several of one kind may share it; '' of the ground or world."""
    if kind.needs in ("soft_ground", "grousers") and not machine.soft_ground:
        return []
    if kind.needs == "gravity" and machine.gravity <= 0:
        return []
    short = location is None or location.shape == "transient"
    momentary = any(p.search == "time" for p in kind.parameters)
    taken = {effect.target for effect in machine.effects if effect.kind == kind.name}
    if kind.target in ("terrain", "world"):
        return [] if taken and kind.target == "world" else [""]
    if kind.target == "body":
        return [name for name in _bodies(machine, kind, short) if name not in taken and "*" not in taken]
    if kind.target == "wheel":
        known = [w.name for w in machine.wheels]
        soft = kind.needs in ("soft_ground", "grousers")
        fit = [w.name for w in machine.wheels if (w.soft or not soft) and (kind.needs != "grousers" or w.grouser_count > 0)]
        fit = fit if machine.has_ground or machine.soft_ground else []
    else:
        if momentary and not short and _is_large(machine):
            return []
        driven = {drive.joint for drive in machine.drives}
        known = [j.name for j in machine.joints if j.kind in ("hinge", "prismatic")]
        fit = [name for name in known if kind.needs != "drive" or name in driven]
    if "*" in taken:
        return []
    shared = (
        not momentary and len(fit) > 1 and 2 * len(taken) < len(fit) and (kind.needs != "grousers" or len(fit) == len(known))
    )  # '*' must suit all
    return [name for name in fit if name not in taken] + (["*"] if shared else [])


def _bodies(machine: Machine, kind: EffectKind, short: bool) -> list[str]:
    """Bodies that move and matter; of laws that belong to a moment or a place only the root of larger machines, unless the difference is
    short.
    """
    bodies = matters(machine, moving_bodies(machine))
    local = any(p.search == "place" or (p.search == "time" and not short) for p in kind.parameters)
    return [machine.root] if local and _is_large(machine) else bodies


def _is_large(machine: Machine) -> bool:
    """Whether laws of a moment or a place cannot be tried at all of its targets: a vehicle of many bodies."""
    return bool(machine.root) and len(matters(machine, moving_bodies(machine))) > FEW_BODIES


def _hypothesis(machine: Machine, kind: EffectKind, target: str, scales: Natural, location: Location | None) -> Hypothesis:
    placed = any(p.search == "place" for p in kind.parameters)
    free = [_free(machine, kind, p, target, scales, location, placed) for p in kind.parameters if p.search != "fixed"]
    return Hypothesis(
        cause="effect",
        kind=kind.name,
        target=target,
        target_kind=kind.target,
        free=tuple(free),
        fixed={p.name: _usual(kind, p, target, scales) for p in kind.parameters if p.search == "fixed"},
        memory=kind.memory,
        passive=kind.passive,
    )


def _usual(kind: EffectKind, parameter: EffectParameter, target: str, scales: Natural) -> float:
    """Usual value of a number of a law on this machine."""
    value = parameter.typical * factor_of(parameter.unit, kind.target, scales.at(kind.target, target))
    return min(max(value, parameter.lower), parameter.upper)


def _free(
    machine: Machine, kind: EffectKind, parameter: EffectParameter, target: str, scales: Natural, location: Location | None, placed: bool
) -> FreeNumber:
    here = scales.at(kind.target, target)
    factor = factor_of(parameter.unit, kind.target, here)
    if placed and not parameter.amplitude and kind.target == "body" and parameter.unit == "m":
        factor = scales.extent / 16.0  # a length on the map, not of the body
    number = FreeNumber(
        name=parameter.name,
        unit=parameter.unit,
        amplitude=parameter.amplitude,
        lower=parameter.lower,
        upper=parameter.upper,
        start=parameter.typical * factor,
        spread=parameter.spread * factor,
        search=_search(parameter),
    )
    if parameter.amplitude:
        number = _within_machine(number, kind, here, machine, target)
        if number.unit == "rad":  # an angle is as large on every machine
            number = replace(number, believed=MOST_SPREADS * number.spread)
        return replace(number, tries=shifts(number.lower, number.upper, scales.interval)) if number.unit == "s" else number
    if number.search == "place":
        return _on_track(number, scales)
    if number.search == "time":
        return _in_time(number, scales, location)
    if number.search == "scale":
        lower, upper = max(number.lower, number.start / FAR), min(number.upper, max(number.start, number.spread) * FAR)
        if number.unit == "s" and any(p.search == "time" for p in kind.parameters):
            upper = max(lower, min(upper, SHORT * (scales.span[1] - scales.span[0])))
        return replace(number, lower=lower, upper=upper, start=min(max(number.start, lower), upper))
    if number.search == "order" and "s" in here:
        slow = here["s"] * SLOW_MOMENTS
        fastest = 3.0 * slow / max(scales.interval, 1e-6)  # half a turn of its phase from one sample to the next
        upper = min(parameter.upper, max(EVERY_ORDER, round(fastest)))  # where it starts from rest, every one of these is slow
        return replace(number, upper=upper, start=min(number.start, upper))
    return replace(number, start=min(max(number.start, number.lower), number.upper))


def _search(parameter: EffectParameter) -> Search:
    words: dict[str, Search] = {"scale": "scale", "phase": "phase", "order": "order", "place": "place", "time": "time"}
    return words.get(parameter.search, "local")


def _within_machine(number: FreeNumber, kind: EffectKind, here: Scales, machine: Machine, target: str) -> FreeNumber:
    """An amplitude whose trial is a small part of what the machine has, and whose mass is part of its body's."""
    whole = None if number.unit in ("1", "rad") else size_of(number.unit, here)
    spread = number.spread if whole is None else min(number.spread, LARGEST_SHARE * whole)
    start = number.start if whole is None else max(-LARGEST_SHARE * whole, min(number.start, LARGEST_SHARE * whole))
    lower, upper = number.lower, number.upper
    if number.unit == "kg" and kind.target == "body":
        mass = next(b.mass for b in machine.bodies if b.name == target)
        lower = max(lower, -0.9 * mass)
        upper = 0.9 * mass if number.lower >= 0 else min(upper, 20 * mass)  # what cannot be negative is a part of the body
    return replace(number, lower=lower, upper=upper, start=min(max(start, lower), upper), spread=spread)


def _on_track(number: FreeNumber, scales: Natural) -> FreeNumber:
    """A coordinate on the map: about the track, whose last letter says which axis."""
    axis = "xyz".find(number.name[-1])
    reach = scales.extent
    if axis < 0 or not len(scales.track):
        return replace(number, lower=-reach, upper=reach, start=0.0, spread=0.5 * reach)
    low, high = float(scales.track[:, axis].min()), float(scales.track[:, axis].max())
    return replace(number, lower=low - reach, upper=high + reach, start=0.5 * (low + high), spread=max(0.25 * (high - low), 0.1 * reach))


def _in_time(number: FreeNumber, scales: Natural, location: Location | None) -> FreeNumber:
    """A moment: that of the first span that differs, else the middle of the recordings."""
    first, last = scales.span
    spans = location.spans if location is not None else ()
    start = min(max(spans[0].start, first), last) if spans else 0.5 * (first + last)
    return replace(number, lower=first, upper=last, start=start, spread=max(0.1 * (last - first), 1e-3))


def of_kind(hypotheses: Iterable[Hypothesis], only: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[Hypothesis, ...]:
    """Those whose kind, cause or target is among ``only`` (all if empty) and not among ``without``."""
    return tuple(h for h in hypotheses if (not only or _words(h) & set(only)) and not _words(h) & set(without))


def require_known(
    hypotheses: Sequence[Hypothesis], kinds: Sequence[EffectKind], only: Sequence[str] = (), without: Sequence[str] = ()
) -> None:
    """Refuse a choice of ``of_kind`` that means nothing.

    Raises
    ------
    InputRefused : for a name that is no kind, cause or target of a hypothesis here, nor a kind of the catalogue; if nothing is left to try.
    """
    known = set().union({kind.name for kind in kinds}, *(_words(h) for h in hypotheses))
    for option, names in (("--only", only), ("--without", without)):
        for name in names:
            if name not in known:
                like = get_close_matches(name, sorted(known), n=3)
                hint = f"did you mean {', '.join(like)}?" if like else "`rille effects` lists the kinds of physics"
                raise InputRefused(
                    f"{option} '{name}' is no kind, cause (effect, parameter, sensor) or target that could be tried here; {hint}"
                )
    if not of_kind(hypotheses, only, without):
        said = " ".join([*(f"--only {name}" for name in only), *(f"--without {name}" for name in without)])
        raise InputRefused(f"{said} leaves nothing to try of {len(hypotheses)} hypotheses; choose fewer")


def _words(hypothesis: Hypothesis) -> set[str]:
    return {hypothesis.kind, hypothesis.cause, hypothesis.target}
