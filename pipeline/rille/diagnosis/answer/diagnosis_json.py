"""A diagnosis as JSON and back, and as text.

The keys are the fields of ``rille.model.diagnosis``, where meaning and unit of each are stated; what could not be told (NaN, infinite) is
null. A place in it, "ranked[0].gain", is what the numbers of the report refer to.
"""

import math
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from rille.model import InputRefused
from rille.model.diagnosis import VERDICTS, Diagnosis, RankedHypothesis
from rille.model.hypothesis import Setting, Term

T = TypeVar("T")
TITLES = {
    "nothing_missing": "nothing missing",
    "named": "named",
    "group": "named up to a group",
    "parameter": "a wrong parameter",
    "sensor_fault": "a sensor fault",
    "unknown": "something without a name",
    "cannot_know": "cannot be told",
}


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Plain JSON values of the whole diagnosis."""
    return plain(diagnosis)


def setting_json(setting: Setting) -> list[dict[str, Any]]:
    """Plain JSON values of what is put into the model."""
    return plain(setting)


def plain(value: Any) -> Any:
    """Dataclasses as objects, sequences as lists, numbers as they are, NaN and infinite as null."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def diagnosis_of(value: Mapping[str, Any]) -> Diagnosis:
    """The diagnosis that :func:`diagnosis_json` wrote.

    Raises
    ------
    InputRefused : if it is none of this version.
    """
    return _read(Diagnosis, value, "the diagnosis")


def setting_of(value: Sequence[Mapping[str, Any]]) -> Setting:
    """The setting that :func:`setting_json` wrote. Raises as :func:`diagnosis_of`."""
    return tuple(_read(Term, item, "the setting") for item in value)


def _read(kind: Callable[..., T], value: Any, what: str) -> T:
    try:
        return _made(kind, value)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputRefused(f"{what} was written by another version of rille ({error}); diagnose again: `rille diagnose`") from error


def _made(kind: Any, value: Any) -> Any:
    """A value of a type from its JSON; null is NaN where a number belongs."""
    origin, inner = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        hints = _hints(kind)
        given = {field.name: field for field in fields(kind)}
        missing = [n for n, f in given.items() if n not in value and f.default is MISSING and f.default_factory is MISSING]
        if missing:
            raise ValueError(f"no {missing[0]}")
        return kind(**{name: _made(hints[name], value[name]) for name in given if name in value})  # type: ignore[operator]
    if origin in (Union, types.UnionType):
        return None if value is None else _made(next(k for k in inner if k is not type(None)), value)
    if origin is tuple:
        if len(inner) == 2 and inner[1] is Ellipsis:
            return tuple(_made(inner[0], item) for item in value)
        return tuple(_made(k, item) for k, item in zip(inner, value, strict=True))
    if origin is Literal:
        if value not in inner:
            raise ValueError(f"{value!r} is none of {', '.join(map(str, inner))}")
        return value
    if kind is float:
        return math.nan if value is None else float(value)
    if isinstance(value, Mapping):
        return {name: _made(inner[1], item) for name, item in value.items()} if inner else dict(value)
    return value


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def diagnosis_lines(diagnosis: Diagnosis, most: int = 5) -> list[str]:
    """The answer for people: verdict, where, the ``most`` likeliest hypotheses, parameters, fit, what to record next."""
    lines = [diagnosis.sentence, f"verdict: {TITLES[diagnosis.verdict]} ({VERDICTS[diagnosis.verdict]})"]
    where = diagnosis.location
    if where.sentence:
        lines += ["", f"where: {where.sentence}"]
    lines += [f"  {regime}" for regime in where.regimes[:3]]
    if diagnosis.transients:
        rows = [("transient", "recording", "start [s]", "duration [s]", "amplitude", "probability")]
        rows += [
            (
                f"{t.component} at {t.target}",
                t.recording,
                _short(t.start),
                _short(t.duration),
                f"{_short(t.amplitude)} +- {_short(t.amplitude_error, 2)}",
                _percent(t.probability),
            )
            for t in diagnosis.transients
        ]
        lines += ["", *_aligned(rows, left={0, 1})]
    if diagnosis.ranked:
        rows = [("hypothesis", "probability", "group", "explained", "gain [nats]", "behind [nats]")]
        rows += [_row(ranked) for ranked in diagnosis.ranked[:most]]
        lines += ["", *_aligned(rows, left={0})]
        loser = next((ranked for ranked in diagnosis.ranked[1:] if ranked.loses_because), None)
        lines += ["", f"{loser.title} loses: {loser.loses_because}"] if loser is not None else []
    estimates = [(term, estimate) for term in (diagnosis.ranked[0].terms if diagnosis.ranked else ()) for estimate in term.estimates]
    if diagnosis.setting and estimates:
        rows = [("parameter", "of", "value", "95 %", "unit")]
        rows += [
            (e.name, term.term.hypothesis.title, _short(e.value, 4), f"{_short(e.low)} to {_short(e.high)}", e.unit)
            for term, e in estimates
        ]
        lines += ["", *_aligned(rows, left={0, 1, 4})]
    proof = diagnosis.proof
    if proof is not None and math.isfinite(proof.gap_closed):
        lines += [
            "",
            f"held out ({proof.held_out}): {_percent(proof.gap_closed)} of the gap closed "
            f"(95 %: {_percent(proof.low)} to {_percent(proof.high)}), "
            f"{_short(proof.before)} -> {_short(proof.after)} noise, floor {_short(proof.floor)}"
            + (f"; where it acts {_short(proof.touched.before)} -> {_short(proof.touched.after)}" if proof.touched is not None else ""),
        ]
    for title, sentences in (("data", diagnosis.data_problems), ("not known", diagnosis.limits)):
        lines += [f"{title}: {sentence}" for sentence in sentences[:most]]
    lines += [f"record next: {experiment.sentence}" for experiment in diagnosis.experiments[:1]]
    return [line.rstrip() for line in lines]


def _row(ranked: RankedHypothesis) -> tuple[str, ...]:
    behind = f"{_short(ranked.behind)} +- {_short(ranked.behind_error, 2)}" if ranked.behind else "-"
    gain = f"{_short(ranked.gain)} +- {_short(ranked.gain_error, 2)}"
    numbers = (_percent(ranked.probability), str(ranked.group) if ranked.group else "-", _percent(ranked.explained), gain, behind)
    return (ranked.title, *numbers)


def _short(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _percent(value: float) -> str:
    if 0 < value < 0.005 or 0.995 < value < 1:
        return "< 1 %" if value < 0.5 else "> 99 %"
    return f"{100 * value:.0f} %" if math.isfinite(value) else "-"


def _aligned(rows: Sequence[tuple[str, ...]], left: set[int]) -> list[str]:
    width = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width[k]) if k in left else cell.rjust(width[k]) for k, cell in enumerate(row)) for row in rows]
