"""Channels as many models would have shown them, from start states in the windows of a recording: batches that fit in memory."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel
from rille.simulate.observe import Observer, observer, steady

Array = NDArray[np.float64]
Picks = Sequence[tuple[NDArray[np.int64], Array]]  # of each channel: window (m,) and time [s] (m,) of its samples
MOST_NUMBERS = 20_000_000  # numbers that one batch of windows may hold at once: 160 MB
MOST_MODELS = 16  # that are run together; more only make the batches of windows smaller


def predicted(
    models: Sequence[Any],
    motions: Sequence[Array],
    carried: Sequence[bool],
    *,
    stops: Array,
    channels: Sequence[Channel],
    picks: Picks,
    step: float,
    threads: int,
) -> list[Array]:
    """What the channels would have shown, by models x variants of the start.

    Parameters
    ----------
    models : (n_models) of ``rille._solver``, of one step [s]. motions : of each model (k, n_windows, numbers), rows of its
        ``Simulation.motion()``; times ascend and are the same for all.
    carried : of each model, whether what is not motion goes on from window to window (see ``_solver.carried``), else it begins at rest.
    stops : (n_windows,) [s]. picks : of each channel, window and time [s] of its samples, delays taken off; windows ascend.

    Returns
    -------
    Of each channel (n_models, k, m) [unit]; NaN after a run has ended.
    """
    reader = observer(channels)
    k, n_windows = motions[0].shape[:2]
    starts = motions[0][0, :, 0]
    n_steps = _steps(starts, stops, step)
    answers = [np.full((len(models), k, len(time)), np.nan) for _, time in picks]
    if not reader.needs or not n_windows:
        return answers
    for chained in (False, True):
        every = [number for number, flag in enumerate(carried) if flag == chained]
        for group in (every[i : i + MOST_MODELS] for i in range(0, len(every), MOST_MODELS)):
            run = _chained if chained else _single
            rows = np.stack([motions[number] for number in group])
            for first, last, steps in run([models[number] for number in group], rows, n_steps, list(reader.needs), step, threads):
                longest = steps.shape[-2] - 1
                flat = steady(steps.reshape(-1, *steps.shape[-2:]), reader.needs)
                offsets = (last - first) * np.arange(len(group) * k)[:, None]
                for channel, (window, time) in enumerate(picks):
                    here = slice(int(np.searchsorted(window, first)), int(np.searchsorted(window, last)))
                    at = np.clip((time[here] - starts[window[here]]) / step, 0, longest)
                    row = window[here] - first + offsets
                    values = reader.read(channel, flat, row.ravel(), np.tile(at, len(offsets)))
                    answers[channel][np.array(group), :, here] = values.reshape(len(group), k, -1)
    return answers


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectories:
    """Runs of one model, kept to be read at any instants.

    reader : of the channels. starts (n_windows,), step [s]. stretches : first window of each batch, and its steps (windows, n, n_needs).
    """

    reader: Observer
    starts: Array
    step: float
    stretches: tuple[tuple[int, Array], ...]

    def read(self, picks: Picks) -> list[Array]:
        """Of each channel (m,) [unit] at its picks, as of ``predicted``."""
        found = []
        for channel, (window, time) in enumerate(picks):
            values = np.full(len(time), np.nan)
            for first, steps in self.stretches:
                here = slice(int(np.searchsorted(window, first)), int(np.searchsorted(window, first + len(steps))))
                at = np.clip((time[here] - self.starts[window[here]]) / self.step, 0, steps.shape[1] - 1)
                values[here] = self.reader.read(channel, steps, window[here] - first, at)
            found.append(values)
        return found


def trajectories(model: Any, motions: Array, *, stops: Array, channels: Sequence[Channel], step: float, threads: int) -> Trajectories:
    """Runs of a model without memory from rows of motion (n_windows, numbers) to ``stops`` (n_windows,) [s], read by what channels need."""
    reader, starts = observer(channels), motions[:, 0]
    runs = _single([model], motions[None, None], _steps(starts, stops, step), list(reader.needs), step, threads)
    return Trajectories(
        reader=reader, starts=starts, step=step, stretches=tuple((first, steady(steps[0, 0], reader.needs)) for first, _, steps in runs)
    )


def _steps(starts: Array, stops: Array, step: float) -> NDArray[np.int64]:
    """(n_windows,) steps to run: one more than to the stop, since interpolation looks at both sides of a sample."""
    return 1 + np.maximum(1, np.ceil((stops - starts) / step - 1e-6).astype(np.int64))


def _single(
    models: Sequence[Any], motions: Array, n_steps: NDArray[np.int64], needs: list[tuple[str, str, int]], step: float, threads: int
) -> Iterator[tuple[int, int, Array]]:
    """First and last window of a batch, and steps (n_models, k, windows, steps + 1, n_needs); what is hidden begins at rest."""
    from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

    n_models, k = motions.shape[:2]
    for first, last in batches(n_steps * (n_models * k * len(needs))):
        longest = int(n_steps[first:last].max())
        flat = np.ascontiguousarray(motions[:, :, first:last].reshape(n_models, k * (last - first), -1))
        steps = _solver.windows(models, flat, longest, 1, needs, threads=threads, from_start=True)
        yield first, last, steps.reshape(n_models, k, last - first, longest + 1, len(needs))


def _chained(
    models: Sequence[Any], motions: Array, n_steps: NDArray[np.int64], needs: list[tuple[str, str, int]], step: float, threads: int
) -> Iterator[tuple[int, int, Array]]:
    """The same with what is hidden carried on from window to window, across batches too."""
    from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

    n_models, k, n_windows = motions.shape[:3]
    hidden: list[bytes] = []
    for first, last in batches(n_steps * (n_models * k * len(needs))):
        following = float(motions[0, 0, last, 0]) if last < n_windows else float("nan")
        steps, hidden = _solver.carried(
            models,
            np.ascontiguousarray(motions[:, :, first:last]),
            n_steps[first:last].tolist(),
            needs,
            begin=hidden,
            next_start=following,
            threads=threads,
        )
        yield first, last, steps


def batches(numbers: NDArray[np.int64]) -> Sequence[tuple[int, int]]:
    """Stretches of consecutive windows that together hold at most ``MOST_NUMBERS``; a window alone may hold more."""
    found: list[tuple[int, int]] = []
    first, held = 0, 0
    for window, count in enumerate(numbers.tolist()):
        if window > first and held + count > MOST_NUMBERS:
            found.append((first, window))
            first, held = window, 0
        held += count
    if len(numbers):
        found.append((first, len(numbers)))
    return found
