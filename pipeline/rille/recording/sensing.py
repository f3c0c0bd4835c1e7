"""From what is true to what instruments say: when they sample, how they distort, and the recording that comes of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, Recording
from rille.recording.instrument import CommandLog, Instrument, Instruments, SampleClock
from rille.recording.noise import coloured_noise, lapses, random_walk

Array = NDArray[np.float64]
WIDEST_JITTER = 0.45  # of a period: samples keep their order


@dataclass(frozen=True, slots=True, kw_only=True)
class Instants:
    """When a clock samples. true : (n,) [s] of the simulation. stamp : (n,) [s] as it says."""

    true: Array
    stamp: Array


def instants(instruments: Instruments, duration: float) -> dict[str, Instants]:
    """Sampling instants of every clock within ``duration`` [s].

    A clock begins when all of its instruments have something to say: not before the longest of their delays, nor, for commands, later than
    the delay before the end.
    """
    found = {}
    for name, clock in instruments.clocks.items():
        rng = _random(instruments.seed, "clock", name)
        nominal = clock.phase + np.arange(int(max(0.0, duration - clock.phase) * clock.rate * (1 + 1e-12)) + 1) / clock.rate
        noise = np.clip(clock.jitter * rng.standard_normal(len(nominal)), -WIDEST_JITTER / clock.rate, WIDEST_JITTER / clock.rate)
        true = nominal + noise if clock.jitter else nominal
        lost = np.zeros(len(true), dtype=bool)
        if clock.gaps is not None:
            lost = lapses(rng, true, clock.gaps.fraction, clock.gaps.mean_length)
        first = max([sensor.delay for sensor in instruments.sensors if sensor.clock == name], default=0.0)
        last = duration - max([log.delay for log in instruments.commands if log.clock == name], default=0.0)
        kept = (true >= first - 1e-12) & (true <= last + 1e-12) & ~lost
        found[name] = Instants(true=true[kept], stamp=_stamps(clock, (nominal if clock.stamp == "nominal" else true)[kept]))
    return found


def sensed(instrument: Instrument, number: int, truth: Array, when: Instants, seed: int) -> Array:
    """What an instrument says (n,) [unit] where the truth is ``truth`` (n,); NaN where samples dropped out.

    number : of the component. Each channel draws from its own random numbers: adding one leaves the others as they are.
    """
    name = instrument.columns[number]
    t = when.true
    said = instrument.scale * truth + instrument.bias + instrument.trend * t
    if instrument.drift:
        said = said + random_walk(_random(seed, "drift", name), t, instrument.drift)
    if instrument.coloured is not None:
        said = said + coloured_noise(_random(seed, "coloured", name), t, *instrument.coloured)
    if instrument.white:
        said = said + instrument.white * _random(seed, "white", name).standard_normal(len(t))
    if instrument.components and instrument.components[number] in ("roll", "yaw"):
        said = (said + np.pi) % (2 * np.pi) - np.pi
    said = np.clip(said, instrument.lower, instrument.upper)
    if instrument.resolution:
        said = instrument.resolution * np.round(said / instrument.resolution) + 0.0  # no -0
    for begin, end in instrument.stuck:
        inside = (t >= begin) & (t < end)
        if inside.any():
            said[inside] = said[max(0, int(np.argmax(inside)) - 1)]
    if instrument.dropout is not None:
        lost = lapses(_random(seed, "dropout", instrument.columns[0]), t, instrument.dropout.fraction, instrument.dropout.mean_length)
        said = np.where(lost, np.nan, said)
    return said


def recording_of(
    instruments: Instruments,
    when: Mapping[str, Instants],
    truth: Sequence[Array],
    commands: Mapping[str, tuple[Array, Array]],
    *,
    name: str,
    scenario: str | None,
    reached: float,
) -> Recording:
    """The recording that the instruments make.

    Parameters
    ----------
    when : of ``instants``. truth : for each instrument (n, components) at ``when[clock].true - delay`` [SI].
    commands : drive -> times (m,) [s] and set values (m,), each holding until the next.
    reached : [s] until when there is truth.
    """
    channels = []
    for instrument, values in zip(instruments.sensors, truth, strict=True):
        there = when[instrument.clock]
        n = int(np.searchsorted(there.true, reached, side="right"))
        there = Instants(true=there.true[:n], stamp=there.stamp[:n])
        for k, column in enumerate(instrument.columns):
            channels.append(
                Channel(
                    name=column,
                    quantity=instrument.quantity,
                    target=instrument.target,
                    unit=instrument.unit,
                    component=instrument.components[k] if instrument.components else "",
                    frame=instrument.frame,
                    clock=instrument.clock,
                    noise=instrument.noise or None,
                    slow_noise=instrument.coloured[0] or None if instrument.coloured else None,
                    delay=instrument.delay,
                    resolution=instrument.resolution or None,
                    time=there.stamp,
                    value=sensed(instrument, k, values[:n, k], there, instruments.seed),
                )
            )
    return Recording(name=name, scenario=scenario, channels=(*channels, *_command_channels(instruments, when, commands, reached)))


def _command_channels(
    instruments: Instruments, when: Mapping[str, Instants], commands: Mapping[str, tuple[Array, Array]], reached: float
) -> list[Channel]:
    """Channels of commands: sampled by a clock, or stamped at every change of one of those that share a delay, and at the end."""
    changes: dict[float, list[Array]] = {}
    for log in instruments.commands:
        if not log.clock:
            changes.setdefault(log.delay, []).append(commands[log.drive][0])
    own = {delay: _acting(np.unique(np.concatenate([*times, [reached]])), delay) for delay, times in changes.items()}
    names = {delay: "commands" if len(own) == 1 else f"commands_{1e3 * delay:g}ms" for delay in own}
    return [_logged(log, when, own, names, commands[log.drive], reached) for log in instruments.commands]


def _logged(
    log: CommandLog,
    when: Mapping[str, Instants],
    own: Mapping[float, Array],
    names: Mapping[float, str],
    given: tuple[Array, Array],
    reached: float,
) -> Channel:
    if log.clock:
        there = when[log.clock]
        n = int(np.searchsorted(there.true, reached, side="right"))
        acting, stamp, clock = there.true[:n] + log.delay, there.stamp[:n], log.clock
    else:
        acting = own[log.delay]
        stamp, clock = acting - log.delay, names[log.delay]
    times, values = given
    return Channel(
        name=log.column,
        quantity=log.quantity,
        target=log.target,
        unit=log.unit,
        role="command",
        clock=clock,
        delay=log.delay,
        time=stamp,
        value=values[np.maximum(np.searchsorted(times, acting + 1e-12, side="right") - 1, 0)],
    )


def _acting(times: Array, delay: float) -> Array:
    """Times at which commands act, with the last of those that were stamped before 0 s in place of them all."""
    early = times[times < delay]
    return times if len(early) < 1 else np.concatenate([[delay], times[times > delay]])


def _stamps(clock: SampleClock, times: Array) -> Array:
    return clock.offset + (1 + clock.skew) * times


def _random(seed: int, purpose: str, name: str) -> np.random.Generator:
    """Random numbers of one purpose of one channel."""
    return np.random.default_rng([seed, crc32(purpose.encode()), crc32(name.encode())])
