"""Soil calibration: chosen parameters of a soil from bench points, with priors, intervals and an honest no.

Bounded nonlinear least squares of whitened residuals r_i = (model - measured)_i / sigma and of priors (x_k - x0_k) / spread_k, in
the logarithm of parameters that are scales. With the Jacobian J of the data in units of the prior, the posterior covariance is
(J'J + 1)^-1: a parameter whose posterior interval is nearly its prior's was not observed, and is refused.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.bench.repeatability import Repeatability, least_noise, repeatability
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
MOST_TURNS = 5  # of noise and fit


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """One parameter. prior, value in SI; interval: 1 sigma, in SI at the value.

    shrink : posterior per prior interval. offset : of the value from the prior, in prior intervals; beyond 3 the two hardly agree.
    """

    name: str
    prior: float
    value: float
    interval: float
    shrink: float
    offset: float
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


def _unobserved(chosen: Sequence[str], unseen: Sequence[str], solution: "_Solution", noise: dict[str, Repeatability]) -> str:
    """The sentence for parameters that the data do not observe, alone or beside others, and the test that would."""
    alone = 1 / np.sqrt(1 + (solution.jacobian**2).sum(axis=0))
    reasons = []
    for name in unseen:
        k = chosen.index(name)
        if alone[k] > OBSERVED:
            reasons.append(
                f"{name} (interval {solution.shrink[k]:.0%} of the prior's): it hardly moves what was measured; "
                f"{PARAMETERS[name].test} would show it"
            )
        else:
            others = [(abs(solution.correlation[k, j]), chosen[j]) for j in range(len(chosen)) if j != k]
            other = max(others)[1]
            reasons.append(
                f"{name} (interval {solution.shrink[k]:.0%} of the prior's): it cannot be told from {other} here; "
                f"{PARAMETERS[name].test} would separate them"
            )
    assumed = [f"{response} {floor.sigma:.3g}" for response, floor in noise.items() if floor.origin == "assumed"]
    refusal = f"the data do not observe {'; '.join(reasons)}; fit fewer parameters, or hold these at the prior with --keep-unobserved"
    if not assumed:
        return refusal
    return f"{refusal} (noise is assumed: {', '.join(assumed)} in SI; state what it is, for example --noise {assumed[0].replace(' ', '=')})"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Solution:
    """Parameters x of a fit; jacobian (n, p) of whitened data in units of the prior; covariance (p, p) in units of the prior."""

    x: Array
    offset: Array
    jacobian: Array
    covariance: Array
    residuals: Array

    @property
    def shrink(self) -> Array:
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        return self.covariance / np.outer(self.shrink, self.shrink)


@dataclass(slots=True, kw_only=True)
class _Fit:
    """Training points, the prior, and what is fitted to which noise. noise : by response, made smaller by ``settle``."""

    simulator: Simulator
    points: BenchPoints
    prior: Soil
    noise: dict[str, Repeatability]
    least: dict[str, float]
    say: Callable[[str, float], None]

    def soil_at(self, x: Array, chosen: Sequence[str]) -> Soil:
        numbers = {n: float(np.exp(v)) if PARAMETERS[n].log else float(v) for n, v in zip(chosen, x, strict=True)}
        return replace(self.prior, name=f"{self.prior.name}_fitted", provenance="measured", **numbers)

    def start(self, name: str) -> float:
        p, value = PARAMETERS[name], float(getattr(self.prior, name))
        return float(np.log(max(value, p.lower))) if p.log else value

    def residuals(self, soil: Soil) -> Array:
        """(calculated - measured) / noise of all that was measured, response by response."""
        calculated = self.simulator(soil, self.points)
        parts = []
        for response, floor in self.noise.items():
            measured = getattr(self.points, response)
            known = np.isfinite(measured)
            difference = (getattr(calculated, response)[known] - measured[known]) / floor.sigma
            parts.append(np.where(np.isfinite(difference), difference, 1e3))  # a soil that does not carry the wheel is far off
        return np.concatenate(parts)

    def counts(self) -> dict[str, int]:
        return {response: int(np.isfinite(getattr(self.points, response)).sum()) for response in self.noise}

    def solve(self, chosen: Sequence[str], offset: Array | None = None) -> _Solution:
        """Least squares from the prior, or from an offset (p,) in units of the prior."""
        from scipy.optimize import least_squares

        spread = np.array([PARAMETERS[n].spread for n in chosen])
        low, high = bounds_of(chosen)
        x0 = np.clip(np.array([self.start(n) for n in chosen]), low + 1e-9, high - 1e-9)
        calls = 0

        def whitened(u: Array) -> Array:
            nonlocal calls
            calls += 1
            self.say(f"fitting {', '.join(chosen)}", min(0.95, calls / (30.0 * (len(chosen) + 1))))
            return np.concatenate([self.residuals(self.soil_at(x0 + spread * u, chosen)), u])

        begin = np.zeros(len(chosen)) if offset is None else offset
        found = least_squares(whitened, begin, bounds=((low - x0) / spread, (high - x0) / spread), diff_step=1e-4, x_scale=1.0)
        n_data = len(found.fun) - len(chosen)
        # Errors of the model itself are no noise: intervals are scaled by the misfit where it exceeds the floor.
        misfit = max(1.0, float(np.sqrt(np.mean(found.fun[:n_data] ** 2))))
        jacobian = found.jac[:n_data] / misfit
        covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(len(chosen)))
        return _Solution(x=x0 + spread * found.x, offset=found.x, jacobian=jacobian, covariance=covariance, residuals=found.fun[:n_data])

    def settle(self, chosen: Sequence[str]) -> _Solution:
        """Solve; where noise was assumed and the fit leaves less, what it leaves is the noise, and it is solved again."""
        solution = self.solve(chosen)
        for _ in range(MOST_TURNS):
            if not self._learn(solution):
                break
            solution = self.solve(chosen, solution.offset)
        return solution

    def _learn(self, solution: _Solution) -> bool:
        """Take the noise of assumed responses from residuals: of enough points for it, and where it is clearly less. Whether any was."""
        counts, learnt, at = self.counts(), False, 0
        total, parameters = sum(counts.values()), len(solution.x)
        for response, count in counts.items():
            left, at = solution.residuals[at : at + count], at + count
            floor, freedom = self.noise[response], count * (1 - parameters / total)
            if floor.origin not in ("assumed", "residuals") or freedom < 5:
                continue
            sigma = max(floor.sigma * float(np.sqrt((left**2).sum() / freedom)), self.least[response])
            if sigma < 0.9 * floor.sigma:
                self.noise[response] = Repeatability(sigma=sigma, origin="residuals")
                learnt = True
        return learnt


def bounds_of(chosen: Sequence[str]) -> tuple[Array, Array]:
    """Lower and upper bounds (p,) of parameters as they are fitted: of the logarithm of scales."""
    ends = [(PARAMETERS[n].lower, PARAMETERS[n].upper) for n in chosen]
    low, high = (
        np.array([np.log(v) if PARAMETERS[n].log else v for n, v in zip(chosen, side, strict=True)]) for side in zip(*ends, strict=True)
    )
    return low, high


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
    noise : 1 sigma by response, where it is known; else from repeats, else 3 % is assumed and the fit's residuals are taken where they are
        less. responses : to fit; None: all that were measured.
    keep_unobserved : hold parameters that the data cannot observe at the prior instead of refusing.

    Raises
    ------
    InputRefused : for an unknown parameter, too few points, or parameters that the data do not observe (with the test that would).
    """
    _require_known(names, noise or {})
    straight = not np.any(np.abs(train.slip_angle) > 1e-6)  # then side force is noise, in law and in data
    used = tuple(responses or (r for r in train.known() if not (straight and r == "side_force")))
    for response in used:
        if response not in RESPONSES or not np.isfinite(getattr(train, response)).any():
            raise InputRefused(f"the training points have no {response}; they have {', '.join(train.known())}")
    everything = BenchPoints(**{f: np.concatenate([getattr(train, f), getattr(held_out, f)]) for f in BenchPoints.__dataclass_fields__})
    fit = _Fit(
        simulator=simulator,
        points=train,
        prior=prior,
        noise={r: repeatability(everything, r, (noise or {}).get(r)) for r in used},
        least={r: least_noise(everything, r) for r in used},
        say=progress or (lambda what, fraction: None),
    )
    chosen = list(names)
    n_data = sum(fit.counts().values())
    if n_data <= len(chosen):
        numbers = f"{n_data} measured number{'s' * (n_data != 1)} cannot fix {len(chosen)} parameter{'s' * (len(chosen) != 1)}"
        raise InputRefused(f"{numbers} and show whether they fit; fit fewer, or measure more")
    dropped: list[str] = []
    while True:
        solution = fit.settle(chosen)
        unseen = [n for n, s in zip(chosen, solution.shrink, strict=True) if s > OBSERVED]
        if not unseen:
            break
        if not keep_unobserved:
            raise InputRefused(_unobserved(chosen, unseen, solution, fit.noise))
        worst = max(unseen, key=lambda n: solution.shrink[chosen.index(n)])
        dropped.append(worst)
        chosen.remove(worst)
        if not chosen:
            raise InputRefused(f"the data observe none of {', '.join(names)}; {PARAMETERS[worst].test} would observe {worst}")
    soil = fit.soil_at(solution.x, chosen)
    before, after = (_scores(simulator, earth, train, held_out, used) for earth in (prior, soil))
    return FitResult(
        soil=soil,
        fitted=_fitted(chosen, solution, prior, soil),
        held_at_prior=tuple(dropped),
        correlation=solution.correlation,
        condition=float(np.linalg.cond(solution.jacobian)),
        before=before.rms,
        after=after.rms,
        repeatability=fit.noise,
        n_train=len(train),
        n_held_out=len(held_out),
        not_carried=after.not_carried,
    )


def _require_known(names: Sequence[str], noise: dict[str, float]) -> None:
    for name in names:
        if name not in PARAMETERS:
            raise InputRefused(f"'{name}' is no soil parameter that can be fitted; {nearest_names(name, PARAMETERS)}")
    if len(set(names)) != len(names) or not names:
        raise InputRefused("name each soil parameter to fit once, at least one")
    for response in noise:
        if response not in RESPONSES:
            raise InputRefused(f"noise is stated for '{response}', which no bench measures; {nearest_names(response, RESPONSES)}")


def _fitted(chosen: Sequence[str], solution: _Solution, prior: Soil, soil: Soil) -> tuple[Fitted, ...]:
    low, high = bounds_of(chosen)
    edge = 1e-3 * (high - low)
    return tuple(
        Fitted(
            name=n,
            prior=float(getattr(prior, n)),
            value=float(getattr(soil, n)),
            interval=float(solution.shrink[k] * PARAMETERS[n].spread * (getattr(soil, n) if PARAMETERS[n].log else 1.0)),
            shrink=float(solution.shrink[k]),
            offset=float(solution.offset[k]),
            on_bound=bool(solution.x[k] - low[k] < edge[k] or high[k] - solution.x[k] < edge[k]),
        )
        for k, n in enumerate(chosen)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scores:
    """rms : {response: (train, held out)}. not_carried : points without a value."""

    rms: dict[str, tuple[float, float]]
    not_carried: int


def _scores(simulator: Simulator, soil: Soil, train: BenchPoints, held_out: BenchPoints, used: Sequence[str]) -> _Scores:
    sets = [(points, simulator(soil, points)) for points in (train, held_out)]
    rms = {}
    for response in used:
        left = [getattr(calculated, response) - getattr(points, response) for points, calculated in sets]
        left = [d[np.isfinite(d)] for d in left]
        first, second = (float(np.sqrt(np.mean(d**2))) if len(d) else float("nan") for d in left)
        rms[response] = (first, second)
    return _Scores(rms=rms, not_carried=int(sum(np.isnan(calculated.sinkage).sum() for _, calculated in sets)))
