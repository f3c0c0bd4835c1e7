"""Cases on workers: in batches that grow until they are worth their transport, kept as they come, and no worker's death loses one."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Protocol

from rille.model.study import Case, CaseResult

WORTH = 0.5  # [s] of work that a batch holds, once it is known how long a case takes
AHEAD = 2  # batches for each worker, one at work and one behind it: no worker waits for this process
SHARE = 3  # a batch holds at most this part of what is left for each worker: all end together

Work = Callable[[Sequence[Case]], list[CaseResult]]


class Pool(Protocol):
    """Workers that each know how to run cases."""

    deaths: tuple[type[BaseException], ...]
    """What a future raises if its worker died."""

    @property
    def size(self) -> int:
        """Workers."""
        ...

    def submit(self, cases: Sequence[Case]) -> "Future[list[CaseResult]]":
        """Begin a batch."""
        ...

    def revive(self) -> None:
        """Replace what died."""
        ...


def carry_out(
    pool: Pool, cases: Sequence[Case], keep: Callable[[Sequence[CaseResult]], None], *, tell: Callable[[int], None] | None = None
) -> None:
    """Run all cases; each is kept once, in whatever order they end.

    Cases whose worker died are run again, one by one; one that takes its worker along twice is a result with the status ``worker_died``.

    Parameters
    ----------
    keep : is given finished cases, in this process. tell : is given how many are done.

    Raises
    ------
    Whatever a worker raises that is no case's own fault (it has not the same rille).
    """
    waiting, suspects, done = deque(cases), deque[Case](), 0
    running: dict[Future[list[CaseResult]], list[Case]] = {}
    seconds, finished = 0.0, 0

    def take(batch: Future[list[CaseResult]]) -> bool:
        """Keep the results of a batch; whether its worker lived."""
        nonlocal done, seconds, finished
        whose = running.pop(batch)
        try:
            results = batch.result()
        except pool.deaths:
            suspects.extend(whose)
            return False
        keep(results)
        done, finished = done + len(results), finished + len(results)
        seconds += sum(result.seconds for result in results)
        if tell is not None:
            tell(done)
        return True

    while waiting or running or suspects:
        if suspects and not running:
            done += _one_by_one(pool, suspects, keep)
            if tell is not None:
                tell(done)
        while waiting and not suspects and len(running) < AHEAD * pool.size:
            batch = [waiting.popleft() for _ in range(_size(seconds, finished, len(waiting), pool.size))]
            running[pool.submit(batch)] = batch
        if running:
            ended, _ = wait(running, return_when=FIRST_COMPLETED)
            if not all([take(batch) for batch in ended]):
                for batch in list(running):  # of a process pool they all broke with the one; of a cluster they may be whole
                    take(batch)
                pool.revive()


def _size(seconds: float, finished: int, left: int, workers: int) -> int:
    """Cases of the next batch."""
    worth = 1 if finished < workers else math.ceil(WORTH * finished / max(seconds, 1e-6))
    return max(1, min(worth, left // (SHARE * workers), left))


def _one_by_one(pool: Pool, suspects: deque[Case], keep: Callable[[Sequence[CaseResult]], None]) -> int:
    """Run cases of dead workers with nothing beside them, so that it is known whose fault a death is. Returns how many."""
    count = len(suspects)
    while suspects:
        case, results = suspects[0], list[CaseResult]()
        for _ in range(2):
            try:
                results = pool.submit([case]).result()
                break
            except pool.deaths as death:
                pool.revive()
                why = f"the worker process died twice while it ran this case ({type(death).__name__})"
                results = [CaseResult(number=case.number, status="worker_died", reason=why)]
        keep(results)
        suspects.popleft()
    return count
