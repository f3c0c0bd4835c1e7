"""Runs that go as far as they are told."""

from pathlib import Path
from typing import Any


def steered_run(path: Path, scenario: str, *, step: float | None = None, endless: bool = True, saved: str | None = None) -> Any:
    """A run of a scenario of a database: ``rille._solver.Run``, whose results are written while it goes.

    Parameters
    ----------
    step : time step [s] instead of the scenario's. endless : goes on until it is finished; then its duration is what it took.
    saved : name of the state that it goes on from.

    Raises
    ------
    InputRefused : if the solver refuses the model, or there is no such scenario or state.
    """
    from rille import _solver  # pyright: ignore[reportAttributeAccessIssue]

    return _solver.Run(str(path), scenario=scenario, step=step, endless=endless, saved=saved)
