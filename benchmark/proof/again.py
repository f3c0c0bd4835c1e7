"""Which answers of an opened ledger the present code gives differently, and whether they got better or worse.

Usage: python benchmark/proof/again.py LEDGER [--trials 4,209] [--sorts one,two] [--from 2] [--machines pendulum,arm]
       [--workers 2] [-o FILE]

Trials are made again from their opened truths and answered in rooms, without the baselines. FILE (JSON lines; default
out/proof-again.jsonl) keeps what was answered: the same command goes on where it was stopped; remove FILE after a change of the code. It
proves nothing: what a change was made for is no test of it. It shows what a change has broken before a new beacon is drawn.
"""

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from opened import Line, opened, run

from rille.cli.prove_answering import answer_files
from rille.cli.prove_run import make_trial
from rille.model.process import SAME_ROUNDING
from rille.proof.scoring import score, score_answer
from rille.proof.strength import Unreachable
from rille.proof.trials import Trial
from rille.work import carry_out, opened_pool


def answered_again(truths: Sequence[Line]) -> list[Line]:
    """Scores of trials under the present code; work for a pool."""
    return [_score(truth) for truth in truths]


def _score(truth: Line) -> Line:
    try:
        _, files, again = make_trial(Trial.of(truth), truth)
    except Unreachable:  # another state of rille made it
        return score(truth, None, "not made").as_json()
    given = answer_files(truth["number"], files, baselines=False)
    said = json.loads(given.text)["diagnosis"] if given.status == "done" else None
    return score(again, said, given.status, given.seconds).as_json()


def grade(line: Line) -> tuple[bool, ...]:
    """How good an answer is, the best first: no confident wrong name, no wrong one, truth in the group, both named, truth first."""
    return (not line["confident_wrong"], not line["wrong"], line["grouped"], line["pieces"] == 1.0, line["top"])


def change(before: Line, now: Line) -> str:
    """What became of an answer: "better", "WORSE", "same", or as good in "other words"."""
    if grade(now) != grade(before):
        return "better" if grade(now) > grade(before) else "WORSE"
    return "same" if (before["verdict"], before["answer"]) == (now["verdict"], now["answer"]) else "other words"


def compared(before: Line, now: Line) -> str:
    """One line: what became of an answer, what is concealed, and what was and is said."""
    said = " -> ".join(dict.fromkeys(_words(one) for one in (before, now)))
    asked = f"{now['trial']:3} {now['machine']:9} {now['sort']:9} x{now['strength']:<3g} {now['truth']}"
    return f"{change(before, now):11} {asked}: {said}, {now['seconds'] or 0:.0f} s"


def _words(line: Line) -> str:
    stated = "" if line["probability"] is None else f" {100 * line['probability']:.0f} %"
    first = " (right)" if line["top"] else " (in group)" if line["grouped"] else " (WRONG)" if line["wrong"] else ""
    return f"{line['verdict'] or line['status']} {line['answer']}{stated}{first}"


def _asked(path: Path, given: argparse.Namespace) -> tuple[list[Line], dict[int, Line]]:
    """Truths of the trials that are asked for, and the scores of their answers in the ledger."""
    truths, answers = opened(path)

    def wanted(truth: Line) -> bool:
        chosen = not given.trials or str(truth["number"]) in given.trials.split(",")
        of_sort = not given.sorts or truth["sort"] in given.sorts.split(",")
        of_machine = not given.machines or truth["machine"] in given.machines.split(",")
        return chosen and of_sort and of_machine and truth["strength"] >= given.least

    asked = [truth for truth in truths.values() if wanted(truth)]
    return asked, {truth["number"]: score_answer(truth, answers[truth["number"]])["diagnosis"] for truth in asked}


def main() -> None:
    """Answer, compare, count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ledger", type=Path)
    parser.add_argument("--trials", default="", help="numbers, with commas; default all")
    parser.add_argument("--sorts", default="", help="one, two, outside, parameter, sensor, nothing")
    parser.add_argument("--machines", default="", help="pendulum, arm, free_body, rover, bench")
    parser.add_argument("--from", dest="least", type=float, default=0.0, help="least strength [noise]")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/proof-again.jsonl"))
    given = parser.parse_args()
    asked, before = _asked(given.ledger, given)
    given.output.parent.mkdir(parents=True, exist_ok=True)
    lines = [json.loads(row) for row in given.output.read_text().splitlines()] if given.output.exists() else []
    now: dict[int, Line] = {line["trial"]: line for line in lines}
    waiting = [truth for truth in asked if truth["number"] not in now]

    def keep(scores: Sequence[Line]) -> None:
        with given.output.open("a", encoding="utf-8") as file:
            for line in scores:
                now[line["trial"]] = line
                file.write(json.dumps(line) + "\n")
                print(compared(before[line["trial"]], line), flush=True)

    def lost(truth: Line, why: str) -> Line:
        return score(truth, None, "crashed").as_json() | {"answer": why}

    for number in sorted(before.keys() & now.keys()):
        print(compared(before[number], now[number]))
    if waiting:
        with opened_pool(answered_again, min(given.workers, len(waiting)), None, SAME_ROUNDING) as pool:
            carry_out(pool, waiting, len(waiting), keep, lost=lost, ahead=1)
    changes = Counter(change(before[number], now[number]) for number in before.keys() & now.keys())
    print(f"{changes.total()} of {len(asked)} trials: " + ", ".join(f"{count} {what}" for what, count in changes.most_common()))


if __name__ == "__main__":
    run(main)
