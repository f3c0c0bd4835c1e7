"""Ledgers of sealed trials whose truths are opened, for the scripts beside this one."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rille import store
from rille.model import InputRefused
from rille.model.ledger import Answer

Line = dict[str, Any]


def opened(path: Path) -> tuple[dict[int, Line], dict[int, Answer]]:
    """Truths of all trials but those of real recordings, and the answers, by the number of the trial.

    Raises
    ------
    InputRefused : if the ledger is sealed still.
    """
    ledger = store.read_ledger(path)
    if not ledger.truths:
        raise InputRefused(f"'{path}' is not opened: its truths are not known yet")
    truths = [truth for one in ledger.truths if (truth := json.loads(one.text))["sort"] != "real"]
    return {truth["number"]: truth for truth in truths}, {answer.trial: answer for answer in ledger.answers}


def run(main: Callable[[], None]) -> None:
    """A script's main part; what it refuses is said in one sentence, with exit code 1."""
    try:
        main()
    except InputRefused as refused:
        sys.exit(str(refused))
