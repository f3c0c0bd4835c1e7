"""The command ``rille``: the only place that wires the packages together."""

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is there: its threads only spin beside the solver's

try:
    from rille.cli.main import main
except KeyboardInterrupt:  # Ctrl-C while Python reads its modules
    print("rille: interrupted before anything was begun", file=sys.stderr)
    raise SystemExit(130) from None

__all__ = ["main"]
