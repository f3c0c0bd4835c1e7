"""Which windows are held out together."""

import numpy as np

from rille.diagnosis.evidence.evidence import Whole

MOST = 8
NEIGHBOURS = 2  # windows of one recording that are held out together


def folds(run: Whole) -> Whole:
    """(W,) number of the fold of each window: whole recordings if there are at least four, else small stretches of each in turn.

    run (W,) : which recording a window is of.
    """
    if not len(run):
        return np.empty(0, dtype=np.int64)
    names, number = np.unique(run, return_inverse=True)
    if len(names) >= 4:
        return (number % MOST).astype(np.int64)
    first = np.searchsorted(number, np.arange(len(names))) if np.all(np.diff(number) >= 0) else np.zeros(len(names), dtype=np.int64)
    stretch = (np.arange(len(run)) - first[number]) // (NEIGHBOURS if len(run) >= 2 * NEIGHBOURS * MOST else 1)
    return (stretch % min(MOST, int(stretch.max()) + 1)).astype(np.int64)
