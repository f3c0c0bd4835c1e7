"""Three witnesses: of two channels that disagree, the one that nothing else predicts is the bad one."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import GateFinding
from rille.recording.gate.lag import Fit
from rille.recording.gate.noise import white_noise
from rille.recording.gate.relations import Pair
from rille.recording.gate.track import Track, windows

Array = NDArray[np.float64]
DISAGREE = 0.3  # R^2 of a pair below which the two tell of different things
EXCESS = 4.0  # standard deviation of their difference, in those of the white noise of both
PREDICTED = 0.5  # R^2 on stretches that were not fitted, from which the others are said to predict a channel
WORSE = 3.0  # times the part that stays unexplained: the odd one out against the other
FOLDS = 5
SHARES = 12  # windows per stretch, at least


def check_witnesses(
    tracks: Mapping[str, Track], fits: Sequence[tuple[Pair, Fit]], made_of: Mapping[str, Sequence[str]]
) -> list[GateFinding]:
    """``bad_channel`` where a third witness tells which of two is wrong, ``disagreement`` where none does.

    The witness is any linear combination of the other channels and of their changes that predicts one of the two on stretches of time which
    were not fitted. made_of : channels that a turning is made of, which do not witness for it, nor it for any.
    """
    found = {}
    for pair, fit in fits:
        if pair.kind not in ("same", "rate") or fit.agreement > DISAGREE:
            continue
        excess = _excess(tracks[pair.first], tracks[pair.second], pair.order)
        if excess < EXCESS:
            continue
        involved = {pair.first, pair.second, *made_of.get(pair.first, ())}
        others = [name for name in tracks if name not in involved and name not in made_of]
        scores = {name: _predicted(tracks, name, others) for name in (pair.first, pair.second)}
        good, bad = sorted(scores, key=lambda name: -scores[name])
        detail = {
            "first": pair.first,
            "second": pair.second,
            "order": pair.order,
            "agreement": fit.agreement,
            "excess": excess,
            "predicted": scores,
        }
        if scores[good] > PREDICTED > scores[bad] and 1 - scores[bad] > WORSE * (1 - scores[good]):
            message = (
                f"channel '{bad}' tells nothing of the motion: it disagrees with '{good}' (R^2 {max(fit.agreement, 0):.2f}), which the "
                f"other channels predict with R^2 {scores[good]:.2f}, and '{bad}' with R^2 {max(scores[bad], 0):.2f}; "
                'set role = "ignore" for it'
            )
            found[bad] = GateFinding(code="bad_channel", severity="warning", channel=bad, detail=detail, message=message)
        elif excess > 2 * EXCESS:
            message = (
                f"channels '{pair.first}' and '{pair.second}' disagree (R^2 {max(fit.agreement, 0):.2f}, difference {excess:.3g} times "
                "their noise), and no third one tells which is wrong; look at both, and leave one out"
            )
            found.setdefault(
                pair.second, GateFinding(code="disagreement", severity="warning", channel=pair.second, detail=detail, message=message)
            )
    return list(found.values())


def _excess(first: Track, second: Track, order: int) -> float:
    query, half = windows((first, second))
    if len(query) < SHARES:
        return 0.0
    if order == 0:  # changes over a window, so that an offset between the two does not count
        one, other = (track.at(query + half) - track.at(query - half) for track in (first, second))
        noise = np.hypot(white_noise(first.value), white_noise(second.value)) * np.sqrt(2)
    else:
        one, other = first.mean(query, half, 1), second.mean(query, half, 0)
        noise = np.hypot(white_noise(first.value) / (np.sqrt(2) * half), white_noise(second.value) * np.sqrt(second.step / (2 * half)))
    difference = one - other
    scale = max(float(noise), 1e-9 * float(np.abs(one).max() + np.abs(other).max()), 1e-300)
    return float(np.std(difference) / scale)


def _predicted(tracks: Mapping[str, Track], name: str, others: Sequence[str]) -> float:
    """R^2 with which the other channels predict the changes of a channel over windows, on folds that were left out."""
    if not others:
        return 0.0
    used = [tracks[name], *(tracks[other] for other in others)]
    query, half = windows(used)
    if len(query) < 4 * FOLDS + 4 * len(others):
        return 0.0
    wanted = tracks[name].at(query + half) - tracks[name].at(query - half)
    columns = [np.ones(len(query))]
    for track in used[1:]:
        columns += [track.mean(query, half, 0), track.at(query + half) - track.at(query - half)]
    given = np.stack(columns, axis=1)
    scale = np.maximum(given.std(axis=0), 1e-12 * np.abs(given).max(axis=0) + 1e-300)
    scale[0] = 1.0
    given = given / scale
    fold = (np.arange(len(query)) * FOLDS * 4 // len(query)) % FOLDS  # long runs of windows, as neighbours overlap
    left = np.empty(len(query))
    for k in range(FOLDS):
        train = fold != k
        normal = given[train].T @ given[train] + 1e-6 * np.count_nonzero(train) * np.eye(given.shape[1])
        left[~train] = wanted[~train] - given[~train] @ np.linalg.solve(normal, given[train].T @ wanted[train])
    total = float(np.sum((wanted - wanted.mean()) ** 2))
    return 1 - float(left @ left) / total if total > 0 else 0.0
