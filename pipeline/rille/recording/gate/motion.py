"""Did the machine move while a channel held still? Another channel can tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import ANGLES
from rille.recording.gate.noise import white_noise
from rille.recording.gate.relations import Pair
from rille.recording.gate.source import Source, Span

Array = NDArray[np.float64]
SIGMAS = 8.0
BIAS = 0.15  # part of a rate's spread that may be its bias, and so proves no motion
GYRO_BIAS = 0.02  # [rad/s] what the cheaper gyros are off by, however little they turn
TILTS = ("roll", "pitch")
LEVEL = 0.4  # [rad] of roll and pitch, up to which the rate of an angle is nearly a component of the angular velocity


@dataclass(frozen=True, slots=True, kw_only=True)
class Manner:
    """How a channel behaves: standard deviation, white noise, resolution (0: none found) and largest size, all in its unit.

    reach : of 99 % of the values, so that a spike does not count.
    """

    spread: float
    noise: float
    resolution: float
    reach: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """A stretch on which a channel holds one value: its times [s], the value, and the number of samples.

    odd : the channel by itself shows that this is no rest.
    """

    span: Span
    value: float
    samples: int
    odd: bool = False


def contradicts(source: Source, k: int, name: str, held: Held, manners: Mapping[str, Manner], pairs: Sequence[Pair]) -> str | None:
    """Name of the channel which says that ``name`` cannot have held that value; "": one says that it can have; None: none tells."""
    verdict = None
    own = manners[name]
    least = 5 * max(own.resolution, own.noise, 1e-9 * own.spread)
    for pair in pairs:
        other = pair.second if name == pair.first else pair.first
        if name not in (pair.first, pair.second) or pair.kind not in ("same", "rate") or other not in manners:
            continue
        time, value = source.samples(k, other, held.span)
        good = np.isfinite(value) & np.isfinite(time)
        time, value = time[good], value[good]
        if len(time) < 5 or time[-1] <= time[0]:
            continue
        across = _across(source, k, pair, held.span, manners)
        if not np.isfinite(across):
            continue  # of a tilted body the one does not tell of the other
        lasted, fault = float(time[-1] - time[0]), manners[other]
        if pair.order == 0:
            change, floor = _range(value), SIGMAS * fault.noise + 3 * fault.resolution
        elif name == pair.first:  # the other is the rate: the way it goes
            bias = max(BIAS * fault.spread, _usual_bias(source, k, other))
            rate = value - np.clip(np.mean(value), -bias, bias)
            change = _range(np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]))
            floor = SIGMAS * fault.noise * lasted / np.sqrt(len(time)) + fault.resolution * lasted
        else:  # the other is what the rate integrates to: its way besides that of the held rate
            way = value - held.value * (time - time[0])
            bias = max(BIAS * own.spread, _usual_bias(source, k, name))
            slope = np.clip(np.polyfit(time - time[0], way, 1)[0], -bias, bias)
            change = _range(way - slope * (time - time[0]))
            floor = SIGMAS * fault.noise + 3 * fault.resolution + own.resolution * lasted
        if change - across > max(floor, least if pair.order == 0 or name == pair.first else 0.0):
            return other
        verdict = ""
    return verdict


def manner_of(value: Array, resolution: float | None) -> Manner:
    """The manner of a channel (n,), from two hundred thousand of its samples at most."""
    pieces = (
        value
        if len(value) <= 200_000
        else np.concatenate([value[s : s + 1000] for s in np.linspace(0, len(value) - 1000, 200).astype(int)])
    )
    finite = pieces[np.isfinite(pieces)]
    return Manner(
        spread=float(np.std(finite)) if len(finite) else 0.0,
        noise=white_noise(pieces),
        resolution=resolution or 0.0,
        reach=float(np.quantile(np.abs(finite), 0.99)) if len(finite) else 0.0,
    )


def _usual_bias(source: Source, k: int, rate: str) -> float:
    return GYRO_BIAS if source.recordings[k].channel(rate).quantity == "part.angular_velocity" else 0.0


def _across(source: Source, k: int, pair: Pair, span: Span, manners: Mapping[str, Manner]) -> float:
    """How far the angle of a pair may go in a stretch by the other rates of its body [rad], or the rate's integral without it.

    Of a body that is level, not at all; else at most by its tilt times their ways, of a heading too where the axes are those of W. Infinite
    beyond ``LEVEL``: there the one is not the rate of the other. What was not recorded is taken as 0.
    """
    channels = [channel for channel in source.recordings[k].channels if channel.name in manners]
    angle, rate = (next(channel for channel in channels if channel.name == name) for name in (pair.first, pair.second))
    if pair.kind != "rate" or angle.quantity != "part.orientation":
        return 0.0
    mixing = TILTS if rate.frame == "body" or angle.component == "yaw" else ANGLES
    of_body = [channel for channel in channels if channel.target == rate.target]
    tilt = max((manners[c.name].reach for c in of_body if c.quantity == angle.quantity and c.component in mixing), default=0.0)
    if tilt > LEVEL:
        return float(np.inf)
    way = 0.0
    for other in of_body:
        if (other.quantity, other.frame) == (rate.quantity, rate.frame) and other.component != rate.component:
            value = source.samples(k, other.name, span)[1]
            way += float(np.nanmean(np.abs(value))) * (span[1] - span[0]) if np.isfinite(value).any() else 0.0
    return tilt * way


def _range(value: Array) -> float:
    """Spread between the 2 % and 98 % quantiles, which a single spike does not widen."""
    low, high = np.quantile(value, (0.02, 0.98))
    return float(high - low)
