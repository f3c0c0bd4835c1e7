"""Settings of which a part acts for a moment only: replayed in the windows that the moment touches, elsewhere as without that part."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.evidence.evidence import Array
from rille.diagnosis.evidence.evidence_part import Part
from rille.model.hypothesis import Setting

Chosen = NDArray[np.bool_]
WORTH = 0.7  # share of the windows up to which it is worth while
AFTER = 2  # steps that a replay goes on after the end of its window


def residuals(part: Part, settings: Sequence[Setting]) -> Array:
    """(k, m) as ``Part.residuals``. Of a model with memory, where a moment is felt for ever, everything is replayed."""
    touched = (_touched(part, setting) for setting in settings)
    brief = {k: windows for k, windows in enumerate(touched) if np.mean(windows) <= WORTH}
    if not brief:
        return part.residuals(settings)
    lasting = [k for k in range(len(settings)) if k not in brief]
    rest = {k: tuple(term for term in settings[k] if term.moment is None) for k in brief}
    without = {tuple(map(id, setting)): setting for setting in rest.values()}
    row = {key: number for number, key in enumerate(without, start=len(lasting))}
    replayed = part.residuals([*(settings[k] for k in lasting), *without.values()])
    found = np.empty((len(settings), replayed.shape[1]))
    found[lasting] = replayed[: len(lasting)]
    groups: dict[bytes, list[int]] = {}
    for k in brief:
        found[k] = replayed[row[tuple(map(id, rest[k]))]]
        if brief[k].any():
            groups.setdefault(brief[k].tobytes(), []).append(k)
    for members in groups.values():
        windows = np.flatnonzero(brief[members[0]])
        here = np.flatnonzero(np.isin(part.window, windows))
        there = part.only(windows).residuals([settings[k] for k in members])
        found[np.array(members)[:, None], here] = there
        refused = np.isnan(there).any(axis=1)
        found[np.array(members)[refused]] = np.nan
    return found


def _touched(part: Part, setting: Setting) -> Chosen:
    """(n_windows,) whether anything of a setting may act in a window and not at all times."""
    moments = [term.moment for term in setting if term.moment is not None]
    if not moments or part.simulator.has_memory or any(term.hypothesis.memory for term in setting):
        return np.ones(len(part.first), dtype=bool)
    begins, ends = part.states[:, 0], part.last + AFTER * part.simulator.step
    return np.any([(begins < last) & (ends > first) for first, last in moments], axis=0)
