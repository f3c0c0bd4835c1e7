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
    """Tells how far the whole is, and how long each stage took.

    seconds : by name. look : what all names begin with. begin : fraction of the whole at which it begins.
    """

    tell: Progress
    stage: Stage
    seconds: dict[str, float] = field(default_factory=dict)
    look: str = ""
    begin: float = 0.0

    def again(self, look: str, begin: float) -> "Staged":
        """The same stages once more, under names of their own, from a fraction of the whole on."""
        return Staged(tell=self.tell, stage=self.stage, seconds=self.seconds, look=f"{self.look}{look}: ", begin=begin)

    def run(self, name: str, first: float, last: float, compute: Callable[[Told], T]) -> T:
        """A stage that takes the progress from ``first`` to ``last``."""

        full = self.look + name

        def tell(what: str, fraction: float) -> None:
            self.tell(what, self.begin + (1.0 - self.begin) * fraction)

        def told(done: float, total: float, what: str) -> None:
            tell(f"{full}: {what}", first + (last - first) * min(1.0, done / max(total, 1e-9)))

        tell(full, first)
        begin = perf_counter()
        result = self.stage(full, lambda: compute(told))
        self.seconds[full] = perf_counter() - begin
        return result
