"""Replays of many models on the workers of a Dask cluster: each holds the model once, and is told what to change in it.

Workers need rille in the same version. The database is sent to them once, so that they need no common disk.
"""

import hashlib
import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect
from rille.model.recording import Channel, Recording
from rille.simulate.prediction import Picks
from rille.simulate.replay import Replayer

Array = NDArray[np.float64]
SHARES = 3  # pieces of work per worker: few enough to be cheap, enough that a slow worker holds up little


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """What ``Replayer.changed`` is given."""

    effects: tuple[Effect, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    step: float | None = None
    integrator: str | None = None


class ClusterReplayer:
    """A :class:`Replayer` whose ``predict_many`` is done by the workers of a cluster; all else is done here."""

    def __init__(self, client: Any, path: Path | str, scenario: str | None = None) -> None:
        """client : of Dask. path, scenario : as of ``Replayer``."""
        content = Path(path).read_bytes()
        self._client = client
        self._own = Replayer(path, scenario)
        self._place = (hashlib.sha256(content).hexdigest(), scenario)
        self._content = client.scatter(content, broadcast=True, hash=False)
        self._recording: Any = None
        self._changes: tuple[Change, ...] = ()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)

    def drive_by(self, recording: Recording) -> None:
        """As of ``Replayer``; workers are sent the commands."""
        self._own.drive_by(recording)
        kept = [
            channel if channel.role == "command" else replace(channel, time=channel.time[:0], value=channel.value[:0])
            for channel in recording.channels
        ]
        self._recording = self._client.scatter(replace(recording, channels=tuple(kept)), broadcast=True, hash=False)

    def changed(
        self,
        effects: Sequence[Effect] = (),
        parameters: Mapping[str, float] | None = None,
        step: float | None = None,
        integrator: str | None = None,
    ) -> "ClusterReplayer":
        """As of ``Replayer``."""
        made = object.__new__(ClusterReplayer)
        change = Change(effects=tuple(effects), parameters=dict(parameters or {}), step=step, integrator=integrator)
        made._client, made._place, made._content, made._recording = self._client, self._place, self._content, self._recording
        made._own = self._own.changed(effects, parameters, step, integrator)
        made._changes = (*self._changes, change)
        return made

    def predict_many(
        self,
        others: Sequence["ClusterReplayer"],
        states: Array,
        stops: Array,
        channels: Sequence[Channel],
        picks: Picks,
        carried: bool = False,
    ) -> list[Array]:
        """As of ``Replayer``, the models in pieces on the workers."""
        pieces = min(len(others), SHARES * max(1, len(self._client.nthreads())))
        if pieces < 2:
            return self._own.predict_many([other._own for other in others], states, stops, channels, picks, carried)
        size = math.ceil(len(others) / pieces)
        shared = self._client.scatter((states, stops, list(channels), list(picks), carried), broadcast=True, hash=False)
        asked = [
            self._client.submit(
                _answer,
                self._place,
                self._content,
                self._recording,
                [other._changes for other in others[first : first + size]],
                shared,
                pure=False,
            )
            for first in range(0, len(others), size)
        ]
        parts = self._client.gather(asked)
        return [np.concatenate(answers) for answers in zip(*parts, strict=True)] if channels else []


_loaded: dict[tuple[str, str | None], Replayer] = {}  # of this worker


def _answer(
    place: tuple[str, str | None], content: bytes, recording: Recording | None, models: Sequence[tuple[Change, ...]], shared: tuple
) -> list[Array]:
    """On a worker: what the channels would have shown with each of the models."""
    if place not in _loaded:
        with tempfile.TemporaryDirectory(prefix="rille-") as folder:
            path = Path(folder) / "model.db"
            path.write_bytes(content)
            _loaded[place] = Replayer(path, place[1])
    base = _loaded[place].changed()
    if recording is not None:
        base.drive_by(recording)
    made = []
    for changes in models:
        model = base
        for change in changes:
            model = model.changed(change.effects, change.parameters, change.step, change.integrator)
        made.append(model)
    states, stops, channels, picks, carried = shared
    return base.predict_many(made, states, stops, channels, picks, carried)
