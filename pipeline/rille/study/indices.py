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
MANY = 0.05  # share of cases left out from which the method says so


def indices(table: StudyTable, outcome: str) -> Indices | None:
    """Indices of one outcome; None if it is constant, or there are too few cases, see ``why_none``.

    Raises
    ------
    ValueError : for an outcome that the study does not ask for.
    """
    y = table.outcome(outcome)
    if _is_constant(y[np.isfinite(y)]):
        return None
    methods = {"sobol": _sobol, "latin_hypercube": _rbd_fast, "grid": _grid}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SALib's of pandas and of divisions that come out NaN
        return methods[table.plan.design](table, outcome, y)


def why_none(table: StudyTable, outcome: str) -> str:
    """In a few words why an outcome has no indices."""
    y = table.outcome(outcome)
    known, design = int(np.isfinite(y).sum()), table.plan.design
    if known > 1 and _is_constant(y[np.isfinite(y)]):
        return "constant"
    used = int(_whole_groups(table.plan, y).sum()) if design == "sobol" else known
    if used < FEWEST[design]:
        return f"{FEWEST[design]} whole groups of cases needed" if design == "sobol" else f"{FEWEST[design]} cases needed"
    return "constant"


def _is_constant(y: Array) -> bool:
    """Nothing to share: fewer than two numbers, or all the same but for roundings."""
    return len(y) < 2 or bool(np.ptp(y) <= CONSTANT * max(1e-300, float(np.abs(y).max())))


def _whole_groups(plan: StudyPlan, y: Array) -> NDArray[np.bool_]:
    """(samples,) groups of Saltelli's scheme of which every case has its number."""
    k = len(plan.factors)
    return np.array([bool(np.isfinite(group).all()) for group in y.reshape(-1, 2 * k + 2 if plan.second_order else k + 2)])


def _without(method: str, used: int, cases: int) -> str:
    """The method, with what was left out where that is much."""
    dropped = 1 - used / cases
    return method if dropped <= MANY else f"{method}, without {100 * dropped:.0f} % of the cases, whose groups are not whole"


def _problem(plan: StudyPlan) -> dict[str, object]:
    k = len(plan.factors)
    return {"num_vars": k, "names": [f.name for f in plan.factors], "bounds": [[0.0, 1.0]] * k}


def _sobol(table: StudyTable, outcome: str, y: Array) -> Indices | None:
    from SALib.analyze import sobol

    plan = table.plan
    whole = _whole_groups(plan, y)
    used = y.reshape(len(whole), -1)[whole].ravel()
    if whole.sum() < FEWEST["sobol"] or _is_constant(used):
        return None
    found = sobol.analyze(_problem(plan), used, calc_second_order=plan.second_order, num_resamples=500, seed=plan.seed)
    return Indices(
        outcome=outcome,
        method=_without("Sobol' indices (Saltelli's estimator, SALib)", len(used), len(y)),
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
    if np.isfinite(y).sum() < FEWEST["grid"]:
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
        are_shares=False,
    )
