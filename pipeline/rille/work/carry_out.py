"""Items on workers: in batches that grow until they are worth their transport, kept as they come, and no worker's death loses one."""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from typing import Protocol, TypeVar

from rille.work.pools import Batch

WORTH = 0.5  # [s] of work that a batch holds, once it is known how long an item takes
AHEAD = 2  # batches for each worker, one at work and one behind it: no worker waits for this process
SHARE = 3  # a batch holds at most this part of what is left for each worker: all end together

Item = TypeVar("Item")
Given = TypeVar("Given", contravariant=True)
Result = TypeVar("Result")


class Pool(Protocol[Given, Result]):
    """Workers that each know what to do with items."""

    deaths: tuple[type[BaseException], ...]
    """What a future raises if its worker died."""

    @property
    def size(self) -> int:
        """Workers."""
        ...

    def submit(self, items: Sequence[Given]) -> "Future[Batch[Result]]":
        """Begin a batch."""
        ...

    def revive(self) -> None:
        """Replace what died."""
        ...


def carry_out(
    pool: Pool[Item, Result],
    items: Iterable[Item],
    count: int,
    keep: Callable[[Sequence[Result]], None],
    *,
    lost: Callable[[Item, str], Result],
    tell: Callable[[int], None] | None = None,
    ahead: int = AHEAD,
    until: float = math.inf,
) -> bool:
    """Do all items; the result of each is kept once, in whatever order they end.

    Items whose worker died are done again, one by one; of one that takes its worker along twice the result is what ``lost`` says.

    Parameters
    ----------
    items : are taken as they are needed. count : of items.
    keep : is given results, in this process. lost : the result of an item that kills workers, from the item and the reason in a sentence.
    tell : is given how many are done. ahead : batches that are handed to each worker, one at work and the rest behind it.
    until : nothing new is begun after this [s, monotonic].

    Returns
    -------
    Whether all are done.

    Raises
    ------
    Whatever a worker raises that is no item's own fault (its disk is full, it has not the same rille); what ended by then is kept.
    """
    waiting, taken, done = iter(items), 0, 0
    suspects: deque[Item] = deque()
    running: dict[Future[Batch[Result]], list[Item]] = {}
    seconds, finished = 0.0, 0

    def take(future: Future[Batch[Result]]) -> bool:
        """Keep the results of a batch; whether its worker lived."""
        nonlocal done, seconds, finished
        whose = running.pop(future)
        try:
            batch = future.result()
        except pool.deaths:
            suspects.extend(whose)
            return False
        keep(batch.results)
        done, finished = done + len(batch.results), finished + len(batch.results)
        seconds += batch.seconds
        if tell is not None:
            tell(done)
        return True

    while True:
        if suspects and not running:
            done += _one_by_one(pool, suspects, keep, lost)
            if tell is not None:
                tell(done)
        while taken < count and not suspects and len(running) < ahead * pool.size and time.monotonic() < until:
            batch = list(islice(waiting, _size(seconds, finished, count - taken, pool.size)))
            taken += len(batch)
            running[pool.submit(batch)] = batch
        if not running:
            return taken == count
        ended, _ = wait(running, return_when=FIRST_COMPLETED)
        if not all([take(batch) for batch in sorted(ended, key=_failed)]):  # results first
            for batch in list(running):  # of a process pool they all broke with the one; of a cluster they may be whole
                take(batch)
            pool.revive()


def _failed(batch: Future[Batch[Result]]) -> bool:
    return batch.cancelled() or batch.exception() is not None


def _size(seconds: float, finished: int, left: int, workers: int) -> int:
    """Items of the next batch."""
    worth = 1 if finished < workers else math.ceil(WORTH * finished / max(seconds, 1e-6))
    return max(1, min(worth, left // (SHARE * workers), left))


def _one_by_one(
    pool: Pool[Item, Result], suspects: deque[Item], keep: Callable[[Sequence[Result]], None], lost: Callable[[Item, str], Result]
) -> int:
    """Do items of dead workers with nothing beside them, so that it is known whose fault a death is. Returns how many."""
    count = len(suspects)
    while suspects:
        item, results = suspects[0], list[Result]()
        for _ in range(2):
            try:
                results = pool.submit([item]).result().results
                break
            except pool.deaths as death:
                pool.revive()
                results = [lost(item, f"the worker process died twice while it was at this ({type(death).__name__})")]
        keep(results)
        suspects.popleft()
    return count
