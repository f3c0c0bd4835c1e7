"""Ranking of fitted settings by how well they predict windows that their numbers were not fitted to.

Of each fold f the numbers that all other folds prefer follow from the quadratic expansion at the fit, without new replays:
delta_f = argmin of |w + J delta|^2 over the other folds within the bounds; the residual held out is w_f + J_f delta_f. Log-likelihoods are
-chi2/(2 kappa) with the over-dispersion kappa of the best setting. A setting whose numbers rest on one fold or two alone (a push, a patch
that is crossed once) cannot be held out; it is charged (k/2) log n instead (Schwarz 1978), for the k numbers that it tells, and has no
credit at all where it leaves a gross misfit: a push that a wrong model asks for is no push. Neither is one held out that changes the
recordings as such a setting does: a law before a gear and the same law behind it are judged alike.

Standard errors of a difference in log-likelihood: if a is right, its residual is noise, so the difference deviates from what is expected by
e_w = <a, b - a>_w / kappa in window w. The error is the root of the sum of e_w^2, over windows or over stretches of them, whichever is
larger, and never less than what independent noise of variance kappa would give, |b - a|/sqrt(kappa).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as t_distribution

from rille.diagnosis.evidence.evidence import Array, Evidence, Whole
from rille.diagnosis.inference.bounded_squares import bounded_minimum
from rille.diagnosis.inference.fit import Fitted
from rille.diagnosis.inference.folds import folds
from rille.diagnosis.inference.judge import Judge
from rille.model.hypothesis import Setting

TWINS = 0.9995  # correlation of what two settings change, beyond which they are two words for one thing
RESTS_ON_ONE, RESTS_ON_TWO = 0.75, 0.95  # share of a number's information in one fold, or two, beyond which it cannot be held out
GROSS = 10.0  # chi-squared per degree of a gross misfit
ERRORS = 2.0  # standard errors of a difference that counts, with many windows


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """Entry 0 is the base, then the settings in their order.

    gain (m,) [nats] : held-out log-likelihood above the base. ahead, ahead_error (m, m) : by how much i is ahead of j, with its error if i
    is right. bic (m,) : chi2/kappa + k log n. alone (m,) : cannot be held out. charged (m,) [nats] : for its numbers, if so. chi2 (m,),
    window_chi2 (m, W). moved (m,) : size of what it changes in the base's residuals. likeness (m, m) : correlation of what i and j change.
    kappa : over-dispersion. needed : standard errors that count, more with few windows. degrees. channel_chi2 (m, channels).
    channel_count (channels,).
    """

    gain: Array
    ahead: Array
    ahead_error: Array
    bic: Array
    alone: NDArray[np.bool_]
    charged: Array
    chi2: Array
    window_chi2: Array
    moved: Array
    likeness: Array
    kappa: float
    needed: float
    degrees: float
    channel_chi2: Array
    channel_count: Array

    def clearly_ahead(self, i: int, j: int, nats: float = 0.0) -> bool:
        """Whether i predicts better than j by more than the errors, and by more than ``nats``."""
        return bool(self.ahead[i, j] > self.needed * self.ahead_error[i, j] and self.ahead[i, j] > nats)


def rank(evidence: Evidence, fitted: Sequence[Fitted], *, on_top: Setting = (), judge: Judge | None = None) -> Scores:
    """Compare fitted settings with the base (``on_top``, or that of ``judge``) and with each other.

    The settings may have been fitted under starts of their own, other than those of the judge, in the same windows.
    """
    judge = judge or Judge(evidence, on_top)
    edges, fold = judge.metric.edges, folds(evidence.run)
    stack = np.empty((len(fitted) + 1, len(judge.base)), dtype=np.float32)
    stack[0] = judge.base
    alone = np.zeros(len(fitted) + 1, dtype=bool)
    sizes = np.array([0.0] + [one.told for one in fitted])
    chi2 = np.array([judge.chi2] + [one.chi2 for one in fitted])
    for i, one in enumerate(fitted, start=1):
        stack[i], alone[i] = held_out(one, edges, fold)
    for i in _twins(judge.base, fitted, alone):
        stack[i], alone[i] = fitted[i - 1].residual, True
    best = int(np.argmin(chi2))
    degrees = fitted[best - 1].degrees if best else judge.degrees
    kappa = max(1.0, float(chi2[best]) / max(judge.floor * (degrees - sizes[best]), 1.0)) * judge.floor
    gram = np.stack([stack[:, a:b] @ stack[:, a:b].T for a, b in pairwise(edges.tolist())]).astype(float)
    own = np.diagonal(gram, axis1=1, axis2=2)
    total = np.sum(own, axis=0)
    charged = np.where(alone, 0.5 * sizes * np.log(max(judge.degrees, 2.0)), 0.0)
    gross = alone & (chi2 > GROSS * judge.floor * judge.degrees)
    charged = np.where(gross, np.maximum(charged, 0.5 * (total[0] - total) / kappa + 1.0), charged)
    score = -0.5 * total / kappa - charged
    slip = (gram - own[:, :, None]) / kappa
    stretches = np.zeros((int(fold.max()) + 1 if len(fold) else 1, *slip.shape[1:]))
    np.add.at(stretches, _stretches(fold, evidence.run, len(stretches)), slip)
    apart = np.maximum(total[:, None] + total[None, :] - 2 * np.sum(gram, axis=0), 0.0)
    variance = np.maximum(np.maximum(np.sum(slip**2, axis=0), np.sum(stretches**2, axis=0)), apart / kappa)
    change = np.sum(gram, axis=0) - np.sum(gram[:, :1], axis=0) - np.sum(gram[:, :, :1], axis=0) + np.sum(gram[:, :1, :1], axis=0)
    size = np.sqrt(np.maximum(np.diagonal(change), 1e-12))
    channel_chi2 = np.stack([np.bincount(evidence.channel, row.astype(float) ** 2, len(evidence.channels)) for row in stack]).astype(float)
    return Scores(
        gain=score - score[0],
        ahead=score[:, None] - score[None, :],
        ahead_error=np.sqrt(variance),
        bic=chi2 / kappa + sizes * np.log(max(judge.degrees, 2.0)),
        alone=alone,
        charged=charged,
        chi2=chi2,
        window_chi2=own.T,
        moved=size,
        likeness=np.clip(change / np.outer(size, size), -1.0, 1.0),
        kappa=kappa,
        needed=standard_errors_that_count(judge.metric.n_windows),
        degrees=judge.degrees,
        channel_chi2=channel_chi2,
        channel_count=np.bincount(evidence.channel, minlength=len(evidence.channels)).astype(float),
    )


def held_out(one: Fitted, edges: Whole, fold: Whole) -> tuple[Array, bool]:
    """(N,) residuals of each fold at the numbers that the other folds prefer; and whether a number rests on too few to be held out."""
    residual = one.residual.astype(float)
    if not one.unknowns:
        return residual, False
    columns = np.concatenate([one.jacobian, one.residual[None]])
    spans = list(pairwise(edges.tolist()))
    grams = np.zeros((int(fold.max()) + 1, len(columns), len(columns)))
    for w, (a, b) in enumerate(spans):
        grams[fold[w]] += columns[:, a:b] @ columns[:, a:b].T
    total = np.sum(grams, axis=0)
    information = np.diagonal(grams, axis1=1, axis2=2)[:, :-1]
    amplitude = np.array([u.number.amplitude for u in one.unknowns])
    heard = np.sum(information, axis=0) > 0
    judged = heard & (amplitude if np.any(heard & amplitude) else True)
    shares = np.sort(information[:, judged] / np.sum(information[:, judged], axis=0), axis=0)[::-1]
    if len(grams) < 3 or np.any(shares[0] > RESTS_ON_ONE) or np.any(shares[0] + shares[1] > RESTS_ON_TWO):
        return residual, True
    down, up = one.room
    stride = np.array([min(u.stride, 1e12) for u in one.unknowns])
    prior = one.kappa * one.precision
    centre = np.array([u.centre for u in one.unknowns])
    for f in range(len(grams)):
        rest = total - grams[f]
        step, _ = bounded_minimum(
            rest[:-1, :-1] + prior, rest[:-1, -1] + prior @ (one.where - centre), np.maximum(down, -stride), np.minimum(up, stride)
        )
        shift = one.jacobian.T @ step
        for w in np.flatnonzero(fold == f):
            a, b = spans[w]
            residual[a:b] += shift[a:b]
    return residual, False


def _twins(base: Array, fitted: Sequence[Fitted], alone: NDArray[np.bool_]) -> Whole:
    """Entries that were held out, though they change the base's residuals as one does that cannot be."""
    known = np.flatnonzero(alone)
    others = np.setdiff1d(np.arange(1, len(fitted) + 1), known)
    if not len(known) or not len(others):
        return np.empty(0, dtype=np.int64)
    change = np.array([one.residual - base for one in fitted], dtype=float)
    change /= np.maximum(np.linalg.norm(change, axis=1), 1e-12)[:, None]
    return others[np.max(change[others - 1] @ change[known - 1].T, axis=1) > TWINS]


def standard_errors_that_count(n_windows: int) -> float:
    """Student's t with as many degrees as there are windows less one, at the level that two standard errors mean with many."""
    return float(t_distribution.isf(norm.sf(ERRORS), max(n_windows - 1, 1)))


def _stretches(fold: Whole, run: Whole, count: int) -> Whole:
    """(W,) contiguous stretches of windows, as many as there are folds."""
    return np.minimum(np.arange(len(fold)) * count // max(len(fold), 1), count - 1)
