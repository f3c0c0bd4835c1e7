"""From scores to probabilities, by a few constants that were fitted to trials whose truth is known (``weights.json``)."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from rille.diagnosis.evidence.evidence import Array

FILE = Path(__file__).with_name("weights.json")
NOTHING_LEFT = 1e-3  # share of the excess below which nothing is left


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """temperature : by which differences in score are divided. none_offset, none_slope : log odds of "none of the catalogue" are
    offset + slope log10(share of the excess that is left). source : which trials they are of.
    """

    temperature: float
    none_offset: float
    none_slope: float
    source: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One trial whose truth is known. behind, behind_error (m,) [nats] : of the hypotheses, the best has 0. truth : which one is right, -1:
    none of them. leftover : share of the excess that the best leaves. weight : how much it counts.
    """

    behind: Array
    behind_error: Array
    truth: int
    leftover: float
    weight: float = 1.0


@cache
def calibration() -> Calibration:
    """The constants in use."""
    return Calibration(**json.loads(FILE.read_text(encoding="utf-8")))


def evidence_against(behind: Array, behind_error: Array) -> Array:
    """(m,) what speaks against each, in nats: half its squared standard errors behind the best, or its log-likelihood if less."""
    errors = np.divide(behind, behind_error, out=np.zeros_like(behind), where=behind_error > 0)
    return np.where(behind_error > 0, np.minimum(behind, 0.5 * errors**2), behind)


def none_of_these(leftover: float, constants: Calibration | None = None) -> float:
    """Probability that the catalogue has no name for it, if the best leaves that share of the excess."""
    constants = constants or calibration()
    return float(expit(constants.none_offset + constants.none_slope * np.log10(max(leftover, NOTHING_LEFT))))


def probabilities(behind: Array, behind_error: Array, leftover: float, constants: Calibration | None = None) -> tuple[Array, float]:
    """(m,) probabilities of the hypotheses, and of none of them."""
    constants = constants or calibration()
    none = none_of_these(leftover, constants)
    if not len(behind):
        return np.empty(0), 1.0
    scores = -evidence_against(np.maximum(behind, 0.0), behind_error) / constants.temperature
    return (1.0 - none) * np.exp(scores - np.logaddexp.reduce(scores)), none


def calibrated(trials: Sequence[Trial], source: str) -> Calibration:
    """Constants under which the truth of the trials was most probable (with a weak prior at the present ones)."""
    present = calibration()
    first = np.array([np.log(present.temperature), present.none_offset, present.none_slope])

    def made(x: Array) -> Calibration:
        return Calibration(temperature=float(np.exp(np.clip(x[0], -3, 6))), none_offset=float(x[1]), none_slope=float(x[2]), source=source)

    def cost(x: Array) -> float:
        total = 0.05 * float(np.sum((x - first) ** 2))
        for trial in trials:
            each, none = probabilities(trial.behind, trial.behind_error, trial.leftover, made(x))
            total -= trial.weight * float(np.log(max(none if trial.truth < 0 else each[trial.truth], 1e-9)))
        return total

    return made(minimize(cost, first, method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-4, "maxiter": 2000}).x)


def write_calibration(constants: Calibration, file: Path = FILE) -> None:
    """Store constants; in use from the next start of the program on."""
    file.write_text(json.dumps(asdict(constants), indent=2) + "\n", encoding="utf-8")
