"""SINDy on the residual: a sparse sum of terms of a library that explains the missing forces, and the catalogue's name of the largest.

Sequentially thresholded least squares (Brunton, Proctor & Kutz 2016) of pysindy, on the whitened samples themselves (see ``residuals``).
Columns have unit length there, so that a coefficient is the root of the chi-squared that its term alone takes off, and the threshold is one
in sigmas. It is chosen by cross-validation over windows of the training recordings: the sparsest model within one standard error of the
best (Hastie et al. 2009, ch. 7.10).
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pysindy
from numpy.typing import NDArray

from rille.proof.baselines.names import BaselineAnswer, Term, library, usual_sizes
from rille.proof.baselines.residuals import ResidualTable, gap_closed

Array = NDArray[np.float64]
THRESHOLDS = (3.0, 4.0, 5.5, 8.0, 11.0, 16.0, 23.0, 32.0, 45.0, 64.0, 90.0)  # [sigma]
RIDGE = 0.1  # of columns of unit length; terms that the data cannot tell apart share, and do not cancel
SEEN = 1e-6  # [sigma] length of a column over its largest force, below which it does nothing here
ALIKE = 0.999  # correlation beyond which two terms are one on these recordings; the first of the library speaks for both
SURE = 2.0  # standard errors of the cross-validated gain, below which nothing is said


@dataclass(frozen=True, slots=True, kw_only=True)
class _Columns:
    """Terms that do something, and what they add to the samples. value (P, N), of unit length; length (P,) [sigma] for a coefficient 1."""

    terms: tuple[Term, ...]
    value: Array
    length: Array


def sindy(training: ResidualTable, held_out: ResidualTable) -> BaselineAnswer:
    """A name for what is missing, and how much better it makes what was held out.

    The name is that of the term without which chi-squared of the training would rise most. Nothing is said where the cross-validated gain
    is less than ``SURE`` standard errors, over windows, above 0.
    """
    usual = usual_sizes(training)
    columns = _columns(training, library(training, usual))
    before = held_out.size()
    threshold, sure = _threshold(training, columns)
    coefficients = _fit(_packed(columns.value, training.left), threshold) if sure else np.zeros(len(columns.terms))
    active = np.flatnonzero(coefficients)
    if not len(active):
        return BaselineAnswer(baseline="sindy", name=None, number=0.0, differs=False, before=before, after=before,
                              gap_closed=gap_closed(before, before), detail="no term improves the cross-validated error")  # fmt: skip
    there = {term.words: term for term in library(held_out, usual)}
    predicted = np.zeros(len(held_out.left))
    for k in active:
        predicted += coefficients[k] / columns.length[k] * _answer(held_out, there[columns.terms[k].words])
    after = held_out.size(predicted)
    leading = active[np.argsort(-_losses(columns.value[active], training.left))]
    first = columns.terms[leading[0]]
    return BaselineAnswer(
        baseline="sindy",
        name=first.name,
        number=float(coefficients[leading[0]] / columns.length[leading[0]]),
        differs=True,
        before=before,
        after=after,
        gap_closed=gap_closed(before, after),
        detail=", ".join(f"{coefficients[k] / columns.length[k]:+.3g} ({columns.terms[k].words})" for k in leading),
    )


def _answer(table: ResidualTable, term: Term) -> Array:
    """(N,) what a term with the coefficient 1 adds to the samples."""
    return np.sum([table.answer(number, force) for number, force in term.forces], axis=0) if term.forces else np.zeros(len(table.left))


def _columns(table: ResidualTable, terms: Sequence[Term]) -> _Columns:
    """Columns of the terms that are seen, without those that are like an earlier one."""
    kept: list[Term] = []
    values = np.empty((len(terms), len(table.left)))
    lengths: list[float] = []
    for term in terms:
        column = _answer(table, term)
        length = float(np.linalg.norm(column))
        largest = max((float(np.abs(force).max()) for _, force in term.forces), default=0.0)
        if not np.isfinite(length) or largest <= 0 or length <= SEEN * largest:
            continue
        column = column / length
        if kept and float(np.abs(values[: len(kept)] @ column).max()) > ALIKE:
            continue
        values[len(kept)] = column
        kept.append(term)
        lengths.append(length)
    return _Columns(terms=tuple(kept), value=values[: len(kept)], length=np.array(lengths))


def _packed(columns: Array, left: Array) -> Array:
    """(P + 1, P + 1) triangle of the least squares of ``left`` (n,) by ``columns`` (P, n): the same in fewer rows."""
    return _triangle(np.vstack([columns, left]).T)


def _triangle(rows: Array) -> Array:
    """R of Q R = rows: the same products in fewer rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=float)


def _fit(packed: Array, threshold: float) -> Array:
    """(P,) coefficients [sigma]; 0 of terms that are left out."""
    if packed.shape[1] < 2:
        return np.zeros(0)
    optimizer = pysindy.STLSQ(threshold=threshold, alpha=RIDGE, max_iter=50)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that no term is left is an answer
        return np.asarray(optimizer.fit(packed[:, :-1], packed[:, -1:]).coef_, dtype=float)[0]


def _threshold(table: ResidualTable, columns: _Columns) -> tuple[float, bool]:
    """Threshold of the sparsest model within one standard error of the best, and whether that is surely better than nothing."""
    gains = np.zeros((len(THRESHOLDS), len(table.time)))
    parts = np.unique(table.part)
    of_sample = table.part[table.window]
    packed = [_packed(columns.value[:, of_sample == part], table.left[of_sample == part]) for part in parts]
    for number, part in enumerate(parts):
        out = table.part == part
        others = _triangle(np.vstack([rows for k, rows in enumerate(packed) if k != number]))
        for row, threshold in enumerate(THRESHOLDS):
            coefficients = _fit(others, threshold)
            gains[row, out] = (table.chi2() - table.chi2(coefficients @ columns.value))[out]
    total = gains.sum(axis=1)
    error = np.sqrt(len(table.time)) * gains.std(axis=1, ddof=1)
    best = int(np.argmax(total))
    chosen = max(row for row in range(len(THRESHOLDS)) if total[row] >= total[best] - error[best] or row == best)
    return THRESHOLDS[chosen], bool(total[chosen] > SURE * error[chosen] and total[chosen] > 0)


def _losses(columns: Array, left: Array) -> Array:
    """(p,) by how much chi-squared of a least-squares fit rises without each of the columns (p, N)."""
    coefficients, *_ = np.linalg.lstsq(columns.T, left, rcond=None)
    return coefficients**2 / np.maximum(np.diagonal(np.linalg.pinv(columns @ columns.T, hermitian=True)), 1e-300)
