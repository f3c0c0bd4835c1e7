"""Faults of what was recorded: of one channel, of an instrument with several components, of a clock."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rille.diagnosis.hypotheses.natural import most
from rille.model.effect import EffectKind, EffectParameter
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.recording import Channel, full_name

STAMPS, GAPS = "stamps", "gaps"  # words of the catalogue's column `channel`: faults of the time stamps; faults that leave no wrong value
TURNS = ("w", "x", "y", "z")
LEAST_WHOLE = 0.9  # of the number of a fault that is there or not (its usual value is its largest)
FARTHEST = 10.0  # times the largest value that was measured: an offset beyond it is none
FASTEST = 0.02  # relative error of a clock's rate beyond which it is believed last
IN_A_ROW = 4  # samples that say exactly the largest value, from which on it may be the end of a range
LIMIT_KNOWN = 1e-4  # relative: so well is such an end known
LEAST_SHIFT, MOST_SHIFT, SHIFTS = 0.25, 0.3, 10  # [sampling intervals], [s], number of shifts in time that are tried
FAST, RATES = 0.2, 12  # largest rate of a clock that is tried, and how many between it and one that makes the largest shift


def sensor_hypotheses(channels: Sequence[Channel], kinds: Sequence[EffectKind]) -> tuple[Hypothesis, ...]:
    """Every fault of the catalogue at every observed channel (each name once), instrument and clock.

    target_kind ``channel``: target is the channel's name. ``sensor``: "part.position of chassis", all components of it. ``clock``: name
    of the clock, all of its channels; for faults of stamps, where it stamps more than one instrument.
    Components of quaternions are no instruments of their own: they have faults only together.
    """
    everywhere = [c for c in channels if c.role == "observed"]
    observed = list({c.name: c for c in reversed(everywhere)}.values())[::-1]
    faults = [kind for kind in kinds if kind.target == "sensor" and GAPS not in kind.channel]
    sensors = {_sensor(c): [d for d in observed if _sensor(d) == _sensor(c)] for c in observed}
    clocks = {c.clock: [d for d in observed if d.clock == c.clock] for c in observed}
    found: list[Hypothesis] = []
    for kind in faults:
        for c in (c for c in observed if not _of_quaternion(c)):
            limit = seen_limit([d for d in everywhere if d.name == c.name])
            found.append(_at_limit(_hypothesis(kind, "channel", c.name, [c]), limit))
        found += [_hypothesis(kind, "sensor", name, its) for name, its in sensors.items() if len(its) > 1 and _bears(kind, its)]
        if STAMPS in kind.channel:
            found += [_hypothesis(kind, "clock", name, its) for name, its in clocks.items() if len({_sensor(c) for c in its}) > 1]
    return tuple(found)


def channels_of(hypothesis: Hypothesis, channels: Sequence[Channel]) -> tuple[str, ...]:
    """Names of the observed channels that a sensor fault is about."""
    word = {"channel": lambda c: c.name, "sensor": _sensor, "clock": lambda c: c.clock}[hypothesis.target_kind]
    return tuple(c.name for c in channels if c.role == "observed" and word(c) == hypothesis.target)


def _sensor(channel: Channel) -> str:
    return full_name(channel.quantity, "", channel.target)


def _of_quaternion(channel: Channel) -> bool:
    return channel.quantity == "part.orientation" and channel.component in TURNS


def _bears(kind: EffectKind, channels: Sequence[Channel]) -> bool:
    """An offset of all components is a fault of vectors, not of quaternions, whose numbers have one length."""
    return not (_of_quaternion(channels[0]) and any("SI" in p.unit for p in kind.parameters if p.amplitude))


def _hypothesis(kind: EffectKind, target_kind: str, target: str, channels: Sequence[Channel]) -> Hypothesis:
    return Hypothesis(
        cause="sensor",
        kind=kind.name,
        target=target,
        target_kind=target_kind,
        free=tuple(_free(kind, p, channels) for p in kind.parameters if p.search != "fixed"),
        fixed={p.name: p.typical for p in kind.parameters if p.search == "fixed"},
        memory=kind.memory,
        passive=kind.passive,
    )


def _free(kind: EffectKind, parameter: EffectParameter, channels: Sequence[Channel]) -> FreeNumber:
    """Scaled by the channel: offsets by its range, drifts by its range over the recording, delays by its sampling."""
    largest = max((most(c.value, 1.0) for c in channels), default=0.0) or 1.0
    width = max((_width(c) for c in channels), default=0.0) or 1.0
    noise = max((c.noise or 0.0 for c in channels), default=0.0)
    duration = max((float(c.time[-1] - c.time[0]) for c in channels if len(c.time) > 1), default=10.0) or 10.0
    interval = max((float(np.median(np.diff(c.time))) for c in channels if len(c.time) > 2), default=0.02)
    factor = 1.0
    if parameter.unit == "SI":
        factor = max(width, 10 * noise)
    elif parameter.unit == "SI/s":
        factor = 100 * max(width, 10 * noise) / duration
    elif parameter.unit == "1/SI":
        factor = 1.0 / largest  # what is seen of a limit is the largest value
    elif parameter.unit == "s":
        factor = max(1.0, interval / 0.02)
    number = FreeNumber(
        name=parameter.name,
        unit=_unit(parameter.unit, channels[0].unit),
        amplitude=parameter.amplitude,
        lower=parameter.lower,
        upper=parameter.upper,
        start=parameter.typical * factor,
        spread=parameter.spread * factor,
    )
    if parameter.unit == "1/SI":
        number = replace(number, upper=min(number.upper, 100 / largest))
    elif parameter.unit.startswith("SI"):  # a sensor that says nothing of what it measures is broken, not off
        far = FARTHEST * (largest + 10 * noise) / (duration if parameter.unit == "SI/s" else 1.0)
        number = replace(number, lower=max(number.lower, -far), upper=min(number.upper, far))
    if parameter.amplitude and parameter.typical == parameter.upper:
        number = replace(number, lower=LEAST_WHOLE * parameter.upper, spread=parameter.upper)
    if STAMPS in kind.channel and parameter.amplitude:  # a delay, or a rate that makes one by the end
        tries = shifts(number.lower, number.upper, interval, 1.0 if parameter.unit == "s" else duration)
        if parameter.unit == "1":  # of a clock that is far off nothing near tells: what moves fast is soon at another place of its way
            far = np.linspace(FAST, min(MOST_SHIFT / duration, FAST), RATES, endpoint=False)
            number = replace(number, believed=FASTEST)
            tries += tuple(float(v) for v in (*far, *-far) if number.lower <= v <= number.upper)
        number = replace(number, tries=tries)
    return replace(number, start=min(max(number.start, number.lower), number.upper))


def seen_limit(channels: Sequence[Channel]) -> float | None:
    """Where one channel ends in its recordings: its largest absolute value, if several samples in a row say exactly that; else None."""
    values = [np.abs(c.value[np.isfinite(c.value)]) for c in channels]
    largest = max((float(v.max()) for v in values if len(v)), default=0.0)
    runs = [v == largest for v in values]
    in_a_row = any(np.any(np.convolve(run, np.ones(IN_A_ROW), "valid") > IN_A_ROW - 0.5) for run in runs if len(run) >= IN_A_ROW)
    return largest if largest > 0 and in_a_row else None


def _at_limit(hypothesis: Hypothesis, limit: float | None) -> Hypothesis:
    """The hypothesis; of a range that ends where the channel shows it, that range: it ends there, or not at all."""
    if limit is None or not any(number.unit.startswith("1/") for number in hypothesis.free):
        return hypothesis
    (number,) = hypothesis.free
    ends = (1 - LIMIT_KNOWN) / limit, (1 + LIMIT_KNOWN) / limit
    return replace(hypothesis, free=(replace(number, lower=ends[0], upper=ends[1], start=1 / limit, spread=1 / limit),))


def shifts(lower: float, upper: float, interval: float, over: float = 1.0) -> tuple[float, ...]:
    """Delays [s], or rates that add up to them over a time [s], from a part of the interval [s] of samples to what a delay can be."""
    sizes = np.geomspace(LEAST_SHIFT * interval, max(MOST_SHIFT, interval), SHIFTS) / over
    return tuple(float(v) for v in (*sizes, *-sizes) if lower <= v <= upper)


def _unit(unit: str, own: str) -> str:
    """The catalogue's "SI" is the unit of the channel."""
    wrapped = f"({own})" if " " in own or "/" in own else own
    return {"SI": own, "SI/s": f"{wrapped}/s", "1/SI": f"1/{wrapped}"}.get(unit, unit)


def _width(channel: Channel) -> float:
    """Half of the range that most samples keep to."""
    good = channel.value[np.isfinite(channel.value)]
    return 0.5 * float(np.quantile(good, 0.95) - np.quantile(good, 0.05)) if len(good) else 0.0
