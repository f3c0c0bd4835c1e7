"""The command ``rille``: the only place that wires the packages together."""

from rille.cli.main import main

__all__ = ["main"]
