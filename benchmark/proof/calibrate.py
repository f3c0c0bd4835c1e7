"""Constants of the stated probabilities, from what sealed trials that are opened by now said and what was true.

Usage: python benchmark/proof/calibrate.py LEDGER [LEDGER ...] [--test LEDGER] [--write]

Prints the constants under which the truths of the ledgers are most probable, and for each ledger how far the probabilities that these
constants state are from how often the names are right. --test names a ledger that takes no part in the fit. --write puts the constants in
use (``weights.json``). A new beacon shows what they are worth.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from opened import Line, opened, run

from rille.diagnosis.inference.weights import Calibration, Trial, calibrated, probabilities, write_calibration
from rille.proof.scoring import NAMING, is_truth, score
from rille.proof.summary import calibration_error


@dataclass(frozen=True, slots=True, kw_only=True)
class Name:
    """A name that was given. trial : as the fit takes it. group : entries of the hypotheses in the best one's group. line : its score."""

    trial: Trial
    group: tuple[int, ...]
    line: Line


def names_of(path: Path) -> list[Name]:
    """All names that the answers of an opened ledger give."""
    truths, answers = opened(path)
    found = []
    for number, truth in truths.items():
        answer = answers.get(number)
        said = json.loads(answer.text)["diagnosis"] if answer is not None and answer.status == "done" else None
        if said is not None and said["verdict"] in NAMING and any(row["probability"] for row in said["ranked"]):
            found.append(_name(truth, said))
    return found


def _name(truth: Line, said: Line) -> Name:
    rows = [row for row in said["ranked"] if row["probability"]]
    line = score(truth, said).as_json()
    concealed = truth["pieces"] if truth["sort"] not in ("nothing", "outside") else []
    right = next((i for i, row in enumerate(rows) if concealed and is_truth(row, concealed)), -1 if line["wrong"] else 0)
    trial = Trial(
        behind=np.array([max(row["behind"] or 0.0, 0.0) for row in rows]),
        behind_error=np.array([row["behind_error"] or 0.0 for row in rows]),
        truth=right,
        leftover=max(said["leftover"] or 0.0, (said["proof"] or {}).get("left") or 0.0),
    )
    return Name(trial=trial, group=tuple(i for i, row in enumerate(rows) if row["group"] == rows[0]["group"]), line=line)


def report(path: Path, names: list[Name], constants: Calibration) -> str:
    """How far stated probabilities are from the truth, under these constants."""
    lines: list[Line] = []
    for name in names:
        trial = name.trial
        each, _ = probabilities(trial.behind, trial.behind_error, trial.leftover, constants)
        lines.append(name.line | {"probability": float(np.sum(each[list(name.group)]))})
    mean = np.mean([line["probability"] for line in lines])
    right = np.mean([line["grouped"] for line in lines])
    return f"{path}: {len(lines)} names, {100 * mean:.1f} % stated, {100 * right:.1f} % right, off by {calibration_error(lines):.4f}"


def main() -> None:
    """Fit, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ledgers", type=Path, nargs="+")
    parser.add_argument("--test", type=Path, action="append", default=[])
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    learned = {path: names_of(path) for path in given.ledgers}
    trials = [name.trial for names in learned.values() for name in names]
    constants = calibrated(trials, f"{len(trials)} names of {len(learned)} tables of sealed trials, opened (benchmark/proof)")
    print(constants)
    for path, names in (*learned.items(), *((path, names_of(path)) for path in given.test)):
        print(report(path, names, constants))
    if given.write:
        write_calibration(constants)


if __name__ == "__main__":
    run(main)
