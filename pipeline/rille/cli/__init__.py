"""The command ``rille``: the only place that wires the packages together."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is there: its threads only spin beside the solver's

from rille.cli.main import main

__all__ = ["main"]
