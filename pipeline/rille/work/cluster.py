"""A Dask cluster: the only place that looks for one."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rille.model import InputRefused

PATIENCE = "10 s"  # for the scheduler to answer


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A client of the Dask scheduler at an address like ``tcp://host:8786``.

    Raises
    ------
    InputRefused : if Dask is not installed, or nobody answers, or there are no workers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputRefused("a cluster needs Dask, which is not installed here; `pip install 'rille[cluster]'`") from None
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise InputRefused(
            f"no Dask scheduler answers at '{address}' ({error}); start one with `dask scheduler` and name its address"
        ) from None
    with client:
        if not client.nthreads():
            raise InputRefused(f"the Dask scheduler at '{address}' has no workers; start some with `dask worker {address}`")
        yield client
