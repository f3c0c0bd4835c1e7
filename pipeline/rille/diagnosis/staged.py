"""Stages of a diagnosis: kept by whoever asked for it, told how far they are, timed."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, TypeVar

T = TypeVar("T")
Stage = Callable[[str, Callable[[], Any]], Any]
Progress = Callable[[str, float], None]
Told = Callable[[float, float, str], None]


def at_once(name: str, compute: Callable[[], T]) -> T:
    """A stage that keeps nothing."""
    return compute()


@dataclass(slots=True)
class Staged:
    """Tells how far the whole is, and how long each stage took. seconds : by name."""

    tell: Progress
    stage: Stage
    seconds: dict[str, float] = field(default_factory=dict)

    def run(self, name: str, first: float, last: float, compute: Callable[[Told], T]) -> T:
        """A stage that takes the progress from ``first`` to ``last``."""

        def told(done: float, total: float, what: str) -> None:
            self.tell(f"{name}: {what}", first + (last - first) * min(1.0, done / max(total, 1e-9)))

        self.tell(name, first)
        begin = perf_counter()
        result = self.stage(name, lambda: compute(told))
        self.seconds[name] = perf_counter() - begin
        return result
