"""First guesses for the numbers that give an effect its shape: time constants, phases, orders, times."""

from collections.abc import Mapping, Sequence

import numpy as np

from rille.model.hypothesis import FreeNumber, Hypothesis

FACTORS = (0.2, 5.0, 0.04, 25.0)  # of a number that is looked for over decades, about its first guess; the nearer two if there are more
EVERY_ORDER = 32  # whole numbers up to here are all tried
ORDERS = (36, 40, 42, 44, 45, 48, 50, 52, 54, 56, 60, 64, 72, 80, 84, 90, 96, 100, 108, 120, 128, 144, 160, 180, 200, 240, 256, 300, 360,
          400, 500)  # fmt: skip
TONE, FARTHEST_TONE = 1.25, 7.0  # ratio of neighbouring frequencies, and of the farthest one to the first guess
PHASES = (0.5 * np.pi, np.pi, -0.5 * np.pi)  # beside 0, where two trials cannot give the phase
Values = dict[str, float]
Tries = Mapping[str, Sequence[Mapping[str, float]]]
"""By title of a hypothesis, sets of values of its shape numbers."""


def quadrature(hypothesis: Hypothesis) -> FreeNumber | None:
    """The phase, if two trials a quarter turn apart give amplitude and phase by linear combination: a sin(x + p) = a cos p sin x + ..."""
    phases = [number for number in hypothesis.free if number.search == "phase" and not number.amplitude]
    return phases[0] if len(phases) == 1 and sum(number.amplitude for number in hypothesis.free) == 1 else None


def shape_tries(hypothesis: Hypothesis, times: Sequence[float] = (), given: Sequence[Mapping[str, float]] = ()) -> list[Values]:
    """Values of the numbers that are no amplitudes: the first guess, then each number varied alone.

    times [s] : where to look for a time. given : sets that are tried instead; whole numbers are still varied about the first of them.
    """
    shape = [number for number in hypothesis.free if not number.amplitude]
    turning = quadrature(hypothesis)
    start = {number.name: times[0] if number.search == "time" and times else number.start for number in shape}
    several = sum(number.search == "scale" for number in shape) > 1
    known = {number.name for number in shape if number is not turning}
    tries = [start | {name: float(value) for name, value in values.items() if name in known} for values in given] or [start]
    for number in shape:
        if number is turning or (given and number.search != "order"):
            continue
        swings = hypothesis.memory and number.unit == "rad/s"
        guesses = [
            float(value)
            for value in (_resonances(number) if swings else _guesses(number, times, several))
            if number.lower <= value <= number.upper
        ]
        tries += [tries[0] | {number.name: value} for value in guesses]
    return [dict(one) for one in dict.fromkeys(tuple(sorted(one.items())) for one in tries)]


def _resonances(number: FreeNumber) -> Sequence[float]:
    """Frequencies [rad/s] of something that swings: its resonance is narrow."""
    count = int(np.log(FARTHEST_TONE) / np.log(TONE))
    return [number.start * TONE**k for k in range(-count, count + 1) if k]


def _guesses(number: FreeNumber, times: Sequence[float], several: bool) -> Sequence[float]:
    if number.search == "scale":
        return [number.start * factor for factor in FACTORS[: 2 if several else 4]]
    if number.search == "order":
        return [*range(1, EVERY_ORDER + 1), *ORDERS]
    if number.search == "phase":
        return PHASES
    return times if number.search == "time" else ()
