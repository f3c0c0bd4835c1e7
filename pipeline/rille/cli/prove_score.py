"""Scores of a ledger whose truths are opened: a program of its own, which takes truths and answers and nothing else.

python -m rille.cli.prove_score LEDGER
"""

import json
import sys
from pathlib import Path


def score_ledger(path: Path) -> None:
    """Score every answer against its truth, into the ledger; nothing if that is done.

    Raises
    ------
    InputRefused : if the file is no ledger, or its truths are not opened.
    """
    from rille import store
    from rille.model import InputRefused
    from rille.model.ledger import Score
    from rille.proof.scoring import score_answer
    from rille.proof.seal import canonical_json

    ledger = store.read_ledger(path)
    if ledger.scores:
        return
    if not ledger.truths:
        raise InputRefused(f"the truths of '{path}' are not opened; `rille prove run` opens them after the last answer")
    answers = {answer.trial: answer for answer in ledger.answers}
    scores = [Score(trial=t.trial, text=canonical_json(score_answer(json.loads(t.text), answers[t.trial]))) for t in ledger.truths]
    store.write_scores(path, scores)


if __name__ == "__main__":
    score_ledger(Path(sys.argv[1]))
