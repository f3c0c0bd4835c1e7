"""Soil calibration: chosen parameters of a soil from bench points, with priors, intervals and an honest no.

Bounded nonlinear least squares of whitened residuals r_i = (model - measured)_i / sigma and of priors (x_k - x0_k) / spread_k, in
the logarithm of parameters that are scales. With the Jacobian J of the data in units of the prior, the posterior covariance is
(J'J + 1)^-1: a parameter whose posterior interval is nearly its prior's was not observed, and is refused.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.model import BenchPoints, InputRefused, Soil, nearest_names
from rille.model.bench import RESPONSES

Array = NDArray[np.float64]
Simulator = Callable[[Soil, BenchPoints], BenchPoints]
"""(soil, conditions) -> the same conditions with calculated responses, NaN where the soil does not carry the load."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """How a soil parameter is fitted. spread : 1 sigma of the prior, of the logarithm where ``log``. test : what would observe it."""

    log: bool
    lower: float
    upper: float
    spread: float
    test: str


# Spreads: published values of one soil differ by a factor of two (soil_parameters.csv); angles and ratios by what their sources list.
PARAMETERS = {
    "sinkage_exponent": Parameter(log=False, lower=0.4, upper=2.5, spread=0.3, test="sinkage at three or more loads, or a plate test"),
    "cohesive_modulus": Parameter(log=False, lower=-1e6, upper=1e6, spread=2e3, test="plate or wheel tests of two or more widths"),
    "frictional_modulus": Parameter(log=True, lower=1e3, upper=1e8, spread=0.8, test="sinkage, or a plate test"),
    "cohesion": Parameter(log=True, lower=1.0, upper=1e5, spread=1.0, test="drawbar pull or torque at two loads, or a shear test"),
    "friction_angle": Parameter(
        log=False, lower=0.26, upper=1.05, spread=0.12, test="drawbar pull or torque at high slip, or a shear test"
    ),
    "shear_modulus": Parameter(log=True, lower=1e-3, upper=0.2, spread=0.6, test="drawbar pull or torque at slips below 0.3"),
    "lateral_shear_modulus": Parameter(log=True, lower=1e-3, upper=0.2, spread=0.6, test="side force at slip angles below 15 deg"),
    "peak_angle_offset": Parameter(
        log=False, lower=0.0, upper=1.0, spread=0.15, test="stress sensors in the wheel, or torque and drawbar pull together"
    ),
    "peak_angle_slip": Parameter(
        log=False, lower=-0.5, upper=0.6, spread=0.15, test="stress sensors in the wheel, or sinkage over slips 0 to 0.8"
    ),
    "exit_sinkage_ratio": Parameter(
        log=False, lower=0.0, upper=1.2, spread=0.3, test="depth of the rut behind the wheel beside the sinkage"
    ),
}
OBSERVED = 0.7  # a posterior interval above this share of the prior's is the prior's


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """1 sigma of one response, and where it comes from: ``repeats``, ``stated`` or ``assumed``."""

    sigma: float
    origin: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """One parameter. prior, value in SI; interval: 1 sigma, in SI at the value. shrink : posterior per prior interval."""

    name: str
    prior: float
    value: float
    interval: float
    shrink: float
    on_bound: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FitResult:
    """soil : with the fitted values. before, after : RMS of each response on training and held-out points, {response: (train, held out)}.

    correlation : (p, p) of the fitted parameters. condition : of the data's Jacobian in units of the prior.
    """

    soil: Soil
    fitted: tuple[Fitted, ...]
    held_at_prior: tuple[str, ...]
    correlation: Array
    condition: float
    before: dict[str, tuple[float, float]]
    after: dict[str, tuple[float, float]]
    repeatability: dict[str, Repeatability]
    n_train: int
    n_held_out: int
    not_carried: int


def repeatability(points: BenchPoints, response: str, stated: float | None = None) -> Repeatability:
    """Noise of a response: stated, else pooled over repeats (same load within 20 %, slip within 0.02, slip angle), else 3 % of its range.

    Repeats differ a little in load; a straight line through load is taken out of each pool where it can be.
    """
    if stated is not None:
        return Repeatability(sigma=stated, origin="stated")
    values = getattr(points, response)
    groups: dict[tuple, list[float]] = {}
    for k in range(len(points)):
        if np.isfinite(values[k]):
            key = (round(points.slip_ratio[k] / 0.02), round(points.slip_angle[k] / 0.01), round(np.log(points.load[k]) / 0.3))
            groups.setdefault(key, []).append(float(values[k]))
    repeated = [np.array(g) for g in groups.values() if len(g) > 1]
    dof = sum(len(g) - 1 for g in repeated)
    if dof >= 5:
        return Repeatability(sigma=float(np.sqrt(sum(((g - g.mean()) ** 2).sum() for g in repeated) / dof)), origin="repeats")
    known = values[np.isfinite(values)]
    return Repeatability(sigma=max(0.03 * float(np.ptp(known)), 1e-9), origin="assumed")


def _unobserved(chosen: Sequence[str], unseen: Sequence[str], jacobian: Array, covariance: Array) -> str:
    """The sentence for parameters that the data do not observe, alone or beside others, and the test that would."""
    shrink = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(shrink, shrink)
    alone = 1 / np.sqrt(1 + (jacobian**2).sum(axis=0))
    reasons = []
    for name in unseen:
        k = chosen.index(name)
        if alone[k] > OBSERVED:
            reasons.append(
                f"{name} (interval {shrink[k]:.0%} of the prior's): it hardly moves what was measured; "
                f"{PARAMETERS[name].test} would show it"
            )
        else:
            others = [(abs(correlation[k, j]), chosen[j]) for j in range(len(chosen)) if j != k]
            other = max(others)[1]
            reasons.append(
                f"{name} (interval {shrink[k]:.0%} of the prior's): it cannot be told from {other} here; "
                f"{PARAMETERS[name].test} would separate them"
            )
    return f"the data do not observe {'; '.join(reasons)}; fit fewer parameters, or hold these at the prior with --keep-unobserved"


def fit_soil(
    simulator: Simulator,
    train: BenchPoints,
    held_out: BenchPoints,
    prior: Soil,
    names: Sequence[str],
    *,
    noise: dict[str, float] | None = None,
    responses: Sequence[str] | None = None,
    keep_unobserved: bool = False,
    progress: Callable[[str, float], None] | None = None,
) -> FitResult:
    """Fit soil parameters to training points and score them on held-out points.

    Parameters
    ----------
    simulator : the bench. train, held_out : measured points. prior : soil to start from. names : parameters to fit.
    noise : 1 sigma by response, where it is known better than from repeats. responses : to fit; None: all that were measured.
    keep_unobserved : hold parameters that the data cannot observe at the prior instead of refusing.

    Raises
    ------
    InputRefused : for an unknown parameter, too few points, or parameters that the data do not observe (with the test that would).
    """
    from scipy.optimize import least_squares

    for name in names:
        if name not in PARAMETERS:
            raise InputRefused(f"'{name}' is no soil parameter that can be fitted; {nearest_names(name, PARAMETERS)}")
    if len(set(names)) != len(names) or not names:
        raise InputRefused("name each soil parameter to fit once, at least one")
    straight = not np.any(np.abs(train.slip_angle) > 1e-6)  # then side force is noise, in law and in data
    used = tuple(responses or (r for r in train.known() if not (straight and r == "side_force")))
    for response in used:
        if response not in RESPONSES or not np.isfinite(getattr(train, response)).any():
            raise InputRefused(f"the training points have no {response}; they have {', '.join(train.known())}")
    everything = BenchPoints(**{f: np.concatenate([getattr(train, f), getattr(held_out, f)]) for f in BenchPoints.__dataclass_fields__})
    floors = {r: repeatability(everything, r, (noise or {}).get(r)) for r in used}

    def to_x(soil: Soil, name: str) -> float:
        p, value = PARAMETERS[name], float(getattr(soil, name))
        return float(np.log(max(value, p.lower))) if p.log else value

    def soil_at(x: Array, chosen: Sequence[str]) -> Soil:
        numbers = {n: float(np.exp(v)) if PARAMETERS[n].log else float(v) for n, v in zip(chosen, x, strict=True)}
        return replace(prior, name=f"{prior.name}_fitted", provenance="measured", **numbers)

    def residuals(points: BenchPoints, soil: Soil) -> Array:
        calculated = simulator(soil, points)
        parts = []
        for response in used:
            measured = getattr(points, response)
            known = np.isfinite(measured)
            difference = (getattr(calculated, response)[known] - measured[known]) / floors[response].sigma
            parts.append(np.where(np.isfinite(difference), difference, 1e3))  # a soil that does not carry the wheel is far off
        return np.concatenate(parts)

    def bounds(chosen: Sequence[str]) -> tuple[Array, Array]:
        low = np.array([np.log(PARAMETERS[n].lower) if PARAMETERS[n].log else PARAMETERS[n].lower for n in chosen])
        high = np.array([np.log(PARAMETERS[n].upper) if PARAMETERS[n].log else PARAMETERS[n].upper for n in chosen])
        return low, high

    say = progress or (lambda what, fraction: None)
    chosen = list(names)
    n_data = len(residuals(train, prior))
    if n_data < len(chosen):
        raise InputRefused(f"{n_data} measured numbers cannot fix {len(chosen)} parameters; fit fewer, or measure more")
    dropped: list[str] = []
    while True:
        spread = np.array([PARAMETERS[n].spread for n in chosen])
        x0 = np.array([to_x(prior, n) for n in chosen])
        low, high = bounds(chosen)
        x0 = np.clip(x0, low + 1e-9, high - 1e-9)
        calls = 0

        def whitened(u: Array, chosen: list[str] = chosen, x0: Array = x0, spread: Array = spread) -> Array:
            nonlocal calls
            calls += 1
            say(f"fitting {', '.join(chosen)}", min(0.95, calls / (30.0 * (len(chosen) + 1))))
            return np.concatenate([residuals(train, soil_at(x0 + spread * u, chosen)), u])

        solution = least_squares(
            whitened, np.zeros(len(chosen)), bounds=((low - x0) / spread, (high - x0) / spread), diff_step=1e-4, x_scale=1.0
        )
        jacobian = solution.jac[:n_data]
        # Errors of the model itself are no noise: intervals are scaled by the misfit where it exceeds the floor.
        misfit = max(1.0, float(np.sqrt(np.mean(solution.fun[:n_data] ** 2))))
        covariance = np.linalg.inv(jacobian.T @ jacobian / misfit**2 + np.eye(len(chosen)))
        shrink = np.sqrt(np.diag(covariance))
        unseen = [n for n, s in zip(chosen, shrink, strict=True) if s > OBSERVED]
        if not unseen:
            break
        if not keep_unobserved:
            raise InputRefused(_unobserved(chosen, unseen, jacobian / misfit, covariance))
        worst = max(unseen, key=lambda n: shrink[chosen.index(n)])
        dropped.append(worst)
        chosen.remove(worst)
        if not chosen:
            raise InputRefused(f"the data observe none of {', '.join(names)}; {PARAMETERS[worst].test} would observe {worst}")
    x = x0 + spread * solution.x
    fitted_soil = soil_at(x, chosen)
    sigma = shrink * spread
    fitted = tuple(
        Fitted(
            name=n,
            prior=float(getattr(prior, n)),
            value=float(getattr(fitted_soil, n)),
            interval=float(sigma[k] * (getattr(fitted_soil, n) if PARAMETERS[n].log else 1.0)),
            shrink=float(shrink[k]),
            on_bound=bool(x[k] - low[k] < 1e-3 * (high[k] - low[k]) or high[k] - x[k] < 1e-3 * (high[k] - low[k])),
        )
        for k, n in enumerate(chosen)
    )
    scores = {}
    not_carried = 0
    for label, soil in (("before", prior), ("after", fitted_soil)):
        rms: dict[str, tuple[float, float]] = {}
        answers = [simulator(soil, points) for points in (train, held_out)]
        not_carried = int(sum(np.isnan(a.sinkage).sum() for a in answers))
        for response in used:
            pair = []
            for points, calculated in zip((train, held_out), answers, strict=True):
                difference = getattr(calculated, response) - getattr(points, response)
                difference = difference[np.isfinite(difference)]
                pair.append(float(np.sqrt(np.mean(difference**2))) if len(difference) else float("nan"))
            rms[response] = (pair[0], pair[1])
        scores[label] = rms
    return FitResult(
        soil=fitted_soil,
        fitted=fitted,
        held_at_prior=tuple(dropped),
        correlation=covariance / np.outer(shrink, shrink),
        condition=float(np.linalg.cond(jacobian)),
        before=scores["before"],
        after=scores["after"],
        repeatability=floors,
        n_train=len(train),
        n_held_out=len(held_out),
        not_carried=not_carried,
    )
