"""A study sheet and its subject -> plan, cases, and what workers must be told."""

import fnmatch
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si
from rille.model.study import Case, Change, ChannelMeasure, Factor, Measure, StudyPlan
from rille.study.channels import channel_measures, traced_channels
from rille.study.design import design_cases
from rille.study.names import Meaning, Subject, meaning
from rille.study.sheet import Number, StudySheet, VarySheet

MOST_CASES = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A study that can begin.

    constants : changes that all cases have, with their values. channels : outcomes that are channels reduced to numbers.
    """

    plan: StudyPlan
    cases: tuple[Case, ...]
    constants: tuple[tuple[Change, float], ...]
    channels: tuple[ChannelMeasure, ...]


def plan_study(sheet: StudySheet, subject: Subject, measures: Sequence[Measure], *, parts: Mapping[str, Sequence[str]]) -> Asked:
    """Make of a sheet what can be carried out.

    Parameters
    ----------
    subject : the model that names are of. measures : outcomes that every such model has. parts : names of joints, parts, wheels and
        motors, by the first word of a channel's quantity.

    Raises
    ------
    InputRefused : for a name, value, unit, bound or design that cannot be.
    """
    factors = tuple(_factor(entry, subject) for entry in sheet.vary)
    names = [factor.name for factor in factors] + list(sheet.set)
    for name in names:
        if names.count(name) > 1:
            raise InputRefused(f"'{name}' is given twice; vary it once, or set it")
    constants = []
    for name, value in sheet.set.items():
        meant = meaning(name, subject, relative=False)
        number = _si(value, meant, name, relative=False)
        _require_within(name, meant, subject, (number,), relative=False)
        constants += [(change, number) for change in meant.changes]
    duration = _longest(factors, constants, subject)
    channels = channel_measures(sheet.outcome, parts, duration)
    all_measures = _marked([*measures, *(measure for _, measure in channels)], sheet.main)
    interval = to_si(sheet.trace_interval, "time", "trace_interval")
    if not 0 < interval <= duration:
        raise InputRefused(f"trace_interval is {interval:g} s; it must lie above 0 and within the duration of {duration:g} s")
    traced = traced_channels(sheet.trace, parts)
    count = round(duration / interval)
    plan = StudyPlan(
        name=sheet.name,
        design=sheet.design,
        samples=0 if sheet.design == "grid" else sheet.samples or _usual_samples(sheet, len(factors)),
        seed=sheet.seed,
        second_order=sheet.second_order and sheet.design == "sobol",
        factors=factors,
        measures=all_measures,
        traced=traced,
        trace_time=tuple(interval * k for k in range(count + 1)) if traced else (),
        sheet=sha256(json.dumps(sheet.model_dump(exclude={"model", "scenario", "terrain"}), sort_keys=True).encode()).hexdigest(),
    )
    cases = design_cases(plan, sheet.levels, MOST_CASES)
    return Asked(plan=plan, cases=cases, constants=tuple(constants), channels=tuple(channel for channel, _ in channels))


def _longest(factors: Sequence[Factor], constants: Sequence[tuple[Change, float]], subject: Subject) -> float:
    """Longest simulated time of a case [s]."""
    given = [(change, value) for change, value in constants]
    given += [(change, value) for f in factors for change in f.changes for value in (*f.values, f.high, f.mean)]
    times = [value * (subject.scenario.duration if c.relative else 1) for c, value in given if (c.kind, c.name) == ("scenario", "duration")]
    return max(times, default=subject.scenario.duration)


def _usual_samples(sheet: StudySheet, factors: int) -> int:
    """Base samples where the sheet names none."""
    return 64 if sheet.design == "sobol" else max(100, 20 * factors)


def _factor(entry: VarySheet, subject: Subject) -> Factor:
    name = entry.name
    meant = meaning(name, subject, entry.relative)
    given = {key for key in ("low", "high", "mean", "sigma", "values") if getattr(entry, key) is not None}
    if given not in ({"low", "high"}, {"mean", "sigma"}, {"values"}):
        raise InputRefused(f"'{name}' has {', '.join(sorted(given)) or 'nothing'}; give low and high, or mean and sigma, or values")
    if entry.log and given != {"low", "high"}:
        raise InputRefused(f"'{name}' is log, which belongs to low and high")

    def si(value: Number | None, key: str) -> float:
        assert value is not None
        return _si(value, meant, f"{key} of '{name}'", entry.relative)

    unit = "-" if entry.relative else _unit(meant, entry)
    factor = Factor(name=name, unit=unit, spread="values", relative=entry.relative, changes=meant.changes)
    if "low" in given:
        low, high = si(entry.low, "low"), si(entry.high, "high")
        if not low < high or (entry.log and low <= 0):
            raise InputRefused(f"'{name}' goes from {low:g} to {high:g} {unit}; low must be below high{', and above 0' * entry.log}")
        factor = replace(factor, spread="log" if entry.log else "uniform", low=low, high=high)
        reach = (low, high)
    elif "mean" in given:
        mean, sigma = si(entry.mean, "mean"), si(entry.sigma, "sigma")
        if not sigma > 0:
            raise InputRefused(f"sigma of '{name}' is {sigma:g} {unit}; it must be above 0")
        factor = replace(factor, spread="normal", mean=mean, sigma=sigma)
        reach = (mean,)
    else:
        reach = tuple(si(value, "a value") for value in entry.values or ())
        if len(set(reach)) < len(reach):
            raise InputRefused(f"'{name}' has a value twice; give each once")
        factor = replace(factor, values=reach)
    _require_within(name, meant, subject, reach, entry.relative)
    return factor


def _si(value: Number, meant: Meaning, what: str, relative: bool) -> float:
    """SI number; of moduli, whose units hang on an exponent, as it is."""
    if relative:
        return to_si(value, "dimensionless", what)
    refusals = []
    for unit in meant.units:
        if unit in ("-", "1") or "(n+" in unit:
            return to_si(value, "dimensionless", what)
        try:
            return to_si(value, unit, what)
        except InputRefused as refusal:
            refusals.append(refusal)
    raise refusals[0]


def _unit(meant: Meaning, entry: VarySheet) -> str:
    """Of several units the one that the values are written in."""
    value = next(v for v in (entry.low, entry.mean, *(entry.values or [])) if v is not None)
    for unit in meant.units:
        try:
            _si(value, Meaning(changes=(), units=(unit,)), "", relative=False)
        except InputRefused:
            continue
        return "-" if unit == "1" else unit
    return meant.units[0]


def _require_within(name: str, meant: Meaning, subject: Subject, values: Sequence[float], relative: bool) -> None:
    """Ends and values that the model would refuse are refused before the first case."""
    for change in meant.changes:
        if change.kind == "parameter":
            now, lower, upper = subject.bounds[change.name]
        elif change.kind == "effect":
            law = next(kind for kind in subject.effects if kind.name == change.name)
            number = next(p for p in law.parameters if p.name == change.number)
            now, lower, upper = 0.0, number.lower, number.upper
        elif change.kind == "scenario":
            now, lower, upper = 1.0, math.nextafter(0, 1), 0.1 if change.name == "step" else math.inf
        else:
            continue
        for value in values:
            number = now * value if relative else value
            if not lower <= number <= upper:
                raise InputRefused(f"'{name}' is {number:g} in some cases; {change.name} must lie in {lower:g} to {upper:g}")


def _marked(measures: list[Measure], main: Sequence[str]) -> tuple[Measure, ...]:
    """Measures with those marked that the sheet wants first; where it names none, the usual ones and its own stay marked."""
    known = [measure.name for measure in measures]
    for name in known:
        if known.count(name) > 1:
            raise InputRefused(f"two outcomes are called '{name}'; give one of them another name")
    wanted = set()
    for name in main:
        matched = fnmatch.filter(known, name)
        if not matched:
            raise InputRefused(f"main names the outcome '{name}', which this study does not have; {nearest_names(name, known)}")
        wanted |= set(matched)
    return tuple(replace(m, main=m.name in wanted) for m in measures) if wanted else tuple(measures)
