"""Where a diagnosis replays: in this process, or on the workers of a Dask cluster."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def simulators(database: Path, scheduler: str | None) -> Iterator[Callable[[str], Any]]:
    """Of a scenario's name a fresh simulator of the database's model.

    scheduler : address of a Dask scheduler; None: all cores of this machine.

    Raises
    ------
    InputRefused : if nobody answers at that address, or Dask is not installed.
    """
    from rille import simulate

    if scheduler is None:
        yield lambda scenario: simulate.Replayer(database, scenario or None)
        return
    from rille.simulate.cluster import ClusterReplayer
    from rille.work import connected

    with connected(scheduler) as client:
        yield lambda scenario: ClusterReplayer(client, database, scenario or None)
