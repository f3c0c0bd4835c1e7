"""Designs: which cases a study has.

Drawn ones are Sobol' sequences or Latin hypercubes of the unit cube, taken through the factors' distributions.
"""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.study import Case, Factor, StudyPlan

Array = NDArray[np.float64]


def design_cases(plan: StudyPlan, levels: int, most: int) -> tuple[Case, ...]:
    """Cases of a study, always the same for the same plan.

    grid : all combinations, the last factor fastest; a factor with ends instead of values at ``levels`` of them, ends included (of a
    normal one at the middles of as many equally likely parts). latin_hypercube : ``samples`` cases. sobol : Saltelli's scheme by SALib,
    samples (k + 2) cases of k factors, samples (2 k + 2) with pairs.

    Raises
    ------
    InputRefused : for more cases than ``most``, or samples that the design cannot have.
    """
    k = len(plan.factors)
    if plan.design == "grid":
        count = math.prod(len(f.values) or levels for f in plan.factors)
    elif plan.design == "sobol":
        _require_sobol(plan)
        count = plan.samples * ((2 * k + 2) if plan.second_order else (k + 2))
    else:
        count = plan.samples
    if count > most:
        raise InputRefused(f"the study '{plan.name}' would have {count} cases, more than {most}; take fewer samples, levels or factors")
    if plan.design == "grid":
        rows = itertools.product(*(_levels(factor, levels) for factor in plan.factors))
        return tuple(Case(number=n, values=tuple(row)) for n, row in enumerate(rows))
    unit = _sobol(plan) if plan.design == "sobol" else _latin(plan)
    values = np.column_stack([_through(factor, unit[:, j]) for j, factor in enumerate(plan.factors)])
    return tuple(Case(number=n, values=tuple(row)) for n, row in enumerate(values.tolist()))


def _require_sobol(plan: StudyPlan) -> None:
    if plan.samples & (plan.samples - 1) or plan.samples < 2:
        below = 2 ** max(1, math.floor(math.log2(plan.samples)))
        raise InputRefused(f"samples is {plan.samples}; a Sobol' sequence is even only for powers of 2, for example {below} or {2 * below}")
    if len(plan.factors) < 2:
        raise InputRefused("sobol needs two factors or more; with one, take latin_hypercube or grid")


def _sobol(plan: StudyPlan) -> Array:
    from SALib.sample import sobol

    problem = {"num_vars": len(plan.factors), "names": [f.name for f in plan.factors], "bounds": [[0.0, 1.0]] * len(plan.factors)}
    return sobol.sample(problem, plan.samples, calc_second_order=plan.second_order, scramble=True, seed=plan.seed)


def _latin(plan: StudyPlan) -> Array:
    from scipy.stats.qmc import LatinHypercube

    return LatinHypercube(d=len(plan.factors), rng=plan.seed).random(plan.samples)


def _through(factor: Factor, unit: Array) -> Array:
    """Numbers of [0, 1] through the inverse of the factor's distribution; none leaves its ends by a rounding."""
    if factor.spread == "log":
        return np.clip(np.exp(np.log(factor.low) + unit * (np.log(factor.high) - np.log(factor.low))), factor.low, factor.high)
    if factor.spread == "normal":
        from scipy.special import ndtri

        edge = 1e-9  # 6 sigma: a point on the border of the cube would lie at infinity
        return factor.mean + factor.sigma * ndtri(np.clip(unit, edge, 1 - edge))
    if factor.spread == "values":
        places = np.minimum((unit * len(factor.values)).astype(int), len(factor.values) - 1)
        return np.array(factor.values)[places]
    return np.clip(factor.low + unit * (factor.high - factor.low), factor.low, factor.high)


def _levels(factor: Factor, levels: int) -> tuple[float, ...]:
    if factor.spread == "values":
        return factor.values
    places = (np.arange(levels) + 0.5) / levels if factor.spread == "normal" else np.linspace(0, 1, levels)
    return tuple(_through(factor, places).tolist())
