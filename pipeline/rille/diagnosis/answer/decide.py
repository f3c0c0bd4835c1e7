"""Which of those that the fitted recordings cannot tell apart predicts what was held out: that one stands first.

Laws that do alike in one motion part ways in another. Each member of the best group keeps its numbers, only starts of the windows are
fitted under it, and the log-likelihood of what was held out, -chi2/(2 kappa), is added to that by which it is behind in the fitted part.
The order and the probabilities follow the sum; the group stays, since likelihoods order and do not exclude.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.evidence.applied import Simulators
from rille.diagnosis.evidence.floor import chi2_floor
from rille.diagnosis.evidence.held_out import Parts
from rille.diagnosis.evidence.replay_evidence import gather
from rille.diagnosis.inference.confound import TIED, is_narrower
from rille.diagnosis.inference.fit import is_told
from rille.diagnosis.inference.found import Found
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.weights import calibration
from rille.model.diagnosis import RankedHypothesis
from rille.model.hypothesis import Setting

Array = NDArray[np.float64]
MOST = 6  # members that are replayed
DECIDED = (
    "{first} predicts what was held out {nats:.3g} nats better than {second}, which the fitted recordings do not tell from it: it stands "
    "first"
)


def decided(simulators: Simulators, parts: Parts, found: Found, *, noise: Mapping[str, tuple[float, str]], window: float,
            rough: float | None = None) -> Found:  # fmt: skip
    """The answer with its group in the order of all recordings, those that were held out too; as it is where there is nothing to decide.

    simulators, noise, window, rough : as of ``gather``.
    """
    members = [k for k, row in enumerate(found.ranked) if row.group == found.ranked[0].group][:MOST]
    if not parts.held_out or len(members) < 2:
        return found
    always = found.setting[: len(found.setting) - len(found.terms)]
    settings = [(*always, *(term.term for term in found.ranked[k].terms)) for k in members]
    held = gather(simulators, parts.held_out, noise=noise, window=window, rough=rough)
    floor = chi2_floor(held, noise)
    judges = [Judge(held.relinearised(setting), setting, floor=floor) for setting in settings]
    kappa = max(floor, min(judge.chi2 / max(judge.degrees, 1.0) for judge in judges))
    behind = np.array([found.ranked[k].behind for k in members])
    told = np.array([0.5 * judge.chi2 / kappa for judge in judges])
    return _reordered(found, members, settings, behind + told - told[0], told)


def _reordered(found: Found, members: Sequence[int], settings: Sequence[Setting], behind: Array, told: Array) -> Found:
    """The answer with the member first that is least ``behind`` (m,) [nats] in all. Only if it is more than ``TIED`` ahead does a law stand
    before a number of the model, a wider law before what it contains (probability 0 in the fitted part), one at all targets before the same
    at one, or one with all numbers open before one that says something. told (m,) : of the held-out part.
    """
    rows = [found.ranked[k] for k in members]
    wider = np.array([row.probability == 0 for row in rows])
    dear = [
        (row.cause != "parameter" and rows[0].cause == "parameter") or _is_open(row) or any(is_narrower(one, setting) for one in settings)
        for row, setting in zip(rows, settings, strict=True)
    ]
    first = int(np.argmin(behind + np.where(wider | np.array(dear), TIED, 0.0)))
    wider[first] = False
    weights = _weights(rows, np.where(wider, np.inf, behind))
    rows = [replace(row, probability=float(p)) for row, p in zip(rows, weights, strict=True)]
    order = [first, *(k for k in np.argsort(behind, kind="stable").tolist() if k != first)]
    rest = [row for k, row in enumerate(found.ranked) if k not in members]
    names = {row.title for row in rows}
    groups = tuple(
        replace(g, members=(*(rows[k].title for k in order), *(m for m in g.members if m not in names))) if g.number == rows[0].group else g
        for g in found.groups
    )
    ranked = tuple(replace(rows[k], loses_because="" if k == first else rows[k].loses_because) for k in order)
    found = replace(found, ranked=(*ranked, *rest), groups=groups)
    if first == 0:
        return found
    alike = found.verdict in ("named", "group") or all(term.term.hypothesis.cause == rows[0].cause for term in rows[first].terms)
    found = replace(found, verdict=found.verdict if alike else "group", setting=settings[first], terms=rows[first].terms)
    nats = float(told[0] - told[first])
    if nats < TIED:
        return found  # the toss of a coin is not worth a word
    note = DECIDED.format(first=rows[first].title, second=rows[0].title, nats=nats)
    return replace(found, notes=(*found.notes, note))


def _is_open(row: RankedHypothesis) -> bool:
    """Whether it leaves numbers open, and the recordings tell none of them."""
    told = [is_told(n, e) for one in row.terms for n, e in zip(one.term.hypothesis.free, one.estimates, strict=True)]
    return bool(told) and not any(told)


def _weights(rows: Sequence[RankedHypothesis], behind: Array) -> Array:
    """(m,) probabilities of members by how far they are behind [nats]; their sum stays."""
    score = -(behind - np.min(behind)) / calibration().temperature
    return np.sum([row.probability for row in rows]) * np.exp(score - np.logaddexp.reduce(score))
