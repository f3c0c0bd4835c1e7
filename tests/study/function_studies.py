"""Studies whose cases are a formula: the machinery without a simulator. Importable by workers."""

import math
import os
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rille.model.study import Case, CaseResult, Design, Factor, Measure, StudyPlan

A, B = 7.0, 0.1


def plan(design: Design, samples: int, factors: tuple[Factor, ...], **more) -> StudyPlan:
    """A study of one outcome y."""
    measures = (Measure(name="y", unit="-", meaning="of the formula", main=True),)
    return StudyPlan(
        name="formula", design=design, samples=samples, seed=4, second_order=more.pop("second_order", False), factors=factors,
        measures=measures, **more,
    )  # fmt: skip


def angles(count: int = 3) -> tuple[Factor, ...]:
    """Factors of Ishigami's function: uniform in -pi to pi."""
    return tuple(Factor(name=f"x{k + 1}", unit="-", spread="uniform", low=-math.pi, high=math.pi) for k in range(count))


@dataclass(frozen=True)
class Ishigami:
    """y = sin x1 + a sin^2 x2 + b x3^4 sin x1 (Ishigami & Homma 1990)."""

    def __call__(self, cases: Sequence[Case]) -> list[CaseResult]:
        results = []
        for case in cases:
            x1, x2, x3 = case.values
            y = math.sin(x1) + A * math.sin(x2) ** 2 + B * x3**4 * math.sin(x1)
            results.append(CaseResult(number=case.number, status="done", outcomes={"y": y}, seconds=1e-5))
        return results


@dataclass(frozen=True)
class Deadly:
    """y = x; the worker of some cases dies: always, or only once, which a file remembers."""

    folder: Path
    always: frozenset[int] = frozenset()
    once: frozenset[int] = frozenset()

    def __call__(self, cases: Sequence[Case]) -> list[CaseResult]:
        results = []
        for case in cases:
            mark = self.folder / str(case.number)
            if case.number in self.always or (case.number in self.once and not mark.exists()):
                mark.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            time.sleep(0.002)
            results.append(CaseResult(number=case.number, status="done", outcomes={"y": case.values[0]}, seconds=0.002))
        return results


@dataclass(frozen=True)
class Broken:
    """A worker that cannot work: that is nobody's case."""

    def __call__(self, cases: Sequence[Case]) -> list[CaseResult]:
        raise ImportError("no such module here")
