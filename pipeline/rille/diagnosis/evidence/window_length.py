"""How long windows should be: as long as the simulation answers to their starts in a linear way.

The longer a window, the more a small missing force adds up in it, and the less another start can explain it: the evidence grows many times
over. But errors of the start grow, too; where the motion is violent, soon in no linear way, and no window says anything any more.
Nor do long windows of a model that is far off: they end in states that the machine never saw, and where no start fits, the one that was
found is as far from the true one as the smoothed one is: what derivatives there say of it must hold that far.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.evidence_part import Part, gather_part
from rille.diagnosis.starts.start_fit import is_more_than_noise, residuals
from rille.diagnosis.starts.state_coordinates import moved
from rille.model.recording import Recording

Array = NDArray[np.float64]
LENGTHS = (4.0, 3.0, 2.0, 1.5, 1.0, 0.7, 0.5)  # [s] that are tried, longest first; the last one is taken where none is good
WINDOWS, SECONDS = (3, 5), 10.0  # that are tried, and how long [s] together
LEAST = 8  # windows that the recordings must have
DRAWS = 2
BENT = 0.25  # [sigma] root mean square of what is not linear, in three of four windows
QUARTER = 0.75
ASTRAY = 0.25  # share of what the way from a smoothed start to the fitted one changes, where that does not fit, that is not linear
FAR_OFF = 10.0  # [noise] root mean square of the residuals
MOST = 1e3  # [noise] larger residuals count as this


def window_length(
    simulator: Any,
    recording: Recording,
    *,
    duration: float,
    noise: Mapping[str, tuple[float, str]],
    grid: float | None = None,
    longest: float = LENGTHS[0],
) -> tuple[float, Part | None]:
    """Length of windows [s]: the longest of ``LENGTHS`` in which starts drawn from what the recording leaves open answer linearly, those
    that do not fit as far as they may be off, and the model is not far off; and the windows that showed that, None where none did and the
    last length is taken.

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``; it stays as it is. duration : [s] of all recordings together. noise : of channels by name.
    grid : [s], windows begin and end at whole multiples. longest : [s] that is tried.

    Raises
    ------
    InputRefused : as ``compare_windows``.
    """
    for length in LENGTHS[:-1]:
        if length > longest or duration < LEAST * length:
            continue
        most = int(np.clip(SECONDS / length, *WINDOWS))
        part = gather_part(
            simulator, recording, window=length, noise=noise, grid=grid if length >= 4 * (grid or 0.0) else None, most=most, corrected=False
        )
        answers = _answers(part, part.states)
        if _bend(part, answers) < BENT and _misfit(part, answers) < FAR_OFF and _astray(part, answers) < ASTRAY:
            return length, part
    return LENGTHS[-1], None


def _answers(part: Part, states: Array) -> list[Array]:
    """Of each channel (m,) what is simulated from states (n_windows, n)."""
    picks = [(s.window, s.time) for s in part.samples]
    return [answer[0] for answer in part.simulator.predict(states[None], part.last, [s.channel for s in part.samples], picks)]


def _off(part: Part, answers: Sequence[Array]) -> Array:
    """(m,) residuals [noise] in the order of evidence."""
    off = [np.nan_to_num(residuals(s, answer) / s.noise, nan=MOST) for s, answer in zip(part.samples, answers, strict=True)]
    return np.clip(part.ordered(off), -MOST, MOST)


def _misfit(part: Part, answers: Sequence[Array]) -> float:
    """Root mean square [noise] of what the starts cannot explain."""
    left = Metric(part.window, part.start_gain).whitened(_off(part, answers)[None])[0]
    return float(np.sqrt(np.mean(left**2)))


def _astray(part: Part, answers: Sequence[Array]) -> float:
    """Largest share, in windows that no start fits, of what the way from the smoothed start to the fitted one changes, that derivatives at
    the fitted one miss. What is less than the noise is no miss.
    """
    count = np.maximum(np.bincount(part.window, minlength=len(part.first)), 1)

    def mean_squares(left: Array) -> Array:
        return np.bincount(part.window, left**2, len(count)) / count

    at_fitted = _off(part, answers)
    unfit = is_more_than_noise(mean_squares(at_fitted), count)
    if not unfit.any():
        return 0.0
    changes = _off(part, _answers(part, part.starts.states)) - at_fitted
    change, miss = mean_squares(changes), mean_squares(changes - part.ordered(part.moves(part.standard)))
    far = unfit & (miss > 1)
    return float(np.sqrt(np.max(miss[far] / np.maximum(change[far], 1e-12), initial=0.0)))


def _bend(part: Part, answers: Sequence[Array]) -> float:
    """Root mean square [sigma], in three of four windows, of what samples do beyond D z, for starts z drawn as the data leave them open.

    Whitened: what another start or another moment could do as well does not count.
    """
    rng = np.random.default_rng(0)
    metric = Metric(part.window, part.start_gain)
    gain = part.start_gain[:, : len(part.columns)]
    bent = np.zeros(metric.n_windows)
    for _ in range(DRAWS):
        standard = np.zeros_like(part.standard)
        for k, (first, last) in enumerate(zip(metric.edges[:-1], metric.edges[1:], strict=True)):
            d = gain[first:last]
            spread = np.linalg.cholesky(np.linalg.inv(d.T @ d + np.eye(d.shape[1])))
            for (coordinate, order), value in zip(part.columns, spread @ rng.normal(size=d.shape[1]), strict=True):
                standard[k, coordinate, order] = value
        states = moved(part.states, part.starts.coordinates, part.starts.change(standard))
        blocks = []
        for s, slopes, one, other in zip(part.samples, part.slopes, answers, _answers(part, states), strict=True):
            change = (residuals(s, one) - residuals(s, other)) / s.noise
            linear = sum(slopes[k] * standard[s.window, c, order] for k, (c, order) in enumerate(part.columns))
            blocks.append(np.clip(np.nan_to_num(change - linear, nan=1e3), -1e3, 1e3))
        left = metric.whitened(part.ordered(blocks)[None])[0]
        bent += np.add.reduceat(left**2, metric.edges[:-1]) / np.diff(metric.edges) / DRAWS
    return float(np.sqrt(np.quantile(bent, QUARTER)))
