"""What settings leave of the evidence, whitened; and many small inquiries answered together, so that replays come in large batches."""

from collections.abc import Callable, Generator, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.evidence.evidence import ENDED, Array, Evidence, Metric
from rille.model.hypothesis import Setting

Single = NDArray[np.float32]
Progress = Callable[[str, float], None]
Answer = TypeVar("Answer")
Inquiry = Generator[list[Setting], Array, Answer]
"""Yields settings, is sent their whitened residuals (k, N), returns an answer."""

MOST_NUMBERS = 8_000_000  # of one batch of residuals
FARTHEST = 1e4  # [sigma] larger residuals count as this


class Judge:
    """Evidence with its metric and the setting that others are compared with.

    raw, base (N,) : residual of ``on_top``, and the same whitened. chi2, degrees : sums over windows; ``floor`` is the chi-squared per
    degree that noise alone gives. ``replays`` : settings that were run so far.
    """

    def __init__(self, evidence: Evidence, on_top: Setting = (), *, floor: float = 1.0) -> None:
        self.evidence = evidence
        self.on_top = on_top
        self.floor = floor
        self.metric = Metric(evidence.window, evidence.start_gain)
        self.window_degrees = self.metric.degrees
        self.degrees = float(np.sum(self.window_degrees))
        self.replays = 1
        self.raw = np.clip(np.nan_to_num(evidence.residuals([on_top])[0], nan=FARTHEST), -FARTHEST, FARTHEST)
        self._penalty = np.where(self.raw == ENDED, ENDED, np.maximum(ENDED, 2.0 * np.abs(self.raw)))
        self.base = self.metric.whitened(self.raw[None])[0]
        self.chi2 = float(self.base @ self.base)

    def per_channel(self, values: Array) -> Array:
        """(channels,) sums over the channels of (N,) values."""
        return np.bincount(self.evidence.channel, values, len(self.evidence.channels)).astype(float)

    @property
    def excess(self) -> float:
        """Chi-squared beyond what noise gives."""
        return self.chi2 - self.floor * self.degrees

    @property
    def window_excess(self) -> Array:
        """(W,) the same of each window."""
        return self.per_window(self.base**2) - self.floor * self.window_degrees

    @property
    def most(self) -> int:
        """Settings of one batch."""
        return max(8, MOST_NUMBERS // max(len(self.base), 1))

    def per_window(self, values: Array) -> Array:
        """(W,) sums over the windows of (N,) values."""
        return np.add.reduceat(values, self.metric.edges[:-1]) if len(values) else np.empty(0)

    def whitened(self, settings: Sequence[Setting]) -> Array:
        """(k, N). A sample that a setting does not reach, though the base did, costs more than the base's residual: ending never pays."""
        self.replays += len(settings)
        raw = np.clip(np.nan_to_num(self.evidence.residuals(settings), nan=FARTHEST), -FARTHEST, FARTHEST)
        return self.metric.whitened(np.where(raw == ENDED, self._penalty, raw))


def cosine(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """How alike two changes of residuals (N,) are, from -1 (opposite) to 1; 0 if there is none."""
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0 else 0.0


def ask_together(judge: Judge, inquiries: Sequence[Inquiry[Answer]], tell: Callable[[float], None] | None = None) -> list[Answer]:
    """Run inquiries in step, the settings of all of them in common batches. tell : called with the share of inquiries that are done."""
    answers: dict[int, Answer] = {}
    open_questions: dict[int, list[Setting]] = {}

    def listen(i: int, block: Array | None) -> None:
        try:
            open_questions[i] = next(inquiries[i]) if block is None else inquiries[i].send(block)
        except StopIteration as end:
            answers[i] = end.value
            open_questions.pop(i, None)

    for i in range(len(inquiries)):
        listen(i, None)
    while open_questions:
        waiting = sorted(open_questions.items())
        while waiting:
            taken, count = [], 0
            while waiting and (not taken or count + len(waiting[0][1]) <= judge.most):
                taken.append(waiting.pop(0))
                count += len(taken[-1][1])
            blocks = judge.whitened([setting for _, settings in taken for setting in settings])
            first = 0
            for i, settings in taken:
                listen(i, blocks[first : first + len(settings)])
                first += len(settings)
            if tell is not None:
                tell(len(answers) / len(inquiries))
    return [answers[i] for i in range(len(inquiries))]
