"""Probabilities that mean what they say: constants from development trials, and how far stated and true frequencies are apart."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from trials import CONCEALED

from rille.diagnosis.inference.weights import Trial, calibrated, calibration, probabilities, write_calibration

OUTSIDE = 0.1  # share of all cases in which what is wrong is nothing that the catalogue has: trials in which it is concealed weigh that
EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 1.0001)


def calibrate(lines: Sequence[dict]) -> None:
    """Fit the constants on every second trial, report on the others, write them. Trials in which nothing is wrong have no ranking."""
    trials = _weighed([_trial(line["score"]) for line in lines if line["status"] == "done" and line["score"]["behind"] and _is_fair(line)])
    if len(trials) < 20:
        raise SystemExit(f"{len(trials)} development trials with a ranking are too few; run --development 200 first")
    halves = [trials[0::2], trials[1::2]]
    for fitted, tested in (halves, halves[::-1]):
        made = calibrated(fitted, "half")
        for word, constants in (("before", calibration()), ("after", made)):
            print(f"{word}: temperature {constants.temperature:.3g}, log-loss {log_loss(tested, constants):.3f} nats")
    made = calibrated(
        trials,
        f"{len(trials)} development trials of benchmark/diagnosis, seeds from 1000, those outside the catalogue weighed as one in ten",
    )
    for low, high, stated, true, n in reliability(trials, made):
        print(f"stated {low:.2f} to {high:.2f}: mean {stated:.2f}, true {true:.2f} of {n}")
    write_calibration(made)


def _is_fair(line: dict) -> bool:
    """Numbers of a bench's soil are always fitted along, so that they cannot be concealed."""
    machine, cause, *_, seed = line["trial"].split("/")
    return not (machine == "bench" and cause == "parameter" and int(seed) >= CONCEALED)


def _weighed(trials: Sequence[Trial]) -> list[Trial]:
    """Trials whose truth was not among the hypotheses weigh ``OUTSIDE`` of all together."""
    outside = sum(trial.truth < 0 for trial in trials)
    weight = OUTSIDE / (1 - OUTSIDE) * (len(trials) - outside) / max(outside, 1)
    return [replace(trial, weight=weight if trial.truth < 0 else 1.0) for trial in trials]


def _trial(score: dict) -> Trial:
    leftover = score["leftover"] if np.isfinite(score["leftover"]) else 0.05
    return Trial(
        behind=np.array(score["behind"]), behind_error=np.array(score["behind_error"]), truth=int(score["place"]), leftover=leftover
    )


def log_loss(trials: Sequence[Trial], constants: object) -> float:
    """Mean of -log p of the truth."""
    losses = [-np.log(max(_of_truth(trial, constants), 1e-9)) for trial in trials]
    return float(np.average(losses, weights=[trial.weight for trial in trials]))


def _of_truth(trial: Trial, constants: object) -> float:
    each, none = probabilities(trial.behind, trial.behind_error, trial.leftover, constants)  # type: ignore[arg-type]
    return none if trial.truth < 0 else float(each[trial.truth])


def reliability(trials: Sequence[Trial], constants: object) -> list[tuple[float, float, float, float, int]]:
    """Of bins of the probability of the best: bounds, mean stated, share that was right (both as trials weigh), number."""
    weights = np.array([trial.weight for trial in trials])
    stated, right = [], []
    for trial in trials:
        each, _ = probabilities(trial.behind, trial.behind_error, trial.leftover, constants)  # type: ignore[arg-type]
        stated.append(float(each.max()))
        right.append(int(np.argmax(each)) == trial.truth)
    p, ok = np.array(stated), np.array(right)
    bins = np.digitize(p, EDGES) - 1
    return [
        (
            EDGES[k],
            min(EDGES[k + 1], 1.0),
            float(np.average(p[bins == k], weights=weights[bins == k])),
            float(np.average(ok[bins == k], weights=weights[bins == k])),
            int((bins == k).sum()),
        )
        for k in range(len(EDGES) - 1)
        if (bins == k).any()
    ]
