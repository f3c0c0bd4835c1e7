"""What a worker of a study knows: the model as bytes, what its factors change, what is asked. It runs anywhere and needs no common disk."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from rille.cli.sweep_ground import put_under, with_numbers
from rille.model import InputRefused, Scenario
from rille.model.study import Case, CaseResult, Change, ChannelMeasure, TracedChannel
from rille.simulate.case import CaseRunner, Setting

GROUNDS = 4  # variants of the ground that are held in memory


@dataclass(frozen=True, slots=True, kw_only=True)
class CasesOfModel:
    """Runs cases.

    key : digest of all the rest. content : the database. changes : of each factor. constants : that all cases have. scene : text of the
    ground's scene; '' if it does not vary.
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

    def __call__(self, cases: Sequence[Case]) -> list[CaseResult]:
        """Results of cases, in their order; a case that fails is one of them."""
        with _lock:
            if self.key not in _opened:
                _opened.clear()  # one study at a time
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
            model = self._on(ground)
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


_opened: dict[str, _Opened] = {}  # of this process
_lock = Lock()
