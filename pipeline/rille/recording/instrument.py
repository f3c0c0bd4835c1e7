"""Instruments that a simulated machine carries, as values: what they read, how often, and how they err."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class Lapses:
    """Stretches without samples: ``fraction`` of the time [-], lasting ``mean_length`` [s] on average; 0: single samples."""

    fraction: float
    mean_length: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleClock:
    """When is sampled, and what the stamps say.

    Sample k is taken at t = phase + k / rate + jitter, jitter normal with 1 sigma ``jitter`` [s], cut off at 0.45 / rate so that samples
    keep their order. Its stamp is offset + (1 + skew) t, or, for ``stamp`` nominal, that of phase + k / rate. gaps : it does not sample.
    """

    name: str
    rate: float
    jitter: float = 0.0
    phase: float = 0.0
    stamp: Literal["true", "nominal"] = "true"
    offset: float = 0.0
    skew: float = 0.0
    gaps: Lapses | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Instrument:
    """One quantity of one target as an instrument says it.

    What is stamped t says: quantise(saturate(scale y(t - delay) + bias + trend t + drift(t) + coloured(t) + white)).

    columns : names of its channels, one per component. unit : SI. written_unit, factor : of the file: value [SI] = factor x value written.
    white : 1 sigma [unit]. coloured : (1 sigma [unit], time constant [s]). drift : random walk [unit/s^0.5]. trend : [unit/s].
    lower, upper : end of the range [unit]. resolution : [unit], 0: none. stuck : intervals [s] in which it repeats its last value.
    """

    columns: tuple[str, ...]
    quantity: str
    target: str
    clock: str
    unit: str
    components: tuple[str, ...] = ()
    frame: Literal["world", "body"] = "world"
    written_unit: str = ""
    factor: float = 1.0
    delay: float = 0.0
    scale: float = 1.0
    bias: float = 0.0
    trend: float = 0.0
    white: float = 0.0
    coloured: tuple[float, float] | None = None
    drift: float = 0.0
    lower: float = -math.inf
    upper: float = math.inf
    resolution: float = 0.0
    dropout: Lapses | None = None
    stuck: tuple[tuple[float, float], ...] = ()

    @property
    def noise(self) -> float:
        """1 sigma [unit] of white and coloured noise together."""
        return math.hypot(self.white, self.coloured[0] if self.coloured else 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLog:
    """The set value of a drive, as ``quantity`` of its joint.

    clock '' : stamped when it changes. delay : [s] what is stamped t acts at t + delay.
    """

    column: str
    drive: str
    quantity: str
    target: str
    unit: str
    clock: str = ""
    delay: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruments:
    """All that is recorded of a machine. seed : of every random number."""

    clocks: Mapping[str, SampleClock]
    sensors: tuple[Instrument, ...]
    commands: tuple[CommandLog, ...]
    seed: int = 0
    name: str | None = None
