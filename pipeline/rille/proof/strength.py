"""How large what is concealed must be to be as strong as wanted."""

import math
from collections.abc import Callable

Measure = Callable[[float], tuple[float, str]]
"""Size -> excess of the residual [noise], and the channel in which it is largest; infinite where physics ends the run."""

NEAR = 0.1  # relative: so far may the strength be off
ACCEPTED = 0.35  # in logarithms: so far at most, where nine tries did not do
MOST_TRIES = 9
UNSEEN = 0.3  # [noise]: below this an excess says nothing about how it grows with the size


class Unreachable(Exception):
    """No size makes it as strong as wanted on this machine and maneuver."""


def find_size(measure: Measure, wanted: float, first: float, most: float, least: float = 0.0) -> tuple[float, float, str]:
    """Size whose excess is ``wanted`` [noise], the excess that it really has, and its channel.

    Between the largest size that is too small and the smallest that is too large, by regula falsi in logarithms.

    Parameters
    ----------
    first : size to begin with. most, least : bounds of the size; equal: there is only one.

    Raises
    ------
    Unreachable : if no size is as strong.
    """
    low, high = (0.0, 0.0), (math.inf, math.inf)
    size = max(first, least)
    best = (math.inf, 0.0, 0.0, "")
    for _ in range(MOST_TRIES):
        found, channel = measure(size)
        off = abs(math.log(found / wanted)) if 0 < found < math.inf else math.inf
        best = min(best, (off, size, found, channel), key=lambda one: one[0])
        if off < NEAR or least >= most:
            break
        if found < wanted:
            low = max(low, (size, found))
            if size >= most:
                break
        else:
            high = min(high, (size, found))
        size = min(_next(low, high, wanted), most)
    off, size, found, channel = best
    if off > ACCEPTED and (least < most or found < wanted):
        raise Unreachable(f"excess {found:.3g} at size {size:.3g}, wanted {wanted:g}; sizes reach to {most:g}")
    return size, found, channel


def _next(low: tuple[float, float], high: tuple[float, float], wanted: float) -> float:
    """The size to try next, with (size, excess) that are too small and too large."""
    if not math.isfinite(high[0]):
        return low[0] * (min(max(1.1 * wanted / low[1], 1.5), 8.0) if low[1] > UNSEEN else 6.0)
    if low[1] < UNSEEN or not math.isfinite(high[1]):
        below = low[0] if low[0] > 0 else high[0] / 30
        guess = high[0] * min(max(wanted / high[1], 1 / 20), 0.9) if math.isfinite(high[1]) else 0.0
        return max(guess, math.sqrt(below * high[0])) if low[0] > 0 else max(guess, below)
    share = math.log(wanted / low[1]) / math.log(high[1] / low[1])
    return math.exp(math.log(low[0]) + min(max(share, 0.05), 0.95) * math.log(high[0] / low[0]))
