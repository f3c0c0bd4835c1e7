"""How uncertain a model's efforts are, in which regime: learned from recordings in which nothing pushed, and growing outside of them.

The residual effort of a coordinate is taken as a Gaussian process. Its covariance is a sum of what models are wrong by:

- a smooth and a rough function of the state (positions, speeds, effort of the drive, side of the friction). It is common to the recordings
  that are judged together: what comes back whenever the machine comes back to a state is an error of the model, not a push. Where no
  recording has been the function is free, so that nothing can be said there that is slower than the state changes;
- wrong numbers: offset, friction, gain, lag and delay of the drive, friction and saturation that grow with load, one number each;
- an offset of each recording, and friction that wanders where the joint creeps;
- vibration and noise, as large as the roughness of the residual itself around the instant.

Sizes and lengths are those of greatest marginal likelihood, found on calibration recordings (Rasmussen & Williams 2006, ch. 5.4.1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cholesky
from scipy.optimize import minimize

from rille.diagnosis.pushes.residual_effort import ResidualEffort

Array = NDArray[np.float64]
USUAL = 95.0  # percentile of speeds and efforts that is called usual
SLOW = 0.03  # of the usual speed, within which friction changes its side
STILL = 0.003  # of the usual speed: at rest
CREEP = 0.06  # of the usual speed: hardly moving
AROUND = 0.1  # [s] over which moving and resting are judged
MOST_POINTS = 700  # of one group of recordings that sizes are learned from
MOST_STEPS = 40
NOISE_FLOOR = 1e-3  # of the usual residual: rounding

# Of each number: lower and upper bound and first guess; sizes in units of the usual residual, lengths in those of usual states.
NUMBERS = {
    "function": (0.1, 8.0, 1.5),
    "position_length": (0.5, 4.0, 1.0),
    "speed_length": (0.5, 4.0, 1.0),
    "effort_length": (0.5, 4.0, 1.0),
    "side_length": (0.3, 4.0, 1.0),
    "detail": (0.03, 4.0, 0.5),
    "detail_length": (0.15, 0.5, 0.25),
    "wrong_number": (0.01, 3.0, 0.3),
    "offset": (0.03, 2.0, 0.3),
    "creep": (0.03, 5.0, 0.5),
    "creep_time": (0.05, 1.0, 0.2),
    "noise": (0.01, 1.0, 0.1),
    "roughness": (0.7, 3.0, 1.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Usual:
    """What is usual in the calibration recordings. place (C,): spread of the positions. speed, applied (C,): half the percentile ``USUAL``
    of their size. residual (C,): robust size of the residual effort. wrong (C, k): root mean square of what one wrong number each does.
    """

    place: Array
    speed: Array
    applied: Array
    residual: Array
    wrong: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class EffortUncertainty:
    """numbers (C, len(NUMBERS)): logarithms of the covariance's numbers of each coordinate. usual : that they are in units of."""

    coordinates: tuple[str, ...]
    usual: Usual
    numbers: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Instants of several recordings, of one coordinate. run (n,): which recording. places (n, d), speeds (n, C), effort (n, 1),
    side (n, 1), wrong (n, k): scaled. unit : usual residual.
    """

    run: NDArray[np.int64]
    time: Array
    value: Array
    rough: Array
    creeping: Array
    places: Array
    speeds: Array
    effort: Array
    side: Array
    wrong: Array
    resolution: float
    unit: float

    def some(self, rows: NDArray[np.int64]) -> "Points":
        """Only these rows."""
        return Points(
            run=self.run[rows],
            time=self.time[rows],
            value=self.value[rows],
            rough=self.rough[rows],
            creeping=self.creeping[rows],
            places=self.places[rows],
            speeds=self.speeds[rows],
            effort=self.effort[rows],
            side=self.side[rows],
            wrong=self.wrong[rows],
            resolution=self.resolution,
            unit=self.unit,
        )


def usual_of(efforts: Sequence[ResidualEffort]) -> Usual:
    """What is usual in these recordings."""

    def size(rows: Array) -> Array:
        found = np.percentile(np.abs(rows), USUAL, axis=0) / 2
        return np.where(found > 0, found, 1.0)

    speed, applied = size(np.concatenate([e.speed for e in efforts])), size(np.concatenate([e.applied for e in efforts]))
    value, position = np.concatenate([e.value for e in efforts]), np.concatenate([e.position for e in efforts])
    place = position.std(axis=0)
    residual = 1.4826 * np.median(np.abs(value), axis=0)
    residual = np.where(residual > 0, residual, np.maximum(value.std(axis=0), 1e-12))
    wrong = []
    for c in range(len(speed)):
        rows = np.concatenate([_wrong_numbers(e, c, float(speed[c])) for e in efforts])
        rms = np.sqrt(np.mean(rows**2, axis=0))
        wrong.append(np.where(rms > 0, rms, 1.0))
    return Usual(place=np.where(place > 0, place, 1.0), speed=speed, applied=applied, residual=residual, wrong=np.array(wrong))


def points_of(efforts: Sequence[ResidualEffort], coordinate: int, usual: Usual) -> Points:
    """All instants of recordings that are judged together, of one coordinate."""
    rows, c = [], coordinate
    for number, e in enumerate(efforts):
        angles = [f(e.position[:, k]) for k in range(len(e.coordinates)) if e.turns[k] for f in (np.sin, np.cos)]
        along = [e.position[:, k] / usual.place[k] for k in range(len(e.coordinates)) if not e.turns[k]]
        moving = _moving(e, c)
        creeping = np.exp(-((moving / (2 * CREEP * usual.speed[c])) ** 2)) * (1 - np.exp(-((moving / (2 * STILL * usual.speed[c])) ** 2)))
        rows.append(
            (
                np.full(len(e.time), number),
                e.time,
                e.value[:, c],
                e.rough[:, c],
                creeping,
                np.stack([*angles, *along], axis=1),
                e.speed / usual.speed,
                e.applied[:, [c]] / usual.applied[c],
                np.tanh(e.speed[:, [c]] / (2 * SLOW * usual.speed[c])),
                _wrong_numbers(e, c, float(usual.speed[c])) / usual.wrong[c],
            )
        )
    run, time, value, rough, creeping, places, speeds, effort, side, wrong = (np.concatenate(column) for column in zip(*rows, strict=True))
    return Points(
        run=run.astype(np.int64),
        time=time,
        value=value,
        rough=rough,
        creeping=creeping,
        places=places,
        speeds=speeds,
        effort=effort,
        side=side,
        wrong=wrong,
        resolution=max(e.resolution for e in efforts),
        unit=float(usual.residual[c]),
    )


def _moving(e: ResidualEffort, c: int) -> Array:
    """(n,) root mean square of the speed around each instant."""
    around = np.exp(-0.5 * ((e.time[:, None] - e.time[None]) / AROUND) ** 2)
    return np.sqrt(around @ e.speed[:, c] ** 2 / around.sum(axis=1))


def _wrong_numbers(e: ResidualEffort, c: int, usual_speed: float) -> Array:
    """(n, k) what one wrong number each does to the residual effort, up to a factor."""
    v, u = e.speed[:, c], e.applied[:, c]
    side = np.tanh(v / (2 * SLOW * usual_speed))
    friction = [np.ones_like(v), side, v, v * np.abs(v)]
    drive = [u, u * np.abs(u), np.abs(u) * side, np.abs(u) * v, u * np.abs(v), e.applied_rate[:, c], e.applied_bend[:, c]]
    return np.stack(friction + drive, axis=1)


def covariance(p: Points, numbers: Array, derivatives: bool = False) -> tuple[Array, list[Array]]:
    """(n, n) covariance of the residual efforts, and its derivatives by the logarithms ``numbers``, in the order of ``NUMBERS``."""
    n = dict(zip(NUMBERS, np.exp(numbers), strict=True))
    parts = {
        "position_length": _distances(p.places) / n["position_length"] ** 2,
        "speed_length": _distances(p.speeds) / n["speed_length"] ** 2,
        "effort_length": _distances(p.effort) / n["effort_length"] ** 2,
        "side_length": _distances(p.side) / n["side_length"] ** 2,
    }
    distance = sum(parts.values())
    ratio = n["detail_length"]
    function = (p.unit * n["function"]) ** 2 * np.exp(-0.5 * distance)
    detail = (p.unit * n["detail"]) ** 2 * np.exp(-0.5 * distance / ratio**2)
    wrong = (p.unit * n["wrong_number"]) ** 2 * (p.wrong @ p.wrong.T)
    same = p.run[:, None] == p.run[None]
    apart = np.abs(p.time[:, None] - p.time[None])
    offset = (p.unit * n["offset"]) ** 2 * same
    creep = (p.unit * n["creep"]) ** 2 * np.outer(p.creeping, p.creeping) * np.exp(-apart / n["creep_time"]) * same
    rough = n["roughness"] ** 2 * np.outer(p.rough, p.rough) * np.exp(-0.25 * (apart / p.resolution) ** 2) * same
    noise = (p.unit * n["noise"]) ** 2 * np.exp(-0.25 * (apart / p.resolution) ** 2) * same
    total = function + detail + wrong + offset + creep + rough + noise
    total[np.diag_indices(len(total))] += (NOISE_FLOOR * p.unit) ** 2 + 1e-6 * np.diag(total)
    if not derivatives:
        return total, []
    along = function + detail / ratio**2
    by = {
        "function": 2 * function,
        **{name: along * part for name, part in parts.items()},
        "detail": 2 * detail,
        "detail_length": detail * distance / ratio**2,
        "wrong_number": 2 * wrong,
        "offset": 2 * offset,
        "creep": 2 * creep,
        "creep_time": creep * apart / n["creep_time"],
        "noise": 2 * noise,
        "roughness": 2 * rough,
    }
    return total, [by[name] for name in NUMBERS]


def _distances(rows: Array) -> Array:
    square = (rows**2).sum(axis=1)
    return np.maximum(0.0, square[:, None] + square[None] - 2 * rows @ rows.T)


def calibrate(
    groups: Sequence[Sequence[ResidualEffort]], *, on_progress: Callable[[int, int, str], None] | None = None
) -> EffortUncertainty:
    """The uncertainty of a model's efforts from recordings in which nothing pushed.

    Parameters
    ----------
    groups : recordings that were made together (one session of the machine) each; what the recordings of one have in common, but not all
        groups, is what a new group will differ by.
    """
    everything = [e for group in groups for e in group]
    usual = usual_of(everything)
    names = everything[0].coordinates
    found = []
    for c in range(len(names)):
        if on_progress:
            on_progress(c, len(names), "calibration of efforts")
        found.append(_likeliest([_few(points_of(group, c, usual), number) for number, group in enumerate(groups)]))
    return EffortUncertainty(coordinates=names, usual=usual, numbers=np.array(found))


def _few(p: Points, shift: int) -> Points:
    """Evenly spread instants."""
    every = max(1, round(len(p.time) / MOST_POINTS))
    return p.some(np.arange(shift % every, len(p.time), every))


def _likeliest(points: Sequence[Points]) -> Array:
    bounds = [(float(np.log(low)), float(np.log(high))) for low, high, _ in NUMBERS.values()]
    start = np.log([guess for _, _, guess in NUMBERS.values()])

    def cost(numbers: Array) -> tuple[float, Array]:
        value, slope = 0.5 * float(np.sum(((numbers - start) / 1.5) ** 2)), (numbers - start) / 1.5**2
        for p in points:
            total, by = covariance(p, numbers, derivatives=True)
            factor = cho_factor(total, lower=True, check_finite=False)
            weights = cho_solve(factor, p.value, check_finite=False)
            inverse = cho_solve(factor, np.eye(len(total)), check_finite=False)
            value += 0.5 * float(p.value @ weights) + float(np.log(np.diag(factor[0])).sum())
            lean = inverse - np.outer(weights, weights)
            slope = slope + np.array([0.5 * float(np.einsum("ij,ij->", lean, d)) for d in by])
        return value, slope

    return np.asarray(minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": MOST_STEPS}).x)


def root_covariance(p: Points, numbers: Array) -> Array:
    """Lower Cholesky factor of the covariance."""
    return np.asarray(cholesky(covariance(p, numbers)[0], lower=True, check_finite=False))
