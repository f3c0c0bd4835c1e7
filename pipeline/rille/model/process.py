"""Processes that do not outlive the program that began them, and do not get into each other's way."""

import ctypes
import os
import platform
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

ONE_THREAD: Mapping[str, str] = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Variables that keep linear algebra to one processor, where as many processes work as there are processors."""
SAME_ROUNDING: Mapping[str, str] = (
    {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
    if platform.machine() in ("x86_64", "AMD64")
    else {}
)
"""Variables under which a process whose Python has not imported NumPy yet rounds as on any x86-64 processor with AVX2: with AVX-512 the
``exp`` and ``log`` of NumPy and the products of OpenBLAS differ in the last digit.
"""
PARENT_DEATH_SIGNAL = 1  # of prctl(2)


def end_with_parent(how: signal.Signals = signal.SIGTERM, parent: int | None = None) -> None:
    """Let this process end when the one that began it is killed, rather than work on for nobody (Linux; elsewhere nothing).

    how : signal that ends it. parent : process number of the beginner; where that is gone already, this one ends at once.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PARENT_DEATH_SIGNAL, how, 0, 0, 0)
        if parent is not None and os.getppid() != parent:
            os.kill(os.getpid(), how)


@contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Environment variables have these values meanwhile, for this process and those that it starts."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
