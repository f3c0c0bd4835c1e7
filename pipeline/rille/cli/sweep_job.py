"""What a worker of a study knows: the model as bytes, what its factors change, what is asked. It runs anywhere and needs no common disk."""

import errno
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from rille import __version__
from rille.cli.sweep_ground import put_under, with_numbers
from rille.model import InputRefused, MachineFailed, Scenario
from rille.model.study import Case, CaseResult, Change, ChannelMeasure, TracedChannel
from rille.simulate.case import CaseRunner, Setting

GROUNDS = 4  # variants of the ground that are held in memory
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # of a disk
NO_ROOM_OF_SQLITE = ("SQLITE_FULL", "SQLITE_IOERR", "SQLITE_CANTOPEN")  # the same where SQLite writes; names of its errors begin so


@dataclass(frozen=True, slots=True, kw_only=True)
class CasesOfModel:
    """Runs cases.

    key : digest of all the rest. content : the database. changes : of each factor. constants : that all cases have. scene : text of the
    ground's scene; '' if it does not vary. version : of the rille that began the study.
    """

    key: str
    content: bytes
    scenario: Scenario
    changes: tuple[tuple[Change, ...], ...]
    constants: tuple[Setting, ...]
    channels: tuple[ChannelMeasure, ...]
    traced: tuple[TracedChannel, ...]
    trace_time: tuple[float, ...]
    scene: str = ""
    version: str = __version__

    def __call__(self, cases: Sequence[Case]) -> list[CaseResult]:
        """Results of cases, in their order; a case that fails is one of them.

        Raises
        ------
        MachineFailed : if there is no room on the disk, which is no case's fault.
        InputRefused : if the worker has another rille than who began the study, or the model cannot be simulated.
        """
        if self.version != __version__:
            raise InputRefused(f"a worker has rille {__version__}, the study was begun by {self.version}; install the same on all of them")
        with _lock:
            if self.key not in _opened:
                _opened.clear()  # one study at a time
                with _machine_told_apart():
                    _opened[self.key] = _Opened(self)
            opened = _opened[self.key]
        return [opened.run(case) for case in cases]


class _Opened:
    """The model of a job in this process."""

    def __init__(self, job: CasesOfModel) -> None:
        self._job = job
        self._folder = tempfile.TemporaryDirectory(prefix="rille-sweep-")
        self._path = Path(self._folder.name) / "model.db"
        self._path.write_bytes(job.content)
        self._runner = CaseRunner(self._path, job.scenario, channels=job.channels, traced=job.traced, trace_time=job.trace_time)
        self._grounds: dict[tuple[Setting, ...], Any] = {}
        self._lock = Lock()

    def run(self, case: Case) -> CaseResult:
        pairs = zip(self._job.changes, case.values, strict=True)
        settings = [*self._job.constants, *((change, value) for changes, value in pairs for change in changes)]
        ground = tuple((change, value) for change, value in settings if change.kind == "ground")
        if not ground:
            return self._runner.run(case.number, settings)
        try:
            with _machine_told_apart():
                model = self._on(ground)
        except MachineFailed:
            raise
        except InputRefused as refusal:
            return CaseResult(number=case.number, status="refused", reason=str(refusal))
        return self._runner.run(case.number, settings, model)

    def _on(self, ground: tuple[Setting, ...]) -> Any:
        """The model on that ground."""
        with self._lock:
            if ground not in self._grounds:
                path = Path(self._folder.name) / "ground.db"
                put_under(path, self._path, with_numbers(self._job.scene, dict(ground)), self._job.scenario)
                while len(self._grounds) >= GROUNDS:
                    del self._grounds[next(iter(self._grounds))]
                self._grounds[ground] = self._runner.read(path)
            return self._grounds[ground]


@contextmanager
def _machine_told_apart() -> Iterator[None]:
    """A full disk is the machine's failure, whoever met it and however it was told."""
    try:
        yield
    except Exception as error:
        full = _no_room(error)
        if full is None:
            raise
        where = tempfile.gettempdir()
        raise MachineFailed(f"no room for a worker in '{where}' ({full}); make some, or set TMPDIR; the same command goes on") from error


def _no_room(error: BaseException | None) -> BaseException | None:
    """The full disk behind an error, if there is one."""
    if error is None:
        return None
    full = isinstance(error, OSError) and error.errno in NO_ROOM
    full = full or getattr(error, "sqlite_errorname", "").startswith(NO_ROOM_OF_SQLITE)
    return error if full else _no_room(error.__cause__ or error.__context__)


_opened: dict[str, _Opened] = {}  # of this process
_lock = Lock()
