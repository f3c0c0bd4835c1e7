"""What recordings say about settings: standardised residuals in windows, free of what the unknown start of each window could do.

Of a window w with start x = x_smoothed + L z, z ~ N(0, 1), the residual in sigmas is r(z) = r + D z + noise. Marginalised over z it is
normal with the covariance C = I + D D^T. All comparisons of hypotheses are made in this metric, <a, b> = sum_w a_w^T C_w^-1 b_w: what a
different start could explain as well speaks for nothing.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.model.hypothesis import Setting
from rille.model.recording import Channel

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


class Evidence(Protocol):
    """Data that settings can be judged by. N samples in W windows; samples are sorted by window.

    channels : described without samples. channel (N,) : index into ``channels``. window (N,) : ascending, 0..W-1. time (N,) [s].
    sigma (N,) [unit] : noise that residuals are divided by. run (W,) : which recording a window is of. starts, stops (W,) [s].
    start_gain (N, d) : D, the derivative of the residual by the standardised start (and other nuisances) of its own window.
    """

    @property
    def channels(self) -> tuple[Channel, ...]: ...
    @property
    def channel(self) -> Whole: ...
    @property
    def window(self) -> Whole: ...
    @property
    def time(self) -> Array: ...
    @property
    def sigma(self) -> Array: ...
    @property
    def run(self) -> Whole: ...
    @property
    def starts(self) -> Array: ...
    @property
    def stops(self) -> Array: ...
    @property
    def start_gain(self) -> Array: ...

    def residuals(self, settings: Sequence[Setting]) -> Array:
        """(k, N) standardised residuals (measured - simulated)/sigma of each setting, carried back linearly to the smoothed start:
        r(z_fitted) - D z_fitted. Samples that a run did not reach: ``ENDED``.
        """
        ...

    def relinearised(self, setting: Setting) -> "Evidence":
        """The same data with starts fitted, and D taken, under another setting. Settings stay on top of the base model."""
        ...

    def subset(self, windows: Whole, *, roughly: bool = False) -> "Evidence":
        """Only these windows (ascending numbers), renumbered from 0. roughly : good enough for a first look."""
        ...


LEAST_SEEN = 1e-6  # squared length [sigma] of a column of D that changes anything, far above the rounding of D^T D
ENDED = 10.0  # [sigma] counted for a sample that a run did not reach


class Metric:
    """Products a^T C^-1 b per window, and C^-1/2 a. C = I + D D^T."""

    def __init__(self, window: Whole, start_gain: Array) -> None:
        self.n_windows = int(window[-1]) + 1 if len(window) else 0
        self.edges = np.searchsorted(window, np.arange(self.n_windows + 1))
        self._parts: list[tuple[Array, Array]] = []  # of each window: orthonormal columns U of D, and what C^-1/2 takes off along them
        for first, last in self._spans():
            gain = start_gain[first:last]
            squares, right = np.linalg.eigh(gain.T @ gain) if gain.size else (np.empty(0), gain.T)  # D = U S V^T
            seen = squares > max(LEAST_SEEN, 1e-12 * squares.max(initial=0.0))
            size = np.sqrt(squares[seen])
            self._parts.append((gain @ right[:, seen] / size, 1.0 - 1.0 / np.sqrt(1.0 + size**2)))

    def _spans(self) -> list[tuple[int, int]]:
        return list(zip(self.edges[:-1].tolist(), self.edges[1:].tolist(), strict=True))

    def whitened(self, blocks: Array) -> Array:
        """C^-1/2 applied to (k, N): what is left after the starts were free. Unit variance per sample if the setting is right."""
        result = np.array(blocks, dtype=float)
        for (first, last), (left, off) in zip(self._spans(), self._parts, strict=True):
            if left.size:
                part = result[:, first:last]
                part -= ((part @ left) * off) @ left.T
        return result

    def gram(self, whitened: Array) -> Array:
        """(W, k, k) products of whitened blocks (k, N) per window: all that linear comparisons of settings need."""
        return np.stack([whitened[:, first:last] @ whitened[:, first:last].T for first, last in self._spans()])

    @property
    def degrees(self) -> Array:
        """(W,) degrees of freedom: samples less what the starts have taken, trace of C^-1."""
        return np.array(
            [last - first - np.sum(1.0 - (1.0 - off) ** 2) for (first, last), (_, off) in zip(self._spans(), self._parts, strict=True)]
        )

    @cached_property
    def own_degrees(self) -> Array:
        """(N,) what is left of the freedom of each sample, the diagonal of C^-1."""
        return np.concatenate([1.0 - left**2 @ (1.0 - (1.0 - off) ** 2) if left.size else np.ones(last - first)
                               for (first, last), (left, off) in zip(self._spans(), self._parts, strict=True)])  # fmt: skip
