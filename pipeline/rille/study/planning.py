"""A study sheet and its subject -> plan, cases, and what workers must be told."""

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
from rille.study.matching import matching
from rille.study.names import Meaning, Subject, meaning
from rille.study.sheet import Number, StudySheet, VarySheet
from rille.study.together import require_together

MOST_CASES = 1_000_000
MOST_INSTANTS = 100_000  # of a trace
SCENARIO_BOUNDS = {"step": (1e-9, 0.1), "duration": (1e-9, 1e9), "gravity": (1e-9, 1e9)}  # s, s, m/s^2; the upper step as in the solver


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
    InputRefused : for a name, value, unit, bound or design that cannot be, and for what could change nothing, or the same number twice.
    """
    factors = tuple(_factor(entry, subject) for entry in sheet.vary)
    names = [factor.name for factor in factors] + list(sheet.set)
    for name in names:
        if names.count(name) > 1:
            raise InputRefused(f"'{name}' is given twice; vary it once, or set it")
    constants = []
    named = [(f.name, f.changes, f.spread != "values" or any(f.values)) for f in factors]
    for name, value in sheet.set.items():
        meant = meaning(name, subject, relative=False)
        number = _si(value, meant, name, relative=False)
        _require_within(name, meant, subject, (number,), relative=False)
        constants += [(change, number) for change in meant.changes]
        named.append((name, meant.changes, number != 0))
    require_together(named, subject.effects)
    duration = _longest(factors, constants, subject)
    channels = channel_measures(sheet.outcome, parts, duration)
    all_measures = _marked([*measures, *(measure for _, measure in channels)], sheet.main)
    traced = traced_channels(sheet.trace, parts)
    plan = StudyPlan(
        name=sheet.name,
        design=sheet.design,
        samples=0 if sheet.design == "grid" else sheet.samples or _usual_samples(sheet, len(factors)),
        seed=sheet.seed,
        second_order=sheet.second_order and sheet.design == "sobol",
        factors=factors,
        measures=all_measures,
        traced=traced,
        trace_time=_trace_time(sheet.trace_interval, duration) if traced else (),
        sheet=sha256(json.dumps(sheet.model_dump(exclude={"model", "scenario", "terrain"}), sort_keys=True).encode()).hexdigest(),
    )
    cases = design_cases(plan, sheet.levels, MOST_CASES)
    return Asked(plan=plan, cases=cases, constants=tuple(constants), channels=tuple(channel for channel, _ in channels))


def _trace_time(given: Number, duration: float) -> tuple[float, ...]:
    """Instants [s] from 0 to the last one within the duration."""
    interval = to_si(given, "time", "trace_interval")
    if not duration / MOST_INSTANTS <= interval <= duration:
        least = duration / MOST_INSTANTS
        raise InputRefused(f"trace_interval is {interval:g} s; it must lie in {least:g} to {duration:g} s, the duration")
    count = math.floor(duration / interval * (1 + 1e-12))
    return tuple(interval * k for k in range(count + 1))


def _longest(factors: Sequence[Factor], constants: Sequence[tuple[Change, float]], subject: Subject) -> float:
    """Longest simulated time of a case [s]."""
    given = [(change, value) for change, value in constants]
    given += [(change, value) for f in factors for change in f.changes for value in (*f.values, f.high, f.mean)]
    own = subject.scenario.duration
    times = [value * (own if c.relative else 1) for c, value in given if (c.kind, c.name) == ("scenario", "duration")]
    return max(times, default=own)


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

    unit = "-" if entry.relative else meant.unit
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
    bare = relative or meant.unit == "-" or "(n+" in meant.unit
    return to_si(value, "dimensionless" if bare else meant.unit, what)


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
            now, lower, upper = subject.scenario_value(change.name), *SCENARIO_BOUNDS[change.name]
        else:
            continue
        for value in values:
            number = now * value if relative else value
            if not lower <= number <= upper:
                what = change.number or change.name
                raise InputRefused(f"'{name}' is {number:g} in some cases; {what} must lie in {lower:g} to {upper:g}: take values within")


def _marked(measures: list[Measure], main: Sequence[str]) -> tuple[Measure, ...]:
    """Measures with those marked that the sheet wants first; where it names none, the usual ones and its own stay marked."""
    known = [measure.name for measure in measures]
    for name in known:
        if known.count(name) > 1:
            raise InputRefused(f"two outcomes are called '{name}'; give one of them another name")
    wanted = set()
    for name in main:
        matched = matching(name, known)
        if not matched:
            raise InputRefused(f"main names the outcome '{name}', which this study does not have; {nearest_names(name, known)}")
        wanted |= set(matched)
    return tuple(replace(m, main=m.name in wanted) for m in measures) if wanted else tuple(measures)
