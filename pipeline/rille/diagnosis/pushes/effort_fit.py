"""What a model lacks where nothing pushed, seen in its efforts: a quick linear fit of the catalogue and of the model's numbers.

Of every law and number that acts at once (nothing remembered, no place or moment to be found) the change of the residual effort per unit
is taken at a sample of instants; a bounded, regularised least squares brings the residual efforts nearest to zero. Where laws do the same
they share it: a model that follows the machine as well as it can before pushes are looked for. Which of them lead is told apart by forward
selection.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from rille.diagnosis.evidence.applied import applied
from rille.diagnosis.pushes.residual_effort import ResidualEffort, efforts_at
from rille.model import InputRefused
from rille.model.hypothesis import FreeNumber, Hypothesis, Setting, Term
from rille.model.recording import Recording

Array = NDArray[np.float64]
MOST_INSTANTS = 150  # of one recording
MOST_RECORDINGS = 9
TRIAL = 0.3  # of what is usual of a number: the step of its derivative
FREE = 3.0  # times what is usual that a number may be off: 1 sigma
CORRELATED = 4.0  # neighbouring instants that say the same
LEADING = 0.03  # of the squared residual effort: a law that takes less away does not lead
MOST_LEADING = 6
TINY = 0.01  # of the residual effort: a number that changes less is left alone


def acts_at_once(hypothesis: Hypothesis) -> bool:
    """Whether an effect or number shows in the efforts of every instant, without a search for a place, moment, phase or order."""
    shapes = [n for n in hypothesis.free if not n.amplitude]
    return (
        hypothesis.cause != "sensor"
        and not hypothesis.memory
        and hypothesis.target != "*"
        and all(n.search in ("local", "scale") for n in shapes)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Leading:
    """One of the few that matter most. term : at its value beside the others of them. errors : standard errors of its numbers. share : of
    the squared residual effort that it takes away.
    """

    term: Term
    errors: tuple[float, ...]
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EffortFit:
    """setting : effects and numbers under which the residual efforts are smallest, those that do something. leading : best first."""

    setting: Setting
    leading: tuple[Leading, ...]


def fit_efforts(
    simulator: Any,
    recordings: Sequence[tuple[Recording, ResidualEffort]],
    hypotheses: Sequence[Hypothesis],
    *,
    on_progress: Callable[[int, int, str], None] | None = None,
) -> EffortFit:
    """Effects and numbers under which the residual efforts are smallest.

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``. recordings : with their residual efforts in it. hypotheses : as of ``candidates``.
    """
    columns = [(h, k) for h in hypotheses if acts_at_once(h) for k, n in enumerate(h.free) if n.amplitude]
    chosen = [recordings[k] for k in np.unique(np.linspace(0, len(recordings) - 1, MOST_RECORDINGS).round().astype(int))]
    usual = np.sqrt(np.mean(np.concatenate([e.value for _, e in chosen]) ** 2, axis=0))
    usual = np.where(usual > 0, usual, 1.0)
    blocks, targets = [], []
    for done, (recording, effort) in enumerate(chosen):
        if on_progress:
            on_progress(done, len(chosen), "efforts of every law")
        simulator.drive_by(recording)
        rows = np.unique(np.linspace(0, len(effort.time) - 1, MOST_INSTANTS).round().astype(int))
        base = efforts_at(simulator, effort, rows)
        changes = [_change(simulator, effort, rows, base, h, k) / usual for h, k in columns]
        whole = np.isfinite(base).all(axis=1) & np.isfinite(changes).all(axis=(0, 2))
        blocks.append(np.stack(changes, axis=-1)[whole].reshape(-1, len(columns)))
        targets.append((effort.value[rows] / usual)[whole].reshape(-1))
    design, target = np.concatenate(blocks) / CORRELATED**0.5, np.concatenate(targets) / CORRELATED**0.5
    felt = np.sqrt(np.mean(design**2, axis=0)) * CORRELATED**0.5 * FREE > TINY
    if not felt.any():
        return EffortFit(setting=(), leading=())
    kept = [column for column, here in zip(columns, felt, strict=True) if here]
    design = design[:, felt]
    numbers = [h.free[k] for h, k in kept]
    found = _least(design, target, numbers)
    size = np.abs(found) * np.sqrt(np.mean(design**2, axis=0)) * CORRELATED**0.5
    values: dict[str, tuple[Hypothesis, dict[str, float]]] = {}
    for (h, k), n, x, s in zip(kept, numbers, found, size, strict=True):
        if s > TINY:
            values.setdefault(f"{h.cause} {h.title}", (h, {}))[1][h.free[k].name] = n.absent + x * n.spread
    return EffortFit(setting=tuple(h.at(v) for h, v in values.values()), leading=_leading(kept, design, target))


def _least(design: Array, target: Array, numbers: Sequence[FreeNumber]) -> Array:
    """(k,) [spread] changes of the numbers within their bounds that bring target + design x nearest to zero."""
    lower = np.array([min(0.0, (n.lower - n.absent) / n.spread) for n in numbers])
    upper = np.array([max(0.0, (n.upper - n.absent) / n.spread) for n in numbers])
    matrix = np.concatenate([design, np.eye(len(numbers)) / FREE])
    found = lsq_linear(matrix, np.concatenate([-target, np.zeros(len(numbers))]), (lower - 1e-9, upper + 1e-9)).x
    return np.clip(found, lower, upper)


def _leading(columns: Sequence[tuple[Hypothesis, int]], design: Array, target: Array) -> tuple[Leading, ...]:
    """Forward selection (Efroymson 1960): the hypothesis that takes away most, as long as that is ``LEADING`` of the residual effort."""
    numbers = [h.free[k] for h, k in columns]
    places: dict[str, list[int]] = {}
    for place, (h, _) in enumerate(columns):
        places.setdefault(f"{h.cause} {h.title}", []).append(place)
    whole = left = float(target @ target)
    taken: list[str] = []
    shares: list[float] = []
    while len(taken) < MOST_LEADING and whole > 0:
        tried = {}
        for name in places:
            if name not in taken:
                chosen = [p for one in (*taken, name) for p in places[one]]
                x = _least(design[:, chosen], target, [numbers[p] for p in chosen])
                tried[name] = float(np.sum((target + design[:, chosen] @ x) ** 2))
        best = min(tried, key=lambda name: tried[name], default="")
        if not best or left - tried[best] < LEADING * whole:
            break
        taken.append(best)
        shares.append((left - tried[best]) / whole)
        left = tried[best]
    chosen = [p for name in taken for p in places[name]]
    x = _least(design[:, chosen], target, [numbers[p] for p in chosen]) if chosen else np.empty(0)
    spread = np.sqrt(np.diagonal(np.linalg.pinv(design[:, chosen].T @ design[:, chosen])) * left / max(len(target) - len(chosen), 1))
    by_place = dict(zip(chosen, zip(x, spread, strict=True), strict=True))
    found = []
    for name, share in zip(taken, shares, strict=True):
        h = columns[places[name][0]][0]
        values = {numbers[p].name: numbers[p].absent + float(by_place[p][0]) * numbers[p].spread for p in places[name]}
        errors = {numbers[p].name: float(by_place[p][1]) * numbers[p].spread for p in places[name]}
        found.append(Leading(term=h.at(values), errors=tuple(errors.get(n.name, 0.0) for n in h.free), share=share))
    return tuple(found)


def _change(simulator: Any, effort: ResidualEffort, rows: NDArray[np.int64], base: Array, hypothesis: Hypothesis, place: int) -> Array:
    """(m, C) change of the residual effort per usual size of one number; zeros where the model cannot have it."""
    number = hypothesis.free[place]
    try:
        changed = applied(simulator, (hypothesis.at({number.name: number.absent + TRIAL * number.spread}),))
        return (efforts_at(changed, effort, rows) - base) / TRIAL
    except InputRefused:
        return np.zeros_like(base)
