"""What a replay's page holds: scene, layout and runs, compressed."""

import base64
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import Event

Array = NDArray[np.float64]
MOST_NUMBERS = 6_000_000  # of all states of a page: about 15 MB of it


@dataclass(frozen=True, slots=True, kw_only=True)
class Extra:
    """A channel of its own for the plots: time (n,) [s], values (n,) [unit]."""

    label: str
    unit: str
    time: Array
    values: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """A run, or a recording, as a page shows it: time (n,) [s], states (n, size)."""

    label: str
    time: Array
    states: NDArray[np.float32]
    events: Sequence[Event] = ()
    extra: Sequence[Extra] = ()


def source(layout: dict[str, Any], scene: bytes, runs: Sequence[Shown], mode: Literal["single", "ghost", "side"]) -> dict[str, Any]:
    """The JSON of a page. Of runs with more states than ``MOST_NUMBERS`` every second, third ... one is shown; events all are."""
    return {
        "kind": "replay",
        "layout": layout,
        "scene": blob(scene),
        "runs": [_run(run, max(1, MOST_NUMBERS // max(1, len(runs)))) for run in runs],
        "mode": mode,
    }


def blob(content: bytes) -> dict[str, str]:
    """Bytes as the page reads them."""
    return {"base64": base64.b64encode(zlib.compress(content, 6)).decode(), "encoding": "deflate"}


def _run(run: Shown, most: int) -> dict[str, Any]:
    n, size = run.states.shape
    stride = max(1, -(-n * size // most))
    chosen = np.unique(np.append(np.arange(0, n, stride), n - 1)) if n else np.empty(0, int)
    return {
        "label": run.label,
        "time": blob(run.time[chosen].astype("<f8").tobytes()),
        "states": blob(np.ascontiguousarray(run.states[chosen], "<f4").tobytes()),
        "events": [{"time": e.time, "kind": e.kind, "subject": e.subject, "message": e.message} for e in run.events],
        "extra": [
            {
                **{"label": channel.label, "unit": channel.unit},
                **{"time": blob(channel.time.astype("<f8").tobytes()), "values": blob(channel.values.astype("<f8").tobytes())},
            }
            for channel in run.extra
        ],
    }
