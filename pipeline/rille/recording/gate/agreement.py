"""What the fit of two related channels says: unit, sign, gain, delay, bias and skew."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from rille.model.recording import ANGLES, Channel, GateFinding
from rille.recording.gate.lag import Fit
from rille.recording.gate.relations import Pair
from rille.recording.gate.unit_names import nearest_factor

Fits = Sequence[tuple[Pair, Fit]]
SEEN = 0.5  # R^2 from which the delay of a response is believed
SURE = 0.8  # R^2 from which gain, delay and bias of redundant channels are believed
SIGMAS = 6.0
EXACT, EXACT_GAIN, EXACT_SIGMAS = 0.999, 0.03, 5.0  # R^2 from which, and bounds by which, channels of one joint must have the gain 1
SMALLEST = 1e-3  # [s] delays below this are none


def check_agreement(channels: Mapping[str, Channel], fits: Fits) -> list[GateFinding]:
    """Findings about pairs. Of a pair that disagrees, the channel is named that no other pair vouches for."""
    time_factor = _time_factor(channels, fits)
    if time_factor is not None:
        return [time_factor]
    sound = {
        name
        for pair, fit in fits
        if _gain_fault(channels, pair, fit) is None and fit.agreement > SURE
        for name in (pair.first, pair.second)
    }
    prompt = {name for pair, fit in fits if pair.kind != "response" and _prompt(channels, pair, fit) for name in (pair.first, pair.second)}
    found = []
    for pair, fit in fits:
        fault = _gain_fault(channels, pair, fit)
        if fault is not None:
            found.append(_gain_finding(channels, pair, fit, fault, sound))
            if fault[0] != "gain":
                continue
        skew = _skew(channels, pair, fit)
        found += (skew or _delay(channels, pair, fit, prompt)) + _bias(channels, pair, fit)
    return found


def fit_detail(pair: Pair, fit: Fit) -> dict[str, object]:
    """Plain values of a fit."""
    numbers: dict[str, object] = {
        key: value if not isinstance(value, float) or np.isfinite(value) else None for key, value in asdict(fit).items()
    }
    return {"first": pair.first, "second": pair.second, "kind": pair.kind, **numbers, "error": delay_error(fit)}


def _mean_gain(fit: Fit) -> float:
    return float(np.sign(fit.gain) * np.sqrt(abs(fit.gain * fit.gain_back)))


def _within(channels: Mapping[str, Channel], pair: Pair) -> float:
    """Relative error of a gain that is none: an angle's rate is a component of the angular velocity only on level ground."""
    if pair.kind == "rate":
        return 0.2 if channels[pair.first].component in ANGLES else 0.05
    return 0.05


def _gain_fault(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> tuple[str, str] | None:
    """Code and meaning of a gain that is not 1. The true gain lies between those of the two regressions."""
    if fit.agreement < SURE or pair.kind == "scaled" or (fit.ambiguous and pair.kind == "response"):
        return None
    within = _within(channels, pair)
    low, high = sorted((abs(fit.gain), abs(fit.gain_back)))
    slack = SIGMAS * fit.gain_error + within + 1.5 * float(np.sqrt(1 - fit.agreement))
    mean = _mean_gain(fit)
    sure = fit.agreement > (0.95 if pair.kind == "response" else 0.9) and not (fit.ambiguous and abs(fit.delay) > fit.half)
    if mean < 0 and sure and low - slack < 1 < high + slack:
        return "sign", ""
    exact = _exact(channels, pair, fit)
    if exact:
        slack = max(EXACT_GAIN, EXACT_SIGMAS * fit.gain_error)
    if low - slack <= 1 <= high + slack:
        return None
    known = nearest_factor(mean, 0.08 if within < 0.1 else 0.15) if sure else None
    if known is not None:
        return "unit", known[1]
    return ("gain", "") if (pair.kind != "response" or exact) and mean > 0 else None


def _exact(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> bool:
    """Whether nothing but scale can part two channels of one joint: they agree but for a gain. Only efforts are what was commanded."""
    first, second = channels[pair.first], channels[pair.second]
    joint = first.quantity.startswith("joint.") and second.quantity.startswith("joint.")
    return joint and fit.agreement > EXACT and (pair.kind != "response" or first.quantity == second.quantity == "joint.effort")


def _named(pair: Pair, sound: set[str]) -> tuple[str, str]:
    """The channel that a disagreement is put down to, and how sure that is."""
    if pair.second in sound and pair.first not in sound:
        return pair.first, pair.second
    return pair.second, pair.first


def _relation(pair: Pair) -> str:
    return f"the rate of '{pair.first}'" if pair.order else f"'{pair.first}'"


def _gain_finding(channels: Mapping[str, Channel], pair: Pair, fit: Fit, fault: tuple[str, str], sound: set[str]) -> GateFinding:
    name, _ = _named(pair, sound)
    other = pair.first if name == pair.second else pair.second
    mean = _mean_gain(fit)
    sure = other in sound and name not in sound
    who = f"'{name}' is at fault, as another channel vouches for '{other}'" if sure else "either may be at fault"
    text = f"'{pair.second}' is {mean:.4g} times {_relation(pair)} (R^2 {fit.agreement:.3f}); {who}"
    code, meaning = fault
    if code == "sign":
        message = f'{text}: turn the sign with scale = -1, or accept "sign" for this channel'
    elif code == "unit":
        message = f"{text}: a factor that units get mixed up by ({meaning}); check the units of both in the manifest"
    else:
        message = f"{text}: check the scale of both, or take the gain for a fault of the sensor"
    detail = fit_detail(pair, fit) | {"ratio": mean, "attributed": sure}
    return GateFinding(code=code, severity="warning" if code == "gain" else "error", channel=name, detail=detail, message=message)


def _time_factor(channels: Mapping[str, Channel], fits: Fits) -> GateFinding | None:
    """A clock whose unit is wrong: all rates are off by one power of a thousand (or sixty) against what they are the rates of."""
    rates = [(pair, fit) for pair, fit in fits if pair.order == 1 and fit.agreement > SURE and fit.gain > 0]
    if not rates:
        return None
    gains = np.array([_mean_gain(fit) for _, fit in rates])
    factor = min((1e3, 1e6, 1e9, 60.0, 1e-3, 1e-6, 1e-9, 1 / 60), key=lambda f: abs(np.log(gains[0] / f)))
    off = np.abs(np.log(gains / factor))
    if np.any(off > 0.2) or all(_is_other_unit(gain, far) for gain, far in zip(gains, off, strict=True)):
        return None
    pair, _ = rates[0]
    step = float(np.median(np.diff(channels[pair.second].time))) if len(channels[pair.second].time) > 1 else rates[0][1].half / 4
    turning = channels[pair.first].unit == "rad"
    if len(rates) == 1 and not turning and 2e-4 <= step <= 1.0:  # one length against its rate at a usual sampling rate: millimetres then
        return None
    units = {1e3: "ms", 1e6: "us", 1e9: "ns", 60.0: "min"}
    right = f'state unit = "{units[factor]}"' if factor in units and factor != 60.0 else f"its unit is {1 / factor:.4g} times too small"
    if factor in (1e-3, 1e-6, 1e-9):
        right = f"its unit must be {1 / factor:g} times larger"
    if factor in (60.0, 1 / 60):
        right = "minutes and seconds are mixed up"
    clock = channels[pair.second].clock
    message = (
        f"clock '{clock}' is in another unit than [time] says: all rates ({', '.join(repr(pair.second) for pair, _ in rates[:3])}) are "
        f"{float(np.median(gains)):.4g} times those of the positions; {right}"
    )
    detail = {"factor": factor, "gains": gains.tolist(), "unit": units.get(factor, "s")}
    return GateFinding(code="time_unit", severity="error", channel=clock, detail=detail, message=message)


def _is_other_unit(gain: float, off: float) -> bool:
    """Whether a rate's gain is nearer to one that units of values get mixed up by (180/pi is nearly 60). off : from that of a clock."""
    known = nearest_factor(gain, 0.08)
    return known is not None and abs(np.log(gain / known[0])) < off


def _prompt(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> bool:
    """Whether two channels are seen to be in time with each other."""
    return fit.agreement > SURE and not fit.ambiguous and abs(fit.delay) <= _least(channels, pair, fit)


def _least(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> float:
    """Delay [s] up to which it is none: 1 ms, six standard errors, a seventh of a sample interval, or what held commands leave open."""
    if pair.kind == "response":
        return max(SMALLEST, SIGMAS * fit.delay_error + fit.open_delay)
    return max(SMALLEST, SIGMAS * fit.delay_error, 0.15 * _step(channels, pair.first, pair.second))


def _needed(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> bool:
    """Whether the fit without a delay is worse than chance allows: in steady acceleration, lag and bias are one thing."""
    windows = max(fit.count * min(_step(channels, pair.second) / (2 * fit.half), 1.0), 1.0)
    return (fit.agreement - fit.agreement_at_zero) * windows > SIGMAS**2 * max(1 - fit.agreement, 1e-12)


def delay_error(fit: Fit) -> float:
    """Standard error [s] of the delay, with that of an interval which held commands leave open."""
    return float(np.hypot(fit.delay_error, fit.open_delay / np.sqrt(3)))


def _delay(channels: Mapping[str, Channel], pair: Pair, fit: Fit, prompt: set[str]) -> list[GateFinding]:
    seen = fit.agreement > (SEEN if pair.kind == "response" else SURE) and not fit.ambiguous and np.isfinite(fit.delay_error)
    if not seen or abs(fit.delay) <= _least(channels, pair, fit) or not _needed(channels, pair, fit):
        return []
    number = f"{fit.delay * 1e3:.2f} ± {delay_error(fit) * 1e3:.2f} ms"
    if pair.kind == "response":
        slowly = ""
        if fit.slow_delay is not None and fit.slow_delay > 1.2 * fit.delay:
            slowly = f", slow changes by {fit.slow_delay * 1e3:.3g} ms (there is a lag besides the delay)"
        message = (
            f"'{pair.second}' follows the command '{pair.first}' by {number}{slowly} (R^2 {fit.agreement:.3f}); "
            f"state delay = \"{fit.delay * 1e3:.3g} ms\" for '{pair.first}' if the model does not have that lag itself"
        )
        return [GateFinding(code="delay", severity="note", channel=pair.first, detail=fit_detail(pair, fit), message=message)]
    late, early = (pair.second, pair.first) if fit.delay > 0 else (pair.first, pair.second)
    number = number.removeprefix("-")
    certain = early in prompt and late not in prompt
    if late in prompt and early not in prompt:
        message = f"'{early}' runs ahead of '{late}' by {number}, and others agree with '{late}'"
        late, early = early, late
    else:
        message = f"'{late}' lags {'the rate of ' if pair.order and early == pair.first else ''}'{early}' by {number}"
    message += f"; state its delay in the manifest{'' if certain else ' of the one that is late'}"
    severity = "note" if abs(fit.delay) < 0.75 * _step(channels, pair.second) and pair.order == 1 else "warning"
    if severity == "note":
        message += " (about half a sample, as of a rate that was made by differences)"
    return [GateFinding(code="delay", severity=severity, channel=late, detail=fit_detail(pair, fit), message=message)]


def _step(channels: Mapping[str, Channel], *names: str) -> float:
    """Longest of the median intervals of some channels [s]."""
    steps = [float(np.median(np.diff(channels[name].time[:10_000]))) for name in names if len(channels[name].time) > 1]
    return max(steps, default=0.0)


def _bias(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> list[GateFinding]:
    if pair.kind == "response" or pair.kind == "scaled" or fit.agreement < SURE or pair.order == 0:
        return []
    if not abs(fit.bias) > SIGMAS * fit.bias_error or abs(fit.bias) < 0.02 * fit.spread:
        return []
    severity = "warning" if abs(fit.bias) > 0.2 * fit.spread else "note"
    unit = channels[pair.second].unit
    message = (
        f"'{pair.second}' is {fit.bias:.3g} ± {fit.bias_error:.1g} {unit} above {_relation(pair)}, {abs(fit.bias) / fit.spread:.1%} of its "
        "own variation; state an offset, or let the bias be estimated"
    )
    return [GateFinding(code="bias", severity=severity, channel=pair.second, detail=fit_detail(pair, fit), message=message)]


def _skew(channels: Mapping[str, Channel], pair: Pair, fit: Fit) -> list[GateFinding]:
    first, second = channels[pair.first], channels[pair.second]
    if first.clock == second.clock or not np.isfinite(fit.drift_error) or fit.agreement < SURE:
        return []
    if abs(fit.drift) < SIGMAS * fit.drift_error or abs(fit.drift) * fit.length < max(
        SMALLEST, 0.1 * _step(channels, pair.first, pair.second)
    ):
        return []
    message = (
        f"clock '{second.clock}' runs {fit.drift * 1e6:.1f} ± {fit.drift_error * 1e6:.1f} us per second slow against clock '{first.clock}' "
        f"(seen by '{second.name}' against '{first.name}'); state a [[correction]] kind = \"scale_clock\" with its reason"
    )
    return [GateFinding(code="clock_skew", severity="warning", channel=second.clock, detail=fit_detail(pair, fit), message=message)]
