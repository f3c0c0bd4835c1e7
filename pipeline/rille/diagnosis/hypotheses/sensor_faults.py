"""Faults of sensors: what a channel would say of the truth, and the truth that a channel tells once its fault is known.

The laws are those of the catalogue (family ``sensor``); on the way to the sensor's value the fault comes before the noise, so that the
likelihood of a fault needs the simulated truth distorted, not the recording repaired. Only the smoothed start needs the repaired recording.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.hypotheses.sensor_hypotheses import channels_of
from rille.model.hypothesis import Setting, Term
from rille.model.recording import ANGLES, Channel

Array = NDArray[np.float64]
Numbers = Mapping[str, float]
SAME = 1e-9  # [rad] turns that are the same but for rounding
COUNTS_TURNS = 1.5 * np.pi  # [rad] size beyond which an angle is none within half a turn, whatever its noise
LEAST_GAIN = 0.05  # below which a value says nothing of the truth


def _same(time: Array, numbers: Numbers) -> Array:
    return time


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A law. said : (true value (m,), instant (m,) [s], numbers) -> what the sensor says. instant : (stamp (m,) [s], numbers) -> when that
    was true [s]. repaired : (said (m,), instant (m,), numbers) -> true value, NaN where it cannot be told.
    """

    said: Callable[[Array, Array, Numbers], Array] = lambda value, time, numbers: value
    instant: Callable[[Array, Numbers], Array] = _same
    repaired: Callable[[Array, Array, Numbers], Array] = lambda value, time, numbers: value

    @property
    def moves_time(self) -> bool:
        """Whether the value is of another instant than the stamp says."""
        return self.instant is not _same


def _divided(value: Array, gain: float) -> Array:
    return value / gain if abs(gain) > LEAST_GAIN else np.full(len(value), np.nan)


def _within(value: Array, limit: float) -> Array:
    """Values that are not at the end of the range."""
    return np.where(np.abs(value) * limit < 1 - 1e-6, value, np.nan)


FAULTS: dict[str, Fault] = {
    "bias": Fault(said=lambda v, t, p: v + p["offset"], repaired=lambda v, t, p: v - p["offset"]),
    "scale": Fault(said=lambda v, t, p: v * (1 + p["relative_error"]), repaired=lambda v, t, p: _divided(v, 1 + p["relative_error"])),
    "drift": Fault(said=lambda v, t, p: v + p["rate"] * t, repaired=lambda v, t, p: v - p["rate"] * t),
    "delay": Fault(instant=lambda t, p: t - p["delay"]),
    "clock_skew": Fault(instant=lambda t, p: t / (1 + p["skew"])),
    "wrong_sign": Fault(said=lambda v, t, p: v * (1 - 2 * p["flip"]), repaired=lambda v, t, p: _divided(v, 1 - 2 * p["flip"])),
    "saturation": Fault(
        said=lambda v, t, p: np.clip(v, -1 / p["inverse_range"], 1 / p["inverse_range"]) if p["inverse_range"] > 0 else v,
        repaired=lambda v, t, p: _within(v, p["inverse_range"]),
    ),
    "dropout": Fault(),
}


def _of_one_turn(law: Fault, value: Array, time: Array, numbers: Numbers) -> Array:
    """True angles of what was said; NaN where what was said within half a turn can be of two: where a scale of 1.04 says 3.1 rad, that may
    be 2.98 rad, or -3.06 rad, which made -3.18 rad. Angles that count full turns are of one.
    """
    plain = law.repaired(value, time, numbers)
    if np.nanmax(np.abs(value), initial=0.0) > COUNTS_TURNS:
        return plain
    of_two = np.zeros(len(value), dtype=bool)
    for turn in (2 * np.pi, -2 * np.pi):
        other = law.repaired(value + turn, time, numbers)
        apart = np.abs((other - plain + np.pi) % (2 * np.pi) - np.pi)
        of_two |= (np.abs(other) <= np.pi) & (apart > SAME)
    return np.where(of_two, np.nan, plain)


def concerns(term: Term, channel: Channel) -> bool:
    """Whether a fault is of this channel, of the instrument that it is a component of, or of the clock that stamps it."""
    return bool(channels_of(term.hypothesis, [channel]))


def said(faults: Setting, channel: Channel, value: Array, instant: Array) -> Array:
    """What a channel says (..., m) of the truth ``value`` (..., m) at ``instant`` (m,) [s], one fault after the other."""
    for term in faults:
        if concerns(term, channel):
            value = FAULTS[term.hypothesis.kind].said(value, instant, term.numbers)
    return value


def true_instants(faults: Setting, channel: Channel, instant: Array) -> Array:
    """When what a channel says of ``instant`` (m,) [s] was true."""
    for term in faults:
        if concerns(term, channel):
            instant = FAULTS[term.hypothesis.kind].instant(instant, term.numbers)
    return instant


def moves_time(faults: Setting, channel: Channel) -> bool:
    """Whether a fault changes when a channel's values were true."""
    return any(FAULTS[term.hypothesis.kind].moves_time for term in faults if concerns(term, channel))


def repaired(faults: Setting, channel: Channel) -> Channel:
    """The channel as it would be without its faults; values that cannot be told are NaN."""
    time, value = channel.time - channel.delay, channel.value
    own = [term for term in faults if concerns(term, channel)]
    for term in reversed(own):
        law = FAULTS[term.hypothesis.kind]
        time = law.instant(time, term.numbers)
        value = _of_one_turn(law, value, time, term.numbers) if channel.component in ANGLES else law.repaired(value, time, term.numbers)
    return replace(channel, time=time + channel.delay, value=value) if own else channel
