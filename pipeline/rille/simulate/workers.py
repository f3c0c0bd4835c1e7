"""Where the cases of a study run: processes of this machine, or workers of a Dask cluster. Both know the work before the first case."""

import asyncio
import os
import pickle
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from rille.model import InputRefused
from rille.model.process import end_with_parent
from rille.model.study import Case, CaseResult

Work = Callable[[Sequence[Case]], list[CaseResult]]

_work: list[Work] = []  # of this process


class LocalPool:
    """Processes that end with this one, and leave Ctrl-C to it."""

    deaths: tuple[type[BaseException], ...] = (BrokenProcessPool,)

    def __init__(self, work: Work, size: int) -> None:
        self._work, self.size = pickle.dumps(work), size
        self._executor = self._started()

    def _started(self) -> ProcessPoolExecutor:
        given = (self._work, os.getpid())
        return ProcessPoolExecutor(self.size, mp_context=get_context("spawn"), initializer=_begin, initargs=given)

    def submit(self, cases: Sequence[Case]) -> "Future[list[CaseResult]]":
        """Begin a batch."""
        try:
            return self._executor.submit(_do, cases)
        except BrokenProcessPool as broken:  # it died between two batches
            failed: Future[list[CaseResult]] = Future()
            failed.set_exception(broken)
            return failed

    def revive(self) -> None:
        """New processes for dead ones."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._executor = self._started()

    def close(self) -> None:
        """End the processes; what they have begun is lost."""
        workers = list((self._executor._processes or {}).values())
        self._executor.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()


def _begin(work: bytes, parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent(signal.SIGKILL, parent)
    _work[:] = [pickle.loads(work)]


def _do(cases: Sequence[Case]) -> list[CaseResult]:
    return _work[0](cases)


class ClusterPool:
    """Workers of a Dask cluster. The work is sent to each of them once; Dask itself runs a batch again whose worker died."""

    def __init__(self, client: Any, work: Work) -> None:
        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        self.deaths: tuple[type[BaseException], ...] = (KilledWorker, CancelledError, asyncio.CancelledError, CommClosedError)
        self._client, self._given = client, work
        self._executor = client.get_executor(pure=False)
        self.revive()

    @property
    def size(self) -> int:
        """Threads of all workers that are there now."""
        return max(1, sum(self._client.nthreads().values()))

    def submit(self, cases: Sequence[Case]) -> "Future[list[CaseResult]]":
        """Begin a batch."""
        return self._executor.submit(_apply, self._work, tuple(cases))

    def revive(self) -> None:
        """Send the work again: it may be lost with the workers that held it.

        Raises
        ------
        InputRefused : if there are no workers any more.
        """
        try:
            there = self._client.nthreads()
        except (OSError, RuntimeError, TimeoutError) as error:
            raise InputRefused(f"the Dask scheduler is gone ({error}); what is done is kept, and the same command goes on") from None
        if not there:
            raise InputRefused("the cluster has no workers left; start some, and the same command goes on")
        self._work = self._client.scatter(self._given, broadcast=True, hash=False)


def _apply(work: Work, cases: Sequence[Case]) -> list[CaseResult]:
    return work(cases)


@contextmanager
def opened_pool(work: Work, workers: int, scheduler: str | None) -> Iterator[LocalPool | ClusterPool]:
    """Processes of this machine, or the workers of the cluster at ``scheduler``, for as long as they are needed.

    Raises
    ------
    InputRefused : if there is no cluster.
    """
    if scheduler is None:
        pool = LocalPool(work, workers)
        try:
            yield pool
        finally:
            pool.close()
        return
    from rille.simulate.cluster import connected

    with connected(scheduler) as client:
        yield ClusterPool(client, work)
