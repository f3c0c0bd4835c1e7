"""Where work is done: processes of this machine, or workers of a Dask cluster. Both know what to do before the first item."""

import asyncio
import os
import pickle
import signal
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from time import perf_counter
from typing import Any, Generic, TypeVar

from rille.model import InputRefused
from rille.model.process import ONE_THREAD, end_with_parent, environment
from rille.work.cluster import connected
from rille.work.scratch import Scratch

Item = TypeVar("Item")
Result = TypeVar("Result")
Work = Callable[[Sequence[Item]], list[Result]]

_work: list[Work] = []  # of this process


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch(Generic[Result]):
    """What came of a batch of items, and how long it took its worker [s]."""

    results: list[Result]
    seconds: float


class LocalPool(Generic[Item, Result]):
    """Processes that end with this one, and leave Ctrl-C to it. Their temporary files lie in one folder, which goes with them: they are
    ended from outside and tidy nothing (``scratch``).
    """

    deaths: tuple[type[BaseException], ...] = (BrokenProcessPool,)

    def __init__(self, work: Work[Item, Result], size: int) -> None:
        self._work, self.size = pickle.dumps(work), size
        self._folder = Scratch()
        self._executor = self._started()

    def _started(self) -> ProcessPoolExecutor:
        given = (self._work, os.getpid(), self._folder.name)
        return ProcessPoolExecutor(self.size, mp_context=get_context("spawn"), initializer=_begin, initargs=given)

    def submit(self, items: Sequence[Item]) -> "Future[Batch[Result]]":
        """Begin a batch."""
        try:
            return self._executor.submit(_do, items)
        except BrokenProcessPool as broken:  # it died between two batches
            failed: Future[Batch[Result]] = Future()
            failed.set_exception(broken)
            return failed

    def revive(self) -> None:
        """New processes for dead ones."""
        self._end()
        self._executor = self._started()

    def close(self) -> None:
        """End the processes; what they have begun is lost."""
        self._end()
        self._folder.remove()

    def _end(self) -> None:
        workers = list((self._executor._processes or {}).values())
        self._executor.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()


def _begin(work: bytes, parent: int, folder: str) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent(signal.SIGKILL, parent)
    tempfile.tempdir = folder
    _work[:] = [pickle.loads(work)]


def _do(items: Sequence[Any]) -> Batch[Any]:
    return _apply(_work[0], items)


def _apply(work: Work, items: Sequence[Any]) -> Batch[Any]:
    begin = perf_counter()
    return Batch(results=work(items), seconds=perf_counter() - begin)


class ClusterPool(Generic[Item, Result]):
    """Workers of a Dask cluster. The work is sent to each of them once; Dask itself runs a batch again whose worker died."""

    def __init__(self, client: Any, work: Work[Item, Result]) -> None:
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

    def submit(self, items: Sequence[Item]) -> "Future[Batch[Result]]":
        """Begin a batch."""
        return self._executor.submit(_apply, self._work, tuple(items))

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


@contextmanager
def opened_pool(
    work: Work[Item, Result], workers: int, scheduler: str | None, variables: Mapping[str, str] | None = None
) -> Iterator[LocalPool[Item, Result] | ClusterPool[Item, Result]]:
    """Processes of this machine, or the workers of the cluster at ``scheduler`` (tcp://HOST:PORT), for as long as they are needed.

    work : does a batch of items; it is pickled, as are items and results, so that no common disk is needed. variables : of the environment
    of processes of this machine; workers of a cluster keep theirs.

    Raises
    ------
    InputRefused : if there is no cluster.
    """
    if scheduler is None:
        threads = {name: os.environ.get(name, value) for name, value in ONE_THREAD.items()}  # who sets another number gets it
        with environment(threads | dict(variables or {})):
            pool = LocalPool(work, workers)
            try:
                yield pool
            finally:
                pool.close()
        return
    with connected(scheduler) as client:
        yield ClusterPool(client, work)
