"""What finite steps do to predictions, so that it can be taken off: defect correction of a coarse simulation by one finer run.

All settings are replayed with one step h, as coarse as noise allows. What that does to a sample is the same for all of them but for small
differences, so it is found once, under the setting that starts were fitted under: with a finer run of step f the leading error is
e = (coarse - fine) h/(h - f) (Richardson 1911), and every prediction is taken less e. What is left is of the size that an instant shifted
by half of f changes.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.starts.start_fit import Samples, between

Array = NDArray[np.float64]
FINER = 2  # of the scenario's own step, or of the present one where that is smaller
MOST = 30.0  # [sigma] a larger change is a jump in time, where no step says what is right: nothing is corrected there


def finest(simulator: Any) -> float:
    """Step [s] of the finer run."""
    return float(min(simulator.own_step, simulator.step)) / FINER


def step_error(
    coarse: Any, states: Array, stops: Array, samples: Sequence[Samples]
) -> tuple[tuple[Array, ...], tuple[NDArray[np.bool_], ...]]:
    """Errors of the predictions of a simulator, and where there are jumps in time.

    states (n_windows, n), stops (n_windows,) [s] : of the windows.

    Returns
    -------
    Of each channel (m,) [unit] the error, 0 where a run ended, and at jumps; and (m,) whether a sample is of a jump, of which no step says
    what is right: a wheel that loses its hold sooner or later. Where a channel is of a jump up to the end of a window, the two runs have
    parted, and so are all channels from there on.
    """
    fine = coarse.changed(step=finest(coarse))
    bare, picks = [s.channel for s in samples], [(s.window, s.time) for s in samples]
    both = (one.predict(states[None], stops, bare, picks) for one in (coarse, fine))
    changes = [np.nan_to_num(between(s, rough[0], smooth[0])) for s, rough, smooth in zip(samples, *both, strict=True)]
    factor = coarse.step / (coarse.step - fine.step)
    jumps = _parted(samples, [np.abs(c) >= MOST * s.noise for s, c in zip(samples, changes, strict=True)], len(stops))
    return tuple(np.where(jump, 0.0, factor * c) for c, jump in zip(changes, jumps, strict=True)), jumps


def _parted(samples: Sequence[Samples], jumps: Sequence[NDArray[np.bool_]], n_windows: int) -> tuple[NDArray[np.bool_], ...]:
    """Jumps (m,) of each channel, and all samples of a window from where one of its channels jumps up to its end."""
    since = np.full(n_windows, np.inf)
    for s, jump in zip(samples, jumps, strict=True):
        calm = np.full(n_windows, -np.inf)  # the last instant at which this channel is of no jump
        np.maximum.at(calm, s.window[~jump], s.time[~jump])
        to_the_end = s.time > calm[s.window]
        np.minimum.at(since, s.window[to_the_end], s.time[to_the_end])
    return tuple(jump | (s.time >= since[s.window]) for s, jump in zip(samples, jumps, strict=True))


def timing(predict: Callable[..., list[Array]], half: float, states: Array, stops: Array, samples: Sequence[Samples]) -> tuple[Array, ...]:
    """Of each channel (m,) half of what changes from ``half`` [s] before to ``half`` after a sample [sigma]."""
    bare = [s.channel for s in samples]
    sides = [predict(states[None], stops, bare, [(s.window, s.time + shift) for s in samples]) for shift in (half, -half)]
    changes = [between(s, after[0], before[0]) for s, after, before in zip(samples, *sides, strict=True)]
    return tuple(np.nan_to_num(0.5 * change / s.noise) for s, change in zip(samples, changes, strict=True))
