"""Sensitivity indices: how much of an outcome's variance each factor brings, by the method that the design allows.

sobol : Saltelli 2002 and Jansen 1999, as in SALib, with 95 % intervals from its bootstrap; groups of cases with one that did not go as
planned are left out as wholes. latin_hypercube : RBD-FAST (Tarantola et al. 2006, bias taken off after Tissot & Prieur 2012), first order
only, with intervals. grid : all combinations are there, so that shares of variance are sums, no estimates: S_i = Var(E[Y|x_i]) / Var(Y),
T_i = E[Var(Y|all but x_i)] / Var(Y); a grid with gaps has medians of PAWN (Pianosi & Wagener 2018), which are no shares.
"""

import warnings

import numpy as np
from numpy.typing import NDArray

from rille.model.study import Indices, StudyPlan, StudyTable

Array = NDArray[np.float64]
FEWEST = {"sobol": 8, "latin_hypercube": 65, "grid": 4}  # of groups, cases, cases
HARMONICS = 10  # of RBD-FAST
SLICES = 8  # of PAWN
CONSTANT = 1e-12  # relative spread of an outcome that nothing moves


def indices(table: StudyTable, outcome: str) -> Indices | None:
    """Indices of one outcome; None if it is constant, or there are too few cases.

    Raises
    ------
    ValueError : for an outcome that the study does not ask for.
    """
    y = table.outcome(outcome)
    known = y[np.isfinite(y)]
    if len(known) < 2 or np.ptp(known) <= CONSTANT * max(1e-300, float(np.abs(known).max())):
        return None
    methods = {"sobol": _sobol, "latin_hypercube": _rbd_fast, "grid": _grid}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SALib's of pandas and of divisions that come out NaN
        return methods[table.plan.design](table, outcome, y)


def _problem(plan: StudyPlan) -> dict[str, object]:
    k = len(plan.factors)
    return {"num_vars": k, "names": [f.name for f in plan.factors], "bounds": [[0.0, 1.0]] * k}


def _sobol(table: StudyTable, outcome: str, y: Array) -> Indices | None:
    from SALib.analyze import sobol

    plan, k = table.plan, len(table.plan.factors)
    size = 2 * k + 2 if plan.second_order else k + 2
    groups = y.reshape(-1, size)
    whole = np.isfinite(groups).all(axis=1)
    if whole.sum() < FEWEST["sobol"]:
        return None
    used = groups[whole].ravel()
    found = sobol.analyze(_problem(plan), used, calc_second_order=plan.second_order, num_resamples=500, seed=plan.seed)
    return Indices(
        outcome=outcome,
        method="Sobol' indices (Saltelli's estimator, SALib)",
        first=np.array(found["S1"]),
        first_confidence=np.array(found["S1_conf"]),
        total=np.array(found["ST"]),
        total_confidence=np.array(found["ST_conf"]),
        second=np.array(found["S2"]) if plan.second_order else None,
        used=len(used),
        dropped=len(y) - len(used),
    )


def _rbd_fast(table: StudyTable, outcome: str, y: Array) -> Indices | None:
    from SALib.analyze import rbd_fast

    known = np.isfinite(y)
    if known.sum() < FEWEST["latin_hypercube"]:
        return None
    found = rbd_fast.analyze(_problem(table.plan), table.values[known], y[known], M=HARMONICS, num_resamples=200, seed=table.plan.seed)
    return Indices(
        outcome=outcome,
        method="first-order indices by RBD-FAST (SALib)",
        first=np.array(found["S1"]),
        first_confidence=np.array(found["S1_conf"]),
        used=int(known.sum()),
        dropped=int((~known).sum()),
    )


def _grid(table: StudyTable, outcome: str, y: Array) -> Indices | None:
    if len(y) < FEWEST["grid"]:
        return None
    if not np.isfinite(y).all():
        return _pawn(table, outcome, y)
    shape = tuple(len(np.unique(table.values[:, j])) for j in range(table.values.shape[1]))
    cube = y.reshape(shape)
    variance = cube.var()
    axes = range(cube.ndim)
    first = [cube.mean(axis=tuple(a for a in axes if a != j)).var() / variance for j in axes]
    total = [cube.var(axis=j).mean() / variance for j in axes]
    return Indices(
        outcome=outcome,
        method="shares of variance of the full grid",
        first=np.array(first),
        first_confidence=None,
        total=np.array(total),
        used=len(y),
        dropped=0,
    )


def _pawn(table: StudyTable, outcome: str, y: Array) -> Indices | None:
    from SALib.analyze import pawn

    known = np.isfinite(y)
    found = pawn.analyze(_problem(table.plan), table.values[known], y[known], S=SLICES, seed=table.plan.seed)
    return Indices(
        outcome=outcome,
        method="PAWN medians (SALib), since the grid has gaps; no shares of variance",
        first=np.array(found["median"]),
        first_confidence=None,
        used=int(known.sum()),
        dropped=int((~known).sum()),
    )
